"""Instances on several levels, with masks, ids and motion."""

import numpy as np
import pytest

import hiprt
from oracle import check_closest, judge
from shapes import rays_at, same, soup, sphere


def random_matrices(rng, count, spread=2.0):
    """Rotation, scale, shear and translation."""
    matrices = np.zeros((count, 3, 4))
    matrices[:, :, :3] = np.eye(3) * rng.uniform(0.5, 1.5, (count, 1, 1)) + rng.normal(0, 0.2, (count, 3, 3))
    matrices[:, :, 3] = rng.uniform(-spread, spread, (count, 3))
    return matrices.astype(np.float32)


def placed(vertices, matrices):
    return np.einsum("kij,nj->kni", matrices[:, :, :3].astype(float), vertices) + matrices[:, None, :, 3]


def test_hits_are_those_of_the_placed_triangles(rng):
    vertices, indices = soup(rng, 40)
    matrices = random_matrices(rng, 6)
    scene = hiprt.build(hiprt.Instances(hiprt.build(hiprt.Mesh(vertices, indices)), matrices))
    assert scene.levels == 1 and scene.primitives == 6
    everything = placed(vertices, matrices).reshape(-1, 3)
    faces = np.concatenate([indices.astype(int) + i * len(vertices) for i in range(6)])
    origins, directions = rays_at(rng, 1500, -2, 2, 8)
    judged = judge(everything, faces, origins, directions)
    for precision in ("watertight", "reference", "fast", "double"):
        hits = scene.cast(origins, directions, precision=precision)
        assert hits.instances.shape == (1500, 1)
        number = np.where(hits.found, hits.instances[:, 0].astype(int) * 40 + hits.primitive, -1)
        assert check_closest(hits._replace(primitive=np.where(hits.found, number, hiprt.INVALID)), judged, 1e-3) > 1000
        assert (hits.instances[~hits.found] == hiprt.INVALID).all()
        listed = scene.list(origins, directions, precision=precision)
        seen = np.zeros(judged.hit.shape, int)
        np.add.at(seen, (listed.rays, listed.instances[:, 0].astype(int) * 40 + listed.primitive), 1)
        assert ((seen == 1) == judged.hit)[~judged.maybe].all() and seen.max() == 1
        assert (scene.occluded(origins, directions, precision=precision) == hits.found).all()


def test_levels_of_instances(rng):
    leaf = hiprt.build(hiprt.Mesh(*soup(rng, 30)))
    branch, tree = random_matrices(rng, 3, 0.5), random_matrices(rng, 4)
    nested = hiprt.build(hiprt.Instances(hiprt.Instances(leaf, branch), tree))
    assert nested.levels == 2 and nested.primitives == 4
    extended = np.concatenate((branch, np.tile([[[0, 0, 0, 1]]], (3, 1, 1))), axis=1)
    products = np.einsum("aij,bjk->abik", tree.astype(float), extended).reshape(12, 3, 4)
    flat = hiprt.build(hiprt.Instances(leaf, products))
    origins, directions = rays_at(rng, 1200, -2, 2, 8)
    a, b = nested.cast(origins, directions), flat.cast(origins, directions)
    assert a.instances.shape == (1200, 2)
    agree = a.found == b.found
    assert agree.mean() > 0.99
    both = a.found & b.found
    path = a.instances[both, 0].astype(int) * 3 + a.instances[both, 1]
    alike = (path == b.instances[both, 0]) & (a.primitive[both] == b.primitive[both])
    assert alike.mean() > 0.99 and np.allclose(a.t[both][alike], b.t[both][alike], rtol=1e-4)
    counts = nested.count(origins, directions), flat.count(origins, directions)
    assert (counts[0] == counts[1]).mean() > 0.98
    listed = nested.list(origins, directions)
    assert (np.diff(listed.offsets) == counts[0]).all()
    assert (listed.t[listed.offsets[:-1][a.found]] == a.t[a.found]).all()


def test_ties_are_in_the_order_of_paths():
    triangle = hiprt.build(hiprt.Mesh([[-1, -1, 0], [3, -1, 0], [-1, 3, 0]]))
    same_place = np.tile(np.eye(4), (3, 1, 1))
    ray = np.array([[0, 0, 1]], np.float32), np.array([[0, 0, -1]], np.float32)
    for quality in ("fast", "balanced", "high"):
        flat = hiprt.build(hiprt.Instances(triangle, same_place), quality)
        assert flat.list(*ray).instances.tolist() == [[0], [1], [2]]
        assert flat.cast(*ray).instances.tolist() == [[0]]
        nested = hiprt.build(hiprt.Instances([hiprt.Instances(triangle, same_place[:2]), triangle], same_place,
                                             which=[1, 0, 0]), quality)
        hits = nested.list(*ray)
        assert hits.instances.tolist() == [[0, hiprt.INVALID], [1, 0], [1, 1], [2, 0], [2, 1]]
        assert nested.cast(*ray).instances.tolist() == [[0, hiprt.INVALID]]
        assert nested.list(*ray, max_hits=2).instances.tolist() == hits.instances[:2].tolist()


def test_objects_masks_and_ids():
    vertices, indices = sphere()
    small, large = (hiprt.build(hiprt.Mesh(r * vertices, indices)) for r in (0.2, 0.4))
    matrices = np.tile(np.eye(4), (3, 1, 1))
    matrices[:, 0, 3] = 0, 2, 4
    scene = hiprt.build(hiprt.Instances([small, large], matrices, which=[1, 0, 1], masks=[1, 2, 4], ids=[50, 60, 70]))
    assert scene.instance_ids.tolist() == [50, 60, 70]
    origins = np.array([[0, 0, 1], [2, 0, 1], [4, 0, 1]], np.float32)
    hits = scene.cast(origins, np.array([0, 0, -1], np.float32))
    assert np.allclose(hits.t, [0.6, 0.8, 0.6], atol=1e-6) and hits.instances[:, 0].tolist() == [0, 1, 2]
    for mask in range(8):
        expected = [bool(mask & m) for m in (1, 2, 4)]
        assert scene.occluded(origins, [0, 0, -1], mask=mask, precision="watertight").tolist() == expected


def test_motion(rng):
    vertices, indices = sphere()
    ball = hiprt.build(hiprt.Mesh(0.5 * vertices, indices))
    keys = np.tile(np.eye(4)[:3], (1, 2, 1, 1))
    keys[0, 1, 0, 3] = 10
    scene = hiprt.build(hiprt.Instances(ball, keys, times=[0, 1]))
    origin, down = np.array([5, 0, 3], np.float32), np.array([0, 0, -1], np.float32)
    times = np.array([0.4, 0.46, 0.5, 0.54, 0.6], np.float32)
    assert scene.cast(origin, down, time=times).found.tolist() == [False, True, True, True, False]
    # Where the ball is at a time, rays hit as they hit a ball that stands there.
    for time in (0.0, 0.25, 0.8, 1.0):
        still = hiprt.build(hiprt.Instances(ball, [[[1, 0, 0, 10 * time], [0, 1, 0, 0], [0, 0, 1, 0]]]))
        origins, directions = rays_at(rng, 300, -0.5, 0.5)
        origins = origins + np.array([10 * time, 0, 0], np.float32)
        moving, standing = scene.cast(origins, directions, time=time), still.cast(origins, directions)
        assert (moving.found == standing.found).mean() > 0.98
        both = moving.found & standing.found
        assert np.allclose(moving.t[both], standing.t[both], atol=1e-3)


@pytest.mark.parametrize("motion", ("slerp", "nlerp", "matrix"))
def test_kinds_of_motion_meet_at_the_keys(rng, motion):
    spoke = hiprt.build(hiprt.Mesh([[0, 0, 0], [1, 0, 0], [1, 0.1, 0]]))
    turn = np.array([[[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]], [[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0]]]])
    scene = hiprt.build(hiprt.Instances(spoke, turn, times=[2, 3], motion=motion))
    down = [0, 0, -1]
    assert scene.cast([0.9, 0.05, 1], down, time=2.0).found and scene.cast([-0.05, 0.9, 1], down, time=3).found
    # Halfway a blended matrix has shrunk the spoke to 0.71 of its length.
    middle = np.array([0.9, 0.9, 0]) / np.sqrt(2) + [-0.03, 0.03, 1]
    assert scene.cast(middle, down, time=2.5).found == (motion != "matrix")


def test_wrong_instances_are_refused(rng):
    leaf = hiprt.build(hiprt.Mesh(*soup(rng, 10)))
    matrix = np.eye(4)[None]
    for arguments, message in (
            (((leaf, leaf), np.tile(matrix, (3, 1, 1))), "which: 3 transforms and 2 objects"),
            ((leaf, np.eye(4)), "transforms: expected k x 3 x 4"),
            ((leaf, matrix * 2), "last row of a 4 x 4 matrix is not 0 0 0 1")):
        with pytest.raises(hiprt.InputError, match=message):
            hiprt.Instances(*arguments)
    with pytest.raises(hiprt.InputError, match="which: there is no object 1; there are 1"):
        hiprt.Instances(leaf, matrix, which=[1])
    with pytest.raises(hiprt.InputError, match="motion: 'linear' is none of slerp, nlerp, matrix"):
        hiprt.Instances(leaf, matrix, motion="linear")
    with pytest.raises(hiprt.InputError, match="instance 0"):
        hiprt.build(hiprt.Instances(leaf, np.zeros((1, 3, 4))))
    with pytest.raises(hiprt.InputError, match="expected a hiprt.Scene or hiprt.Instances"):
        hiprt.build(hiprt.Instances("leaf", matrix))
    with pytest.raises(hiprt.InputError, match="objects of|instances|object"):
        hiprt.build(hiprt.Instances(hiprt.build(hiprt.Instances(leaf, matrix)), matrix))
    empty = hiprt.build(hiprt.Instances(leaf, np.zeros((0, 3, 4))))
    assert not empty.occluded([0, 0, 0], [0, 0, 1])


def test_files_of_instances(rng, tmp_path):
    leaf = hiprt.build(hiprt.Mesh(*soup(rng, 50)))
    for group in (leaf, hiprt.Instances(leaf, random_matrices(rng, 2))):
        scene = hiprt.build(hiprt.Instances(group, random_matrices(rng, 5)), "high")
        scene.save(tmp_path / "scene.bvh")
        origins, directions = rays_at(rng, 500, -2, 2, 8)
        assert same(scene.cast(origins, directions), hiprt.load(tmp_path / "scene.bvh").cast(origins, directions))
