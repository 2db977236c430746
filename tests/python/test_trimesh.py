"""hiprt.trimesh against trimesh's own ray classes."""

import copy
import pickle

import numpy as np
import pytest

from hiprt.trimesh import RayMeshIntersector
from shapes import sphere

trimesh = pytest.importorskip("trimesh")


def peers():
    """trimesh's backends that are installed here."""
    found = []
    for name, needs in (("ray_triangle", "rtree"), ("ray_pyembree", "embreex")):
        try:
            __import__(needs)
            found.append(__import__(f"trimesh.ray.{name}", fromlist=["x"]).RayMeshIntersector)
        except ImportError:
            pass
    return found


MESHES = {"box": lambda: trimesh.creation.box(), "icosphere": lambda: trimesh.creation.icosphere(3),
          "annulus": lambda: trimesh.creation.annulus(0.5, 1, 1),
          "far away": lambda: trimesh.creation.icosphere(2).apply_translation([1e5, 0, 0]),
          "small": lambda: trimesh.creation.icosphere(2).apply_scale(1e-2)}


@pytest.fixture(params=list(MESHES))
def mesh(request):
    return MESHES[request.param]()


def rays(mesh, rng, count=600):
    middle, size = mesh.bounds.mean(axis=0), mesh.extents.max()
    return middle + size * rng.uniform(-1, 1, (count, 3)), rng.normal(size=(count, 3))


def ordered(triangles, index, locations, origins):
    """By ray and distance; trimesh's backends have orders of their own."""
    order = np.lexsort((np.linalg.norm(locations - origins[index], axis=1), index))
    return triangles[order], index[order], locations[order]


@pytest.mark.parametrize("peer", peers(), ids=lambda p: p.__module__)
def test_hits_are_those_of_trimesh(mesh, rng, peer):
    ours, theirs = RayMeshIntersector(mesh), peer(mesh)
    origins, directions = rays(mesh, rng)
    for multiple in (True, False):
        a = ordered(*ours.intersects_id(origins, directions, multiple_hits=multiple, return_locations=True), origins)
        b = ordered(*theirs.intersects_id(origins, directions, multiple_hits=multiple, return_locations=True), origins)
        assert np.array_equal(a[1], b[1]) and (a[0] == b[0]).mean() > 0.99
        assert np.allclose(a[2], b[2], rtol=0, atol=1e-5 * mesh.scale)
        plain = ours.intersects_id(origins, directions, multiple_hits=multiple)
        assert len(plain) == 2 and len(plain[0]) == len(plain[1]) == len(a[0])
    locations, index, triangles = ours.intersects_location(origins, directions)
    assert locations.dtype == np.float64 and locations.shape == (len(index), 3) and len(triangles) == len(index)
    first = theirs.intersects_first(origins, directions)
    assert (ours.intersects_first(origins, directions) == first).mean() > 0.99
    assert np.array_equal(ours.intersects_any(origins, directions), theirs.intersects_any(origins, directions))
    points = rays(mesh, rng)[0]
    assert np.array_equal(ours.contains_points(points), theirs.contains_points(points))


def test_one_hit_where_a_ray_meets_an_edge():
    box = trimesh.creation.box()
    locations, index, _ = RayMeshIntersector(box).intersects_location([[0, 0, 5]], [[0, 0, -3]])
    assert np.allclose(locations, [[0, 0, 0.5], [0, 0, -0.5]]) and index.tolist() == [0, 0]


def test_hits_at_one_place_are_one_hit(rng):
    """Rays through edges and vertices of a closed mesh, whose coordinates are exact."""
    corners = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    octahedron = trimesh.Trimesh(corners, [[a, b, c] for a in (0, 1) for b in (2, 3) for c in (4, 5)], process=False)
    edges = np.array([[a, b] for a in range(6) for b in range(a + 1, 6) if a // 2 != b // 2])
    along = rng.integers(0, 65, (4000, 1)) / 64
    ends = corners[edges[rng.integers(0, len(edges), 4000)]]
    targets = ends[:, 0] * along + ends[:, 1] * (1 - along)
    directions = rng.integers(-12, 13, targets.shape) / 64 - targets  # Through the middle of the body.
    ours = RayMeshIntersector(octahedron)
    origins = targets - 2 * directions
    assert len(ours.scene.list(origins, directions, precision="watertight").t) > 8100
    _, index, locations = ours.intersects_id(origins, directions, return_locations=True)
    assert (np.bincount(index, minlength=4000) == 2).all()
    assert np.abs(locations[::2] - targets).max() < 1e-12


def test_walls_that_trimesh_tells_apart_are_two_hits():
    triangle = np.array([[-5, -5, 0], [5, -5, 0], [0, 5, 0]], float)
    for distance, hits in ((1e-6, 1), (1e-4, 2)):
        walls = trimesh.Trimesh(np.concatenate((triangle, triangle + [0, 0, distance])), [[0, 1, 2], [3, 4, 5]],
                                process=False)
        assert len(RayMeshIntersector(walls).intersects_id([[0, 0, 3]], [[0, 0.1, -1]])[0]) == hits


def test_locations_are_exact_to_float64(rng):
    mesh = trimesh.creation.icosphere(3)
    origins, directions = rays(mesh, rng)
    locations, index, triangles = RayMeshIntersector(mesh).intersects_location(origins, directions)
    plane = np.einsum("ij,ij->i", mesh.face_normals[triangles], locations - mesh.triangles[triangles][:, 0])
    assert np.abs(plane).max() < 1e-12
    away = np.cross(locations - origins[index], directions[index])
    assert np.abs(away).max() < 1e-9


def test_max_hits_and_no_hits(rng):
    mesh = trimesh.util.concatenate([trimesh.creation.icosphere(1, radius=r) for r in (1, 2, 3)])
    ours = RayMeshIntersector(mesh)
    origins, directions = np.zeros((4, 3)), np.array([[1, 0.1, 0.2]] * 4)
    assert np.bincount(ours.intersects_id(origins, directions)[1]).tolist() == [3] * 4
    assert np.bincount(ours.intersects_id(origins, directions, max_hits=2)[1]).tolist() == [2] * 4
    triangles, index, locations = ours.intersects_id(origins + 9, directions, return_locations=True)
    assert len(triangles) == len(index) == 0 and locations.shape == (0, 3)
    assert ours.intersects_first(origins + 9, directions).tolist() == [-1] * 4
    none = np.zeros((0, 3))
    assert ours.intersects_any(none, none).shape == (0,) and ours.contains_points(none).shape == (0,)


def test_the_mesh_may_change():
    mesh = trimesh.creation.box()
    ours = RayMeshIntersector(mesh)
    assert ours.intersects_any([[0, 0, 5]], [[0, 0, -1]]).all()
    mesh.apply_translation([10, 0, 0])
    assert not ours.intersects_any([[0, 0, 5]], [[0, 0, -1]]).any()
    assert ours.intersects_any([[10, 0, 5]], [[0, 0, -1]]).all()


def test_copies_and_pickles():
    for other in (copy.copy, copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))):
        ours = other(RayMeshIntersector(trimesh.creation.box()))
        assert ours.contains_points([[0, 0, 0], [1, 0, 0]]).tolist() == [True, False]


def test_meshes_take_it_as_their_ray_class(rng):
    mesh = trimesh.creation.icosphere(2)
    mesh.ray = RayMeshIntersector(mesh)
    assert mesh.contains([[0, 0, 0], [2, 0, 0]]).tolist() == [True, False]
    assert len(mesh.ray.intersects_location([[0, 0, 5]], [[0, 0.01, -1]])[0]) == 2


def test_wrong_arguments():
    ours = RayMeshIntersector(trimesh.creation.box())
    with pytest.raises(ValueError, match="don't match"):
        ours.intersects_id(np.zeros((2, 3)), np.zeros((3, 3)))
    with pytest.raises(ValueError, match=r"points must be \(n,3\)"):
        ours.contains_points(np.zeros(3))


def test_without_trimesh():
    class Mesh:
        vertices, faces = sphere()

    ours = RayMeshIntersector(Mesh())
    assert ours.contains_points([[0, 0, 0], [0, 0, 2]]).tolist() == [True, False]
