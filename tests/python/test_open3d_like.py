"""hiprt.open3d_like: shapes and dtypes by Open3D's documentation, and its results where it is installed."""

import numpy as np
import pytest

import hiprt
from hiprt.open3d_like import RaycastingScene
from shapes import rays_at, soup, sphere

try:
    import open3d
except ImportError:
    open3d = None
needs_open3d = pytest.mark.skipif(open3d is None, reason="Open3D is not here")

DTYPES = {"t_hit": np.float32, "geometry_ids": np.uint32, "primitive_ids": np.uint32, "primitive_uvs": np.float32,
          "primitive_normals": np.float32, "ray_splits": np.uint32, "ray_ids": np.uint32}


def two_meshes(rng, scene, make=lambda array: array):
    vertices, indices = soup(rng, 300)
    assert scene.add_triangles(make(vertices), make(indices)) == 0
    vertices, indices = sphere()
    assert scene.add_triangles(vertex_positions=make(0.5 * vertices), triangle_indices=make(indices)) == 1
    return scene


def some_rays(rng, *shape):
    return np.concatenate(rays_at(rng, int(np.prod(shape)), -0.7, 1.7), axis=1).reshape(*shape, 6)


def test_shapes_and_dtypes(rng):
    scene = two_meshes(rng, RaycastingScene())
    rays = some_rays(rng, 4, 5, 6)
    hits = scene.cast_rays(rays)
    tails = {"t_hit": (), "geometry_ids": (), "primitive_ids": (), "primitive_uvs": (2,), "primitive_normals": (3,)}
    assert set(hits) == set(tails)
    for key, tail in tails.items():
        assert hits[key].shape == (4, 5, 6) + tail and hits[key].dtype == DTYPES[key], key
        assert type(hits[key].numpy()) is np.ndarray
    miss = ~hits["t_hit"].isfinite().numpy()
    assert 0 < miss.sum() < miss.size
    assert (hits["geometry_ids"].numpy()[miss] == RaycastingScene.INVALID_ID).all()
    assert (hits["primitive_normals"].numpy()[miss] == 0).all() and (hits["primitive_uvs"].numpy()[miss] == 0).all()
    assert np.allclose(np.linalg.norm(hits["primitive_normals"], axis=-1)[~miss], 1, atol=1e-6)
    occluded = scene.test_occlusions(rays)
    assert occluded.dtype == bool and (occluded == ~miss).all()
    counts = scene.count_intersections(rays)
    assert counts.dtype == np.int32 and counts.shape == (4, 5, 6)
    listed = scene.list_intersections(rays)
    assert {key: value.dtype.type for key, value in listed.items()} == {key: DTYPES[key] for key in listed}
    assert listed["ray_splits"].shape == (121,) and (np.diff(listed["ray_splits"]) == counts.ravel()).all()
    assert (np.bincount(listed["ray_ids"], minlength=120) == counts.ravel()).all()
    assert listed["primitive_uvs"].shape == (counts.sum(), 2)


def test_tnear_and_tfar(rng):
    scene = RaycastingScene(nthreads=1)
    scene.add_triangles(*sphere())
    ray = np.array([[0, 0, 0, 0.05, 0.1, 1]], np.float32)
    t = float(scene.cast_rays(ray)["t_hit"][0])
    assert scene.test_occlusions(ray, 0, t * 1.01, 1).all() and not scene.test_occlusions(ray, tfar=t * 0.99).any()
    assert not scene.test_occlusions(ray, tnear=t * 1.01).any()


def test_meshes_can_be_added_later(rng):
    scene = RaycastingScene()
    ray = np.array([[0, 0, 0, 0, 0.1, 1]], np.float32)
    assert not scene.cast_rays(ray)["t_hit"].isfinite().any()
    scene.add_triangles(*sphere())
    assert scene.cast_rays(ray)["geometry_ids"].tolist() == [0]
    vertices, indices = sphere(radius=0.5)
    scene.add_triangles(vertices, indices)
    vertices[:] = np.nan  # The scene has a copy.
    assert scene.cast_rays(ray)["geometry_ids"].tolist() == [1]


def test_occupancy(rng):
    scene = RaycastingScene()
    scene.add_triangles(*sphere(40))
    points = rng.uniform(-1, 1, (10, 20, 30, 3)).astype(np.float32)
    radius = np.linalg.norm(points, axis=-1)
    inside = scene.compute_occupancy(points)
    assert inside.dtype == np.float32 and inside.shape == (10, 20, 30)
    clear = (radius < 0.99) | (radius > 1)
    assert (inside == (radius < 1))[clear].all()


def test_points_of_two_meshes(rng):
    scene = two_meshes(rng, RaycastingScene())
    points = rng.uniform(-1, 2, (4, 5, 3)).astype(np.float32)
    near = scene.compute_closest_points(points)
    tails = {"points": (3,), "geometry_ids": (), "primitive_ids": (), "primitive_uvs": (2,), "primitive_normals": (3,)}
    assert set(near) == set(tails)
    for key, tail in tails.items():
        assert near[key].shape == (4, 5) + tail and near[key].dtype == (np.float32 if tail else np.uint32), key
        assert type(near[key].numpy()) is np.ndarray
    distance = scene.compute_distance(points)
    assert distance.shape == (4, 5) and distance.dtype == np.float32
    assert np.allclose(distance, np.linalg.norm(near["points"] - points, axis=-1), atol=1e-6)
    assert set(np.unique(near["geometry_ids"])) == {0, 1}
    assert np.allclose(np.linalg.norm(near["primitive_normals"], axis=-1), 1, atol=1e-6)
    signed = scene.compute_signed_distance(points)
    inside = scene.compute_occupancy(points) == 1
    assert signed.dtype == np.float32 and (np.abs(signed) == distance).all() and ((signed < 0) == inside).all()


def test_points_without_triangles():
    near = RaycastingScene().compute_closest_points(np.zeros((1, 3), np.float32))
    assert near["geometry_ids"].tolist() == near["primitive_ids"].tolist() == [RaycastingScene.INVALID_ID]
    assert np.isnan(near["points"]).all() and (near["primitive_normals"] == 0).all()
    assert RaycastingScene().compute_distance(np.zeros((1, 3), np.float32)).tolist() == [np.inf]


def test_what_open3d_refuses_is_refused(rng):
    scene = RaycastingScene()
    for bad, message in ((np.zeros((2, 5), np.float32), r"last of 6 numbers, found shape \(2, 5\)"),
                         (np.zeros(6, np.float32), "at least 2 dimensions"),
                         (np.zeros((2, 6)), "expected float32, found float64")):
        for method in (scene.cast_rays, scene.test_occlusions, scene.count_intersections, scene.list_intersections):
            with pytest.raises(RuntimeError, match=message):
                method(bad)
    with pytest.raises(TypeError, match="add_triangles"):
        scene.add_triangles()
    with pytest.raises(hiprt.InputError, match="SYCL:0 is not a CPU"):
        RaycastingScene(device="SYCL:0")
    methods = (scene.compute_closest_points, scene.compute_distance, scene.compute_signed_distance,
               scene.compute_occupancy)
    for bad, message in ((np.zeros((2, 2), np.float32), r"last of 3 numbers, found shape \(2, 2\)"),
                         (np.zeros(3, np.float32), "at least 2 dimensions"),
                         (np.zeros((2, 3)), "query_points: expected float32, found float64")):
        for method in methods:
            with pytest.raises(RuntimeError, match=message):
                method(bad)
    for method in methods[2:]:
        with pytest.raises(RuntimeError, match="nsamples: 2 is not an odd number"):
            method(np.zeros((1, 3), np.float32), nsamples=2)


@needs_open3d
def test_hits_are_those_of_open3d(rng):
    tensor = open3d.core.Tensor
    theirs = two_meshes(np.random.default_rng(1), open3d.t.geometry.RaycastingScene(), tensor)
    ours = two_meshes(np.random.default_rng(1), RaycastingScene(), tensor)
    rays = tensor(some_rays(rng, 40, 50))
    a, b = ours.cast_rays(rays), theirs.cast_rays(rays)
    assert set(a) == set(b)
    alike = a["primitive_ids"].numpy() == b["primitive_ids"].numpy()
    assert alike.mean() > 0.995
    for key in a:
        assert type(a[key]) is type(b[key]) and a[key].shape == b[key].shape and a[key].dtype == b[key].dtype, key
        assert np.allclose(a[key].numpy()[alike], b[key].numpy()[alike], rtol=1e-3, atol=1e-3), key
    a, b = ours.list_intersections(rays), theirs.list_intersections(rays)
    for key in b:
        assert a[key].dtype == b[key].dtype and a[key].shape[1:] == b[key].shape[1:], key
    counts = ours.count_intersections(rays), theirs.count_intersections(rays)
    assert counts[0].dtype == counts[1].dtype and (counts[0].numpy() == counts[1].numpy()).mean() > 0.99
    assert (ours.test_occlusions(rays).numpy() == theirs.test_occlusions(rays).numpy()).mean() > 0.995
    points = tensor(rng.uniform(-0.6, 0.6, (500, 3)).astype(np.float32))
    only = RaycastingScene(), open3d.t.geometry.RaycastingScene()
    for scene in only:
        scene.add_triangles(*(tensor(array) for array in sphere()))
    a, b = (scene.compute_occupancy(points) for scene in only)
    assert a.dtype == b.dtype and (a.numpy() == b.numpy()).all()


@needs_open3d
def test_points_are_those_of_open3d(rng):
    tensor = open3d.core.Tensor
    theirs = two_meshes(np.random.default_rng(1), open3d.t.geometry.RaycastingScene(), tensor)
    ours = two_meshes(np.random.default_rng(1), RaycastingScene(), tensor)
    points = tensor(rng.uniform(-1, 2, (30, 40, 3)).astype(np.float32))
    a, b = ours.compute_closest_points(points), theirs.compute_closest_points(points)
    assert set(a) == set(b)
    for key in a:
        assert type(a[key]) is type(b[key]) and a[key].shape == b[key].shape and a[key].dtype == b[key].dtype, key
    assert np.allclose(a["points"].numpy(), b["points"].numpy(), atol=1e-3)
    # Neighbours that share the closest edge or vertex are as good as each other.
    alike = a["primitive_ids"].numpy() == b["primitive_ids"].numpy()
    assert alike.mean() > 0.5
    for key in a:
        assert np.allclose(a[key].numpy()[alike], b[key].numpy()[alike], atol=1e-3), key
    only = RaycastingScene(), open3d.t.geometry.RaycastingScene()
    for scene in only:
        scene.add_triangles(*(tensor(array) for array in sphere()))
    for name in ("compute_distance", "compute_signed_distance", "compute_occupancy"):
        a, b = (getattr(scene, name)(points) for scene in only)
        assert type(a) is type(b) and a.dtype == b.dtype and a.shape == b.shape
        assert np.allclose(a.numpy(), b.numpy(), atol=1e-5), name


@needs_open3d
def test_meshes_and_cameras_of_open3d():
    ours, theirs = RaycastingScene(), open3d.t.geometry.RaycastingScene()
    box = open3d.t.geometry.TriangleMesh.create_box()
    assert ours.add_triangles(box) == theirs.add_triangles(box) == 0
    view = {"fov_deg": 70.0, "center": [0.5, 0.4, 0.3], "eye": [2, 3, 1.5], "up": [0.1, 0, 1], "width_px": 31,
            "height_px": 17}
    a, b = (kind.create_rays_pinhole(**view) for kind in (RaycastingScene, open3d.t.geometry.RaycastingScene))
    assert a.shape == tuple(b.shape) and np.allclose(a, b.numpy(), atol=1e-5)
    intrinsic, extrinsic = np.array([[20, 0, 15.5], [0, 22, 8.5], [0, 0, 1]]), np.eye(4)
    extrinsic[:3, 3] = 1, 2, 3
    c = RaycastingScene.create_rays_pinhole(intrinsic, extrinsic, 31, 17)
    d = open3d.t.geometry.RaycastingScene.create_rays_pinhole(open3d.core.Tensor(intrinsic),
                                                             open3d.core.Tensor(extrinsic), 31, 17)
    assert np.allclose(c, d.numpy(), atol=1e-5)
    assert np.allclose(ours.cast_rays(a)["t_hit"], theirs.cast_rays(b)["t_hit"].numpy(), rtol=1e-4)
