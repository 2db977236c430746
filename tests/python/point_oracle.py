"""Distances of points from triangles, and separation of boxes and triangles, in float64, one by one."""

import numpy as np


def _dot(a, b):
    return np.einsum("...i,...i->...", a, b)


def _on_segment(points, a, b):
    along = b - a
    length = _dot(along, along)
    t = np.divide(_dot(points - a, along), length, out=np.zeros(np.broadcast(points, a).shape[:-1]), where=length > 0)
    return a + np.clip(t, 0, 1)[..., None] * along


def closest(vertices, indices, points):
    """n x m distances and n x m x 3 points: the foot of the perpendicular where it is inside, else the best edge's."""
    a, b, c = (vertices.astype(float)[indices[:, k]][None] for k in range(3))
    p = points.astype(float)[:, None]
    best = _on_segment(p, a, b)
    for end in (_on_segment(p, b, c), _on_segment(p, c, a)):
        nearer = _dot(end - p, end - p) < _dot(best - p, best - p)
        best = np.where(nearer[..., None], end, best)
    normal = np.cross(b - a, c - a)
    foot = p - (_dot(p - a, normal) / _dot(normal, normal))[..., None] * normal
    inside = np.ones(foot.shape[:-1], bool)
    for start, end in ((a, b), (b, c), (c, a)):
        inside &= _dot(np.cross(end - start, foot - start), normal) >= 0
    best = np.where(inside[..., None], foot, best)
    return np.linalg.norm(best - p, axis=-1), best


def box_gaps(vertices, indices, boxes):
    """n x m: the largest gap between a box and a triangle along the 13 axes that may separate them; < 0: they overlap.

    Gottschalk, Lin and Manocha, OBBTree, 1996: convex polyhedra are apart along a normal or a product of edges.
    """
    corners = vertices.astype(float)[indices]
    edges = np.roll(corners, -1, axis=1) - corners
    axes = [np.broadcast_to(axis, (len(corners), 3)) for axis in np.eye(3)]
    axes += [np.cross(edges[:, 0], edges[:, 1])]
    axes += [np.cross(axis, edges[:, k]) for axis in np.eye(3) for k in range(3)]
    low, high = (boxes.astype(float)[:, None, k] for k in range(2))
    gaps = np.full((len(boxes), len(corners)), -np.inf)
    for axis in axes:
        length = np.linalg.norm(axis, axis=1, keepdims=True)
        axis = np.divide(axis, length, out=np.zeros_like(axis), where=length > 1e-12)
        along = _dot(corners, axis[:, None])
        ends = np.stack((low * axis, high * axis))
        gap = np.maximum(along.min(1) - ends.max(0).sum(-1), ends.min(0).sum(-1) - along.max(1))
        gaps = np.maximum(gaps, np.where(length[:, 0] > 1e-12, gap, -np.inf))
    return gaps
