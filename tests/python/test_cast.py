"""First hits and occlusion, against every triangle in float64."""

import numpy as np
import pytest

import hiprt
from oracle import check_closest, judge
from shapes import rays_at, same, soup, sphere

PRECISIONS = ("watertight", "reference", "fast", "double")


@pytest.mark.parametrize("quality", ("fast", "balanced", "high"))
@pytest.mark.parametrize("precision", PRECISIONS)
def test_closest_hits_are_those_of_brute_force(rng, quality, precision):
    vertices, indices = soup(rng, 300)
    scene = hiprt.build(hiprt.Mesh(vertices, indices), quality)
    origins, directions = rays_at(rng, 2000)
    judged = judge(vertices, indices, origins, directions)
    hits = scene.cast(origins, directions, precision=precision)
    assert check_closest(hits, judged) > 1500
    certain = judged.hit.any(axis=1) | ~judged.maybe.any(axis=1)
    occluded = scene.occluded(origins, directions, precision=precision)
    assert (occluded == judged.hit.any(axis=1))[certain].all()
    assert (occluded == hits.found).all() or precision == "fast"


@pytest.mark.parametrize("layout", ("planes", "float", "half", "quantized"))
@pytest.mark.parametrize("precision", ("watertight", "reference", "double"))
def test_hits_do_not_depend_on_tree_or_layout(rng, layout, precision):
    mesh = hiprt.Mesh(*soup(rng, 500))
    origins, directions = rays_at(rng, 1000)
    expected = hiprt.build(mesh, builder="sah").cast(origins, directions, precision=precision)
    scene = hiprt.build(mesh, "high", layout=layout)
    assert scene.layout == layout
    assert same(expected, scene.cast(origins, directions, precision=precision))


def test_prepared_scenes_and_threads_give_the_same_bits(rng):
    mesh = hiprt.Mesh(*soup(rng, 2000))
    origins, directions = rays_at(rng, 5000)
    scene = hiprt.build(mesh)
    few = [scene.cast(origins[i:i + 100], directions[i:i + 100]) for i in range(0, 1000, 100)]  # The file's own nodes.
    all_rays = scene.cast(origins, directions)  # More rays than triangles: the host's nodes.
    for number, part in enumerate(few):
        assert same(part, [member[100 * number:100 * number + 100] for member in all_rays])
    for threads in (1, 2, 7):
        assert same(all_rays, scene.cast(origins, directions, threads=threads))


def test_double_rays_see_what_floats_cannot(rng):
    vertices, indices = sphere()
    inner = hiprt.build(hiprt.Mesh(vertices, indices))
    far = 6378137.0
    matrix = np.eye(4)[:3].copy()
    matrix[0, 3] = far
    scene = hiprt.build(hiprt.Instances(inner, matrix[None]))
    offsets = rng.uniform(-0.6, 0.6, (200, 2))
    origins = np.column_stack((far + offsets[:, 0], offsets[:, 1], np.full(200, 5.0)))
    hits = scene.cast(origins, [0, 0, -1])
    assert hits.t.dtype == np.float64 and hits.found.all()
    near = inner.cast(origins - [far, 0, 0], [0, 0, -1.0])
    assert np.allclose(hits.t, near.t, rtol=0, atol=1e-8) and (hits.primitive == near.primitive).all()


def test_normal_error_and_point(rng):
    vertices, indices = soup(rng, 100)
    scene = hiprt.build(hiprt.Mesh(vertices, indices))
    origins, directions = rays_at(rng, 500)
    hits = scene.cast(origins, directions)
    corners = vertices[indices[hits.primitive[hits.found]]].astype(np.float64)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.allclose(hits.normal[hits.found], normal, rtol=1e-4, atol=1e-6)
    points = hits.points(origins.astype(np.float64), directions.astype(np.float64))
    assert np.isnan(points[~hits.found]).all()
    u, v = (getattr(hits, name)[hits.found, None].astype(np.float64) for name in "uv")
    on_triangle = (1 - u - v) * corners[:, 0] + u * corners[:, 1] + v * corners[:, 2]
    assert np.abs(points[hits.found] - on_triangle).max() < 1e-5
    plane = np.abs(((points[hits.found] - corners[:, 0]) * normal).sum(1)) / np.linalg.norm(normal, axis=1)
    assert (plane <= np.sqrt(3) * hits.error[hits.found]).all()
    assert (hits.normal[~hits.found] == 0).all()


@pytest.mark.parametrize("precision", ("watertight", "double"))
def test_spawned_rays_do_not_hit_their_own_triangle(rng, precision):
    vertices, indices = sphere()
    scene = hiprt.build(hiprt.Mesh(vertices, indices))
    origins, directions = rays_at(rng, 2000, -0.9, 0.9)
    hits = scene.cast(origins, directions, precision=precision)
    outwards = np.where((hits.normal * directions).sum(1, keepdims=True) > 0, -hits.normal, hits.normal)
    starts = hits.spawn_origins(origins, directions, outwards)
    assert np.isnan(starts[~hits.found]).all()
    # The sphere is convex: rays away from it are free, rays back hit at once.
    assert not scene.occluded(starts[hits.found], outwards[hits.found], precision=precision).any()
    assert scene.occluded(starts[hits.found], -outwards[hits.found], precision=precision).all()


def test_rays_through_vertices_and_edges_of_a_closed_mesh_do_not_leak(rng):
    vertices, indices = sphere(12)
    scene = hiprt.build(hiprt.Mesh(vertices, indices))
    along = rng.uniform(0, 1, (len(indices), 1)).astype(np.float32)
    edges = vertices[indices[:, 0]] * along + vertices[indices[:, 1]] * (1 - along)
    for targets in (vertices, edges):
        inside = rng.uniform(-0.3, 0.3, targets.shape).astype(np.float32)
        for precision in ("watertight", "reference", "double"):
            assert scene.occluded(inside, targets - inside, precision=precision).all()


def test_rays_that_miss_everything(rng):
    scene = hiprt.build(hiprt.Mesh(*sphere()))
    nan, inf = np.float32(np.nan), np.float32(np.inf)
    origins = np.array([[0, 0, 0], [nan, 0, 0], [0, 0, 0], [inf, 0, 0], [0, 0, 5]], np.float32)
    directions = np.array([[0, 0, 0], [1, 0, 0], [nan, 1, 0], [-1, 0, 0], [0, 0, 1]], np.float32)
    for precision in PRECISIONS:
        hits = scene.cast(origins, directions, precision=precision)
        assert not hits.found.any() and np.isinf(hits.t).all()
        assert (hits.geometry == hiprt.INVALID).all() and (hits.primitive == hiprt.INVALID).all()
        assert not scene.occluded(origins, directions, precision=precision).any()
        assert (scene.count(origins, directions, precision=precision) == 0).all()
    down = np.array([0, 0, -1], np.float32)
    assert not scene.cast(origins[4], down, 5, 4).found
    assert not scene.cast(origins[4], down, np.nan).found


def test_ends_of_the_ray_belong_to_it():
    scene = hiprt.build(hiprt.Mesh([[-1, -1, 0], [3, -1, 0], [-1, 3, 0]]))
    origin, down = np.array([0, 0, 2], np.float32), np.array([0, 0, -1], np.float32)
    t = np.array([0, 1, 2, 2.001, 3], np.float32)
    assert scene.cast(origin, down, tmin=t).found.tolist() == [True, True, True, False, False]
    assert scene.cast(origin, down, tmax=t).found.tolist() == [False, False, True, True, True]
    assert scene.occluded(origin, down, -5, t).tolist() == [False, False, True, True, True]


def test_shapes_are_broadcast(rng):
    scene = hiprt.build(hiprt.Mesh(*sphere()))
    origins = rng.uniform(-2, 2, (3, 1, 3)).astype(np.float32)
    directions = rng.normal(size=(4, 3)).astype(np.float32)
    hits = scene.cast(origins, directions)
    assert hits.t.shape == (3, 4) and hits.normal.shape == (3, 4, 3) and hits.instances.shape == (3, 4, 0)
    for i in range(3):
        for k in range(4):
            one = scene.cast(origins[i, 0], directions[k])
            assert one.t.shape == () and one.t == hits.t[i, k] and one.primitive == hits.primitive[i, k]
    assert scene.cast(np.zeros((0, 3), np.float32), directions[:1]).t.shape == (0,)
    assert scene.occluded(np.zeros((0, 5, 3)), np.ones(3)).shape == (0, 5)
    with pytest.raises(hiprt.InputError, match="different shapes"):
        scene.cast(np.zeros((2, 3)), np.zeros((3, 3)))
    with pytest.raises(hiprt.InputError, match=r"origins: expected .* x 3 numbers, found shape \(2,\)"):
        scene.cast(np.zeros(2), np.zeros(3))


def test_masks_select_geometries(rng):
    vertices, indices = sphere()
    inner, outer = hiprt.Mesh(vertices, indices, mask=1), hiprt.Mesh(2 * vertices, indices, mask=6)
    scene = hiprt.build([inner, outer])
    assert scene.geometries == 2
    origin, up = np.zeros(3, np.float32), np.array([0.1, 0.2, 1], np.float32)
    hits = scene.cast(origin, up, mask=np.array([1, 2, 4, 8, 7, 0xFFFFFFFF, 0], np.uint32))
    assert hits.found.tolist() == [True, True, True, False, True, True, False]
    assert hits.geometry[hits.found].tolist() == [0, 1, 1, 0, 0]
    assert scene.count(origin, up, mask=np.array([1, 6, 7, 8])).tolist() == [1, 1, 2, 0]
    with pytest.raises(hiprt.InputError, match="mask"):
        scene.cast(origin, up, mask=-1)


def test_empty_scenes():
    for mesh in (hiprt.Mesh(np.zeros((0, 3))), hiprt.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int)),
                 hiprt.Mesh([[0, 0, 0], [0, 0, 0], [1, 1, 1]])):
        scene = hiprt.build(mesh)
        origins = np.ones((2000, 3), np.float32)
        assert not scene.cast(origins, -origins).found.any()
        assert len(scene.list(origins, -origins).t) == 0
    assert not hiprt.build([]).occluded([0, 0, 0], [0, 0, 1])


def test_unknown_words_are_refused(rng):
    scene = hiprt.build(hiprt.Mesh(*sphere()))
    with pytest.raises(hiprt.InputError, match="precision: 'exact' is none of watertight, reference, fast, double"):
        scene.cast([0, 0, 0], [0, 0, 1], precision="exact")
    with pytest.raises(hiprt.InputError, match="quality: 'best' is none of fast, balanced, high"):
        hiprt.build(hiprt.Mesh(*sphere()), "best")
    with pytest.raises(hiprt.InputError, match="builder: 'bvh' is none of sah, lbvh"):
        hiprt.build(hiprt.Mesh(*sphere()), builder="bvh")
    with pytest.raises(hiprt.InputError, match="threads: -1 has the wrong type or is out of range"):
        hiprt.build(hiprt.Mesh(*sphere()), threads=-1)
    with pytest.raises(hiprt.InputError, match="threads: -1 is not between 0"):
        scene.cast([0, 0, 0], [0, 0, 1], threads=-1)
    with pytest.raises(hiprt.InputError, match="split"):
        hiprt.build(hiprt.Mesh(*sphere()), split_budget=99)
