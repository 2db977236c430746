"""Every ray against every triangle in float64, with margins: what must be a hit, what must be a miss, what may be both.

The intersection is solved by Cramer's rule (Moeller and Trumbore, 1997). It shares nothing with the library's tests,
which work in sheared space.
"""

from dataclasses import dataclass

import numpy as np

MARGIN = 1e-4  # Of barycentrics and relative distances; float32 rounding is hundreds of times smaller.


@dataclass
class Judgement:
    t: np.ndarray  # rays x triangles
    u: np.ndarray
    v: np.ndarray
    hit: np.ndarray  # Certainly.
    maybe: np.ndarray  # Too close to an edge or an end of the ray to say.


def judge(vertices, indices, origins, directions, tmin=0.0, tmax=np.inf) -> Judgement:
    p0, p1, p2 = (np.asarray(vertices, np.float64)[np.asarray(indices, np.int64)[:, k]] for k in range(3))
    o, d = np.asarray(origins, np.float64)[:, None], np.asarray(directions, np.float64)[:, None]
    e1, e2 = p1 - p0, p2 - p0
    h = np.cross(d, e2)
    det = (e1 * h).sum(-1)
    s = o - p0
    q = np.cross(s, e1)
    with np.errstate(divide="ignore", invalid="ignore"):
        u, v, t = (s * h).sum(-1) / det, (d * q).sum(-1) / det, (e2 * q).sum(-1) / det
        inside = np.minimum(np.minimum(u, v), 1 - u - v)
        size = MARGIN * (1 + np.abs(t))
        sizes = np.linalg.norm(e1, axis=1) * np.linalg.norm(e2, axis=1) * np.linalg.norm(d, axis=-1)
        grazing = np.abs(det) < 1e-5 * sizes
        hit = (inside > MARGIN) & (t > tmin + size) & (t < tmax - size) & ~grazing
        maybe = ~hit & (grazing | ((inside > -MARGIN) & (t > tmin - size) & (t < tmax + size)))
    return Judgement(t, u, v, hit, maybe)


def check_closest(hits, judged: Judgement, tolerance=2e-4) -> int:
    """Compares first hits where the judge is certain. Returns the number of rays that were judged."""
    far = np.where(judged.hit, judged.t, np.inf)
    best = far.argmin(axis=1)
    rows = np.arange(len(best))
    nearest = far[rows, best]
    # A doubtful triangle decides nothing if it lies behind the nearest hit.
    with np.errstate(invalid="ignore"):
        doubtful = (judged.maybe & ~(judged.t > nearest[:, None] * (1 + 1e-3) + 1e-3)).any(axis=1)
    second = np.where(np.arange(far.shape[1]) == best[:, None], np.inf, far).min(axis=1)
    gap = np.subtract(second, nearest, out=np.full(len(best), np.inf), where=np.isfinite(nearest))
    clear = ~doubtful & ((gap > 1e-3 * (1 + np.abs(nearest))) | np.isinf(nearest))
    expected = np.isfinite(nearest)
    assert (np.asarray(hits.found)[clear] == expected[clear]).all()
    both = clear & expected
    assert (hits.primitive[both] == best[both]).all()
    for name in ("t", "u", "v"):
        difference = np.abs(getattr(hits, name)[both] - getattr(judged, name)[rows, best][both])
        assert (difference <= tolerance * (1 + np.abs(nearest[both]))).all(), name
    return int(clear.sum())
