"""Closest points, the k nearest, all within a distance, and the side, against every triangle in float64."""

from pathlib import Path

import numpy as np
import pytest

import hiprt
from hiprt import Feature
from point_oracle import closest
from shapes import same, soup, sphere
from test_instances import placed, random_matrices

BUILDS = ({"quality": "fast"}, {"quality": "high"}, {"builder": "hploc", "presplit_budget": 4}, {"split_budget": 0},
          {"quality": "fast", "layout": "half"}, {"quality": "fast", "layout": "quantized"})


def points_at(rng, count, dtype=np.float32):
    """Most around the unit cube, some far away."""
    points = rng.uniform(-0.5, 1.5, (count, 3))
    points[: count // 10] *= 1000
    return points.astype(dtype)


def corners_of(vertices, indices, found):
    weights = np.stack((1 - found.u - found.v, found.u, found.v), axis=-1)
    return np.einsum("nk,nki->ni", weights, vertices.astype(float)[indices[found.primitive]])


@pytest.mark.parametrize("options", BUILDS)
@pytest.mark.parametrize("dtype", (np.float32, np.float64))
def test_the_closest_point_is_that_of_brute_force(rng, options, dtype):
    vertices, indices = soup(rng, 200)
    scene = hiprt.build(hiprt.Mesh(vertices, indices), **options)
    points = points_at(rng, 1500, dtype)
    found = scene.closest_point(points)
    distances, _ = closest(vertices, indices, points)
    epsilon = np.finfo(dtype).eps
    assert found.distance.dtype == dtype and found.point.dtype == dtype and found.found.all()
    scale = 4 + np.abs(points).max(axis=1)
    # The oracle's own rounding is about 1e-13 of the coordinates.
    assert (np.abs(found.distance - distances.min(axis=1)) <= scale * (epsilon + 1e-13)).all()
    assert (distances[np.arange(1500), found.primitive] <= distances.min(axis=1) + 1e-12 * scale).all()
    gap = np.linalg.norm(found.point.astype(float) - points, axis=1) - found.distance
    assert (np.abs(gap) <= 4 * scale * (epsilon + 1e-13)).all()
    assert np.allclose(corners_of(vertices, indices, found), found.point, rtol=0, atol=20 * max(epsilon, 1e-12))


def test_both_precisions_agree(rng):
    scene = hiprt.build(hiprt.Mesh(*soup(rng, 500)))
    points = points_at(rng, 2000)
    single, double = scene.closest_point(points), scene.closest_point(points, precision="double")
    for name in ("distance", "point", "u", "v"):
        assert getattr(double, name).dtype == np.float64
        assert (getattr(double, name).astype(np.float32) == getattr(single, name)).all()
    for name in ("geometry", "primitive", "feature"):
        assert (getattr(double, name) == getattr(single, name)).all()
    assert same(scene.closest_point(points.astype(float), precision="float"), single)
    assert same(scene.closest_point(points, threads=1), single)


def test_max_distance_is_the_last_that_counts():
    scene = hiprt.build(hiprt.Mesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)))
    point = np.array([0.25, 0.25, 2], np.float32)
    below = np.nextafter(np.float32(2), np.float32(0))
    found = scene.closest_point(point, [2, below, -1, np.nan, np.inf])
    assert found.found.tolist() == [True, False, False, False, True]
    assert found.distance.tolist() == [2, np.inf, np.inf, np.inf, 2]
    assert np.isnan(found.point[1:4]).all() and (found.primitive[1:4] == hiprt.INVALID).all()
    assert not scene.closest_point([[np.nan, 0, 0], [0, np.inf, 0]]).found.any()


def test_features_of_a_triangle():
    scene = hiprt.build(hiprt.Mesh(np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0]], np.float32)))
    found = scene.closest_point(np.array([[1, 1, 1], [1, -1, 0], [3, 3, 0], [-1, 1, 0], [-1, -1, 0], [6, -1, 0],
                                          [-1, 6, 0]], np.float32))
    assert [Feature(f) for f in found.feature] == list(Feature) and found.feature.dtype == np.uint8


@pytest.mark.parametrize("options", BUILDS)
@pytest.mark.parametrize("k", (1, 5, 300))
def test_the_k_nearest_are_those_of_brute_force(rng, options, k):
    vertices, indices = soup(rng, 200)
    scene = hiprt.build(hiprt.Mesh(vertices, indices), **options)
    points = points_at(rng, 60 if k == 300 else 300, np.float64)
    found = scene.nearest(points.reshape(2, -1, 3), k)
    assert found.distance.shape == (2, len(points) // 2, k) and found.point.shape == (2, len(points) // 2, k, 3)
    distances = np.sort(closest(vertices, indices, points)[0], axis=1)
    ours = found.distance.reshape(len(points), k)
    there = min(k, 200)
    assert np.allclose(ours[:, :there], distances[:, :there], rtol=1e-12, atol=1e-12)
    assert (ours[:, there:] == np.inf).all() and (found.primitive[..., there:] == hiprt.INVALID).all()
    ids = found.primitive.reshape(len(points), k)[:, :there]
    assert (np.diff(np.sort(ids, axis=1), axis=1) != 0).all()  # Each once, although builders split triangles.
    first = scene.closest_point(points)
    assert (ids[:, 0] == first.primitive).all() and (ours[:, 0] == first.distance).all()


@pytest.mark.parametrize("options", BUILDS)
def test_all_within_a_radius_are_those_of_brute_force(rng, options):
    vertices, indices = soup(rng, 200)
    scene = hiprt.build(hiprt.Mesh(vertices, indices), **options)
    points, radius = points_at(rng, 2000, np.float64), rng.uniform(0, 0.4, 2000)
    found = scene.within(points, radius)
    distances, _ = closest(vertices, indices, points)
    listed = np.zeros(distances.shape, int)
    np.add.at(listed, (found.queries, found.primitive), 1)
    clear = np.abs(distances - radius[:, None]) > 1e-12
    assert listed.max() == 1 and ((listed == 1) == (distances <= radius[:, None]))[clear].all()
    assert np.allclose(found.distance, distances[found.queries, found.primitive], rtol=1e-9, atol=1e-12)
    later = found.queries[1:] == found.queries[:-1]
    assert (np.diff(found.distance)[later] >= 0).all()
    assert len(found.offsets) == 2001 and len(found.distance) == found.offsets[-1] > 2000
    assert same(found, scene.within(points, radius, threads=1))
    nearest = scene.closest_point(points, radius)
    some = np.diff(found.offsets) > 0
    assert (nearest.found == some).all()
    for name in ("distance", "point", "u", "v", "geometry", "primitive", "feature"):
        assert (getattr(found, name)[found.offsets[:-1][some]] == getattr(nearest, name)[some]).all()


def test_equal_distances_are_in_the_order_of_geometry_and_primitive():
    triangle = np.array([[-1, -1, 0], [3, -1, 0], [-1, 3, 0]], np.float32)
    meshes = [hiprt.Mesh(np.tile(triangle, (3, 1)), mask=1), hiprt.Mesh(np.tile(triangle, (2, 1)), mask=2)]
    for quality in ("fast", "balanced", "high"):
        scene = hiprt.build(meshes, quality)
        near, within = scene.nearest([0, 0, 1.0], 5), scene.within([0, 0, 1.0], 1)
        for found in (near, within):
            assert found.geometry.tolist() == [0, 0, 0, 1, 1] and found.primitive.tolist() == [0, 1, 2, 0, 1]
        seen = scene.closest_point([0, 0, 1.0], mask=np.array([1, 2, 3, 4]))
        assert seen.geometry.tolist() == [0, 1, 0, hiprt.INVALID]


def test_two_levels_of_instances(rng):
    vertices, indices = soup(rng, 30)
    inner, outer = random_matrices(rng, 3), random_matrices(rng, 4)
    group = hiprt.Instances(hiprt.build(hiprt.Mesh(vertices, indices)), inner)
    scene = hiprt.build(hiprt.Instances(group, outer))
    assert scene.levels == 2
    all_vertices = placed(placed(vertices, inner).reshape(-1, 3), outer).reshape(-1, 3)
    all_indices = np.concatenate([indices.astype(int) + i * len(vertices) for i in range(12)])
    points = rng.uniform(-4, 4, (800, 3))
    distances, _ = closest(all_vertices, all_indices, points)
    for found, row in ((scene.closest_point(points), slice(None)), (scene.nearest(points, 3), 0)):
        assert found.instances.shape[-1] == 2
        number = (found.instances[..., 0] * 3 + found.instances[..., 1]) * 30 + found.primitive
        theirs = np.take_along_axis(distances, number.reshape(800, -1), 1).reshape(number.shape)
        assert np.allclose(found.distance, theirs, rtol=1e-5, atol=1e-5)
        assert np.allclose(found.distance.reshape(800, -1)[:, 0], distances.min(axis=1), rtol=1e-5, atol=1e-5)
    near = scene.within(points, 1.0)
    counts = np.diff(near.offsets)
    assert near.instances.shape == (len(near.distance), 2)
    assert (((distances < 0.9999).sum(axis=1) <= counts) & (counts <= (distances < 1.0001).sum(axis=1))).all()


def test_moving_instances(rng):
    vertices, indices = sphere()
    ball = hiprt.build(hiprt.Mesh(0.5 * vertices, indices))
    keys = np.tile(np.eye(4)[:3], (1, 2, 1, 1))
    keys[0, 1, 0, 3] = 10
    moving = hiprt.build(hiprt.Instances(ball, keys, times=[0, 1]))
    points, times = rng.uniform(-3, 13, (500, 3)), rng.uniform(0, 1, 500)
    expected = ball.closest_point(points - np.stack((10 * times, 0 * times, 0 * times), -1))
    assert np.allclose(moving.closest_point(points, time=times).distance, expected.distance, atol=1e-5)
    assert moving.occupancy([[5, 0, 0], [5, 0, 0]], time=[0, 0.5]).tolist() == [False, True]
    boxes = np.array([[4.9, -1, -1], [5.1, 1, 1]])
    assert (moving.count_overlaps(boxes, time=[0, 0.5, 1]) > 0).tolist() == [False, True, False]


def test_custom_primitives_are_refused():
    scene = hiprt.load(Path(__file__).resolve().parents[1] / "format" / "golden" / "custom.bvh")
    for query in (lambda: scene.closest_point([0, 0, 0]), lambda: scene.nearest([0, 0, 0], 2),
                  lambda: scene.within([0, 0, 0], 1), lambda: scene.signed_distance([0, 0, 0]),
                  lambda: scene.occupancy([0, 0, 0]), lambda: scene.overlap(np.zeros((2, 3))),
                  lambda: scene.count_overlaps(np.zeros((2, 3)))):
        with pytest.raises(hiprt.InputError, match="has custom primitives"):
            query()


def test_sides_and_signed_distances(rng):
    scene = hiprt.build(hiprt.Mesh(*sphere(40)))
    points = rng.uniform(-1.2, 1.2, (10, 500, 3))
    radius = np.linalg.norm(points, axis=-1)
    clear = (radius < 0.99) | (radius > 1)
    inside = scene.occupancy(points)
    assert inside.dtype == bool and inside.shape == (10, 500) and (inside == (radius < 1))[clear].all()
    distance = scene.signed_distance(points)
    assert distance.dtype == np.float64 and np.abs(distance - (radius - 1)).max() < 0.01
    assert ((distance < 0) == inside).all()
    assert (np.abs(distance) == scene.closest_point(points).distance).all()
    near = scene.signed_distance(points, 0.1)
    assert (np.isinf(near) == (np.abs(distance) > 0.1)).all() and ((near < 0) == inside).all()
    assert scene.signed_distance(points.astype(np.float32)).dtype == np.float32
    # Rays through vertices and edges count once.
    vertices, _ = sphere(40)
    below = vertices * [1, 1, 0] + [0, 0, 0]
    assert scene.occupancy(below[np.linalg.norm(below, axis=1) < 0.99]).all()


def test_sides_and_distances_are_those_of_trimesh(rng):
    trimesh = pytest.importorskip("trimesh")
    pytest.importorskip("rtree")
    pytest.importorskip("scipy")
    mesh = trimesh.creation.icosphere(subdivisions=2)
    mesh.vertices = mesh.vertices.astype(np.float32)
    scene = hiprt.build(mesh)
    points = rng.uniform(-1.5, 1.5, (400, 3)).astype(np.float32).astype(float)
    found = scene.closest_point(points)
    place, distance, _ = trimesh.proximity.closest_point(mesh, points)
    assert np.allclose(found.distance, distance, atol=1e-9) and np.allclose(found.point, place, atol=1e-7)
    # trimesh's signed distance is positive inside.
    assert np.allclose(scene.signed_distance(points), -trimesh.proximity.signed_distance(mesh, points), atol=1e-9)
    assert (scene.occupancy(points) == mesh.contains(points)).all()


def test_shapes_strides_and_empty_batches(rng):
    scene = hiprt.build(hiprt.Mesh(*soup(rng, 50)))
    points = rng.uniform(0, 1, (6, 7, 3)).astype(np.float32)
    expected = scene.closest_point(points)
    assert expected.distance.shape == (6, 7) and expected.instances.shape == (6, 7, 0)
    turned = scene.closest_point(np.asfortranarray(points)[::-1])
    assert (turned.distance == expected.distance[::-1]).all()
    one = scene.closest_point(points[2, 3])
    assert one.distance.shape == () and one.distance == expected.distance[2, 3]
    for empty in (np.zeros((0, 3)), np.zeros((4, 0, 3))):
        assert scene.closest_point(empty).point.shape == empty.shape
        assert scene.nearest(empty, 4).distance.shape == (*empty.shape[:-1], 4)
        assert scene.within(empty, 1).offsets.tolist() == [0]
        assert scene.occupancy(empty).shape == scene.signed_distance(empty).shape == empty.shape[:-1]
    nothing = hiprt.build(hiprt.Mesh(np.zeros((0, 3), np.float32))).nearest(points, 2)
    assert (nothing.distance == np.inf).all() and not nothing.found.any()


@pytest.mark.parametrize("call, message", (
    (lambda scene: scene.closest_point([1, 2]), r"points: expected ... x 3 numbers, found shape \(2,\)"),
    (lambda scene: scene.occupancy(3.0), r"points: expected ... x 3 numbers, found shape \(\)"),
    (lambda scene: scene.closest_point(np.zeros((2, 3)), [1, 2, 3]), "points, max_distance, mask and time have diff"),
    (lambda scene: scene.within(np.zeros((2, 3)), [1, 2, 3]), "points, radius, mask and time have different shapes"),
    (lambda scene: scene.closest_point([0, 0, 0], precision="fast"), "precision: 'fast' is none of float, double"),
    (lambda scene: scene.nearest([0, 0, 0], 0), "k: 0 is not between 1 and 1024; within"),
    (lambda scene: scene.nearest([0, 0, 0], 1025), "k: 1025 is not between"),
    (lambda scene: scene.closest_point([0, 0, 0], threads=-1), "threads: -1 is not between"),
    (lambda scene: scene.closest_point([0, 0, 0], mask=-1), r"mask\[\]: -1 is not between"),
))
def test_wrong_arguments_are_refused(rng, call, message):
    with pytest.raises(hiprt.InputError, match=message):
        call(hiprt.build(hiprt.Mesh(*soup(rng, 5))))
