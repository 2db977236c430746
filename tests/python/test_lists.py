"""All hits and counts, against every triangle in float64."""

import numpy as np
import pytest

import hiprt
from oracle import judge
from shapes import rays_at, same, soup, sphere


@pytest.mark.parametrize("options", ({"quality": "fast"}, {"quality": "high"},
                                     {"builder": "hploc", "presplit_budget": 4}))
@pytest.mark.parametrize("precision", ("watertight", "reference", "double"))
def test_all_hits_are_those_of_brute_force(rng, options, precision):
    vertices, indices = soup(rng, 200)
    scene = hiprt.build(hiprt.Mesh(vertices, indices), **options)
    origins, directions = rays_at(rng, 1500)
    judged = judge(vertices, indices, origins, directions)
    hits = scene.list(origins, directions, precision=precision)
    listed = np.zeros(judged.hit.shape, int)
    np.add.at(listed, (hits.rays, hits.primitive), 1)
    assert listed.max() == 1  # Once, although builders split triangles.
    assert ((listed == 1) == judged.hit)[~judged.maybe].all()
    assert judged.maybe.mean() < 0.05 and judged.hit.sum() > 1500
    assert (np.diff(hits.offsets) == scene.count(origins, directions, precision=precision)).all()
    certain = judged.hit[hits.rays, hits.primitive]
    difference = np.abs(hits.t - judged.t[hits.rays, hits.primitive])
    assert (difference[certain] <= 2e-4 * (1 + np.abs(hits.t[certain]))).all()


def test_lists_are_in_order_and_begin_with_the_closest_hit(rng):
    scene = hiprt.build(hiprt.Mesh(*soup(rng, 2000)))
    origins, directions = rays_at(rng, 3000)
    hits = scene.list(origins, directions)
    later = hits.rays[1:] == hits.rays[:-1]
    assert (np.diff(hits.t)[later] >= 0).all()
    closest = scene.cast(origins, directions)
    first = hits.offsets[:-1][closest.found]
    for name in ("t", "u", "v", "geometry", "primitive"):
        assert (getattr(hits, name)[first] == getattr(closest, name)[closest.found]).all()
    assert (np.diff(hits.offsets)[~closest.found] == 0).all()
    assert same(hits, scene.list(origins, directions, threads=1))


@pytest.mark.parametrize("most", (0, 1, 3, 1000))
def test_max_hits_keeps_the_first(rng, most):
    scene = hiprt.build(hiprt.Mesh(*soup(rng, 500)))
    origins, directions = rays_at(rng, 1100)
    every, some = scene.list(origins, directions), scene.list(origins, directions, max_hits=most)
    assert (np.diff(some.offsets) == np.minimum(np.diff(every.offsets), most)).all()
    place = np.arange(len(every.t)) - every.offsets[every.rays]
    assert (some.t == every.t[place < most]).all() and (some.primitive == every.primitive[place < most]).all()
    with pytest.raises(hiprt.InputError, match="max_hits: -1 is negative"):
        scene.list(origins, directions, max_hits=-1)


def test_equal_distances_are_in_the_order_of_geometry_and_primitive():
    triangle = np.array([[-1, -1, 0], [3, -1, 0], [-1, 3, 0]], np.float32)
    meshes = [hiprt.Mesh(np.tile(triangle, (3, 1))), hiprt.Mesh(np.tile(triangle, (2, 1)))]
    for quality in ("fast", "balanced", "high"):
        hits = hiprt.build(meshes, quality).list(np.array([[0, 0, 1]], np.float32), np.array([[0, 0, -1]], np.float32))
        assert hits.geometry.tolist() == [0, 0, 0, 1, 1] and hits.primitive.tolist() == [0, 1, 2, 0, 1]


def test_reference_counts_crossings_exactly(rng):
    """Also of rays through vertices and edges: the parity says whether a point is inside."""
    vertices, indices = sphere(16)
    scene = hiprt.build(hiprt.Mesh(vertices, indices), "high")
    targets = np.concatenate((vertices, 0.5 * (vertices[indices[:, 0]] + vertices[indices[:, 1]]).astype(np.float32)))
    for inside in (True, False):
        origins = rng.uniform(-0.5, 0.5, targets.shape).astype(np.float32) + (0 if inside else 3)
        counts = scene.count(origins, targets - origins, precision="reference")
        assert (counts % 2 == inside).all()


def test_empty_batches_and_shapes(rng):
    scene = hiprt.build(hiprt.Mesh(*sphere()))
    nothing = scene.list(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32))
    assert nothing.offsets.tolist() == [0] and len(nothing.t) == 0 and nothing.instances.shape == (0, 0)
    grid = scene.list(rng.uniform(-1, 1, (5, 7, 3)).astype(np.float32), np.array([0, 0, 1], np.float32))
    assert len(grid.offsets) == 36
    assert scene.count(np.zeros((5, 7, 3)), [0, 0, 1.0]).shape == (5, 7)
