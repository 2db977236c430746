"""Tensors in the memory of a GPU. The judge is the CPU, bit by bit. Skipped where a library or a GPU is missing."""

import threading

import numpy as np
import pytest

import hiprt
from gpu_libraries import LIBRARIES, make_library
from shapes import rays_at, soup, sphere
from test_instances import random_matrices

PRECISIONS = ("watertight", "reference", "fast", "double")


@pytest.fixture(params=list(LIBRARIES))
def library(request):
    return make_library(request.param)


@pytest.fixture
def torch():
    return make_library("torch").torch


@pytest.fixture
def cupy():
    return make_library("cupy").cupy


def scenes(rng):
    """Scenes of each kind: layouts, split triangles, levels of instances, motion."""
    mesh = hiprt.Mesh(*soup(rng, 200))
    plain, other = hiprt.build(mesh), hiprt.build(hiprt.Mesh(*soup(rng, 60)))
    matrices = random_matrices(rng, 5, 0.7)
    group = hiprt.Instances((plain, other), matrices, which=[0, 1, 0, 1, 1], masks=[1, 2, 3, 0xFFFFFFFF, 1])
    moving = np.stack((matrices, random_matrices(rng, 5, 0.7)), axis=1)
    return {"planes": plain, "quantized": hiprt.build(mesh, layout="quantized"),
            "split": hiprt.build(mesh, "high", split_budget=1.0), "levels": hiprt.build(group),
            "motion": hiprt.build(hiprt.Instances(hiprt.Instances(other, moving, times=[0, 1]),
                                                  random_matrices(rng, 3, 0.7)))}


def assert_same(library, on_gpu, on_cpu):
    """Whether a result has the library's type and the CPU's bits."""
    on_gpu, on_cpu = (x if isinstance(x, tuple) else (x,) for x in (on_gpu, on_cpu))
    assert len(on_gpu) == len(on_cpu)
    for k, (a, b) in enumerate(zip(on_gpu, on_cpu)):
        assert library.is_own(a), type(a)
        a = library.to_numpy(a)
        assert a.shape == b.shape and a.dtype == b.dtype, (k, a.shape, b.shape, a.dtype, b.dtype)
        np.testing.assert_array_equal(np.ascontiguousarray(a).view(f"u{a.itemsize}"),
                                      np.ascontiguousarray(b).view(f"u{b.itemsize}"), err_msg=f"array {k}")


@pytest.mark.parametrize("kind", ("planes", "quantized", "split", "levels", "motion"))
def test_rays_have_the_bits_of_the_cpu(library, rng, kind):
    scene = scenes(rng)[kind]
    origins, directions = rays_at(rng, 3000)
    more = {"time": rng.uniform(0, 1, 3000).astype(np.float32)} if kind == "motion" else {}
    some = {name: library.to_gpu(array) for name, array in more.items()}
    a, b = library.to_gpu(origins), library.to_gpu(directions)
    for precision in PRECISIONS:
        more["precision"] = some["precision"] = precision
        on_cpu = scene.cast(origins, directions, **more)
        assert on_cpu.found.sum() > 500
        assert_same(library, scene.cast(a, b, **some), on_cpu)
        assert_same(library, scene.occluded(a, b, **some), on_cpu.found)
        assert_same(library, scene.count(a, b, **some), scene.count(origins, directions, **more))


@pytest.mark.parametrize("kind", ("planes", "quantized", "split", "levels", "motion"))
def test_points_have_the_bits_of_the_cpu(library, rng, kind):
    scene = scenes(rng)[kind]
    for dtype in (np.float32, np.float64):
        points = rng.uniform(-1, 2, (1500, 3)).astype(dtype)
        points[7] = np.nan
        tensor = library.to_gpu(points)
        on_cpu = scene.closest_point(points, 0.5)
        assert 100 < on_cpu.found.sum() < 1500
        on_gpu = scene.closest_point(tensor, 0.5)
        nan = np.isnan(library.to_numpy(on_gpu.point))
        assert (nan == np.isnan(on_cpu.point)).all()
        # The sign of a NaN may differ.
        on_gpu = on_gpu._replace(point=library.to_gpu(np.where(nan, 0, library.to_numpy(on_gpu.point))))
        assert_same(library, on_gpu, on_cpu._replace(point=np.where(nan, 0, on_cpu.point).astype(dtype)))


def test_a_scene_that_was_copied_before(torch, rng):
    mesh, (origins, directions) = hiprt.Mesh(*soup(rng, 200)), rays_at(rng, 500)
    a, b = torch.from_numpy(origins).cuda(), torch.from_numpy(directions).cuda()
    free = torch.cuda.mem_get_info()[0]
    scenes_there = [hiprt.build(mesh, device="cuda"), hiprt.build(mesh, device=a.device), hiprt.build(mesh)]
    assert scenes_there[2].copy_to("cuda:0") is scenes_there[2] and torch.cuda.mem_get_info()[0] <= free
    for scene in scenes_there:
        assert np.array_equal(scene.cast(a, b).t.cpu().numpy(), scene.cast(origins, directions).t)
    with pytest.raises(hiprt.GpuError):
        scenes_there[0].copy_to(f"cuda:{torch.cuda.device_count()}")


def test_inside(library, rng):
    scene = hiprt.build(hiprt.Mesh(*sphere()))
    points = rng.uniform(-1.2, 1.2, (1000, 3)).astype(np.float32)
    tensor = library.to_gpu(points)
    assert (library.to_numpy(scene.occupancy(tensor)) == scene.occupancy(points)).all()
    assert_same(library, scene.signed_distance(tensor), scene.signed_distance(points))


def test_limits_and_masks(library, rng):
    scene = scenes(rng)["levels"]
    origins, directions = rays_at(rng, 1000)
    tmin, tmax = rng.uniform(0, 0.3, 1000), rng.uniform(0.3, 3, 1000).astype(np.float32)
    mask = rng.integers(1, 4, 1000).astype(np.uint32)
    a, b = library.to_gpu(origins), library.to_gpu(directions)
    for limits in ((0.25, 1.5), (tmin, 2), (np.float32(0.1), tmax), (tmin, tmax)):
        given = [library.to_gpu(x) if np.ndim(x) else x for x in limits]
        assert_same(library, scene.cast(a, b, *given, mask=2), scene.cast(origins, directions, *limits, mask=2))
    assert_same(library, scene.cast(a, b, mask=library.to_gpu(mask)), scene.cast(origins, directions, mask=mask))


def test_shapes_and_strides(library, rng):
    scene = scenes(rng)["planes"]
    origins, directions = rays_at(rng, 60)
    origins, directions = origins.reshape(3, 1, 20, 3), directions.reshape(3, 20, 1, 3)
    a, b = library.to_gpu(origins), library.to_gpu(directions)
    on_cpu = scene.cast(origins, directions)
    assert on_cpu.t.shape == (3, 20, 20)
    for x, y in ((a, b), (library.strided(a), b), (a, library.strided(b)), (library.strided(a), library.strided(b))):
        assert_same(library, scene.cast(x, y), on_cpu)
    columns = np.ascontiguousarray(origins.reshape(60, 3).T)
    assert_same(library, scene.cast(library.to_gpu(columns).T, b.reshape(60, 3)),
                scene.cast(columns.T, directions.reshape(60, 3)))
    down = np.array([0, 0, -1], np.float32)
    assert_same(library, scene.cast(a, down), scene.cast(origins, down))
    assert_same(library, scene.cast(a, [0, 0, -1]), scene.cast(origins, [0, 0, -1]))
    for empty in (np.zeros((0, 3), np.float32), np.zeros((4, 0, 3), np.float32)):
        assert_same(library, scene.cast(library.to_gpu(empty), down), scene.cast(empty, down))
    one = origins.reshape(-1, 3)[0]
    assert_same(library, scene.cast(library.to_gpu(one), down), scene.cast(one, down))


def test_precision_is_that_of_the_arrays(library, rng):
    scene = scenes(rng)["planes"]
    origins, directions = rays_at(rng, 500)
    for x, y in ((np.float64, np.float32), (np.float32, np.float64), (np.float64, np.float64)):
        a, b = origins.astype(x) / 3, directions.astype(y) * 3
        assert_same(library, scene.cast(library.to_gpu(a), library.to_gpu(b)), scene.cast(a, b))
        assert_same(library, scene.cast(library.to_gpu(a), library.to_gpu(b), precision="watertight"),
                    scene.cast(a, b, precision="watertight"))


def test_hits_are_arrays_to_calculate_with(library, rng):
    scene = scenes(rng)["planes"]
    origins, directions = rays_at(rng, 500)
    on_cpu, on_gpu = scene.cast(origins, directions), scene.cast(library.to_gpu(origins), library.to_gpu(directions))
    assert (library.to_numpy(on_gpu.found) == on_cpu.found).all()
    np.testing.assert_allclose(library.to_numpy(on_gpu.points(library.to_gpu(origins), library.to_gpu(directions))),
                               on_cpu.points(origins, directions), rtol=1e-5)


def test_refit_reaches_the_gpu(library, rng):
    vertices, indices = soup(rng, 100)
    scene = hiprt.build(hiprt.Mesh(vertices, indices))
    origins, directions = rays_at(rng, 500)
    a, b = library.to_gpu(origins), library.to_gpu(directions)
    before = scene.cast(a, b)
    scene.refit(hiprt.Mesh(vertices[::-1].copy(), indices))
    after = scene.cast(a, b)
    assert_same(library, after, scene.cast(origins, directions))
    assert (library.to_numpy(before.t) != library.to_numpy(after.t)).any()


def test_scenes_and_rays_may_die_while_the_gpu_works(library, rng):
    vertices, indices = soup(rng, 100)
    origins, directions = rays_at(rng, 200_000)
    expected = hiprt.build(hiprt.Mesh(vertices, indices)).cast(origins, directions)
    for _ in range(5):
        scene = hiprt.build(hiprt.Mesh(vertices, indices))
        a, b = library.to_gpu(origins), library.to_gpu(directions)
        hits = scene.cast(a, b)
        del a, b
        noise = [library.to_gpu(np.full_like(origins, 7)) for _ in range(4)]
        del scene, noise
        t = hits.t
        del hits
        assert np.array_equal(library.to_numpy(t), expected.t)


def test_threads(library, rng):
    scene = scenes(rng)["split"]
    origins, directions = rays_at(rng, 2000)
    expected, faults = scene.cast(origins, directions), []

    def work():
        try:
            assert_same(library, scene.cast(library.to_gpu(origins), library.to_gpu(directions)), expected)
        except BaseException as fault:  # Threads would lose it.
            faults.append(fault)

    threads = [threading.Thread(target=work) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not faults, faults[0]


def test_work_is_in_the_order_of_the_current_stream(torch, rng):
    scene = scenes(rng)["planes"]
    origins, directions = rays_at(rng, 1000)
    expected = scene.cast(origins, directions)
    scene.cast(torch.zeros((4, 3), device="cuda"), torch.ones((4, 3), device="cuda"))  # Compiles, and copies the scene.
    b, source = torch.from_numpy(directions).cuda(), torch.from_numpy(origins).cuda()
    torch.cuda.synchronize()
    for stream in (torch.cuda.current_stream(), torch.cuda.Stream()):
        with torch.cuda.stream(stream):
            a = torch.zeros_like(source)
            torch.cuda._sleep(200_000_000)  # The rays are written a tenth of a second from now.
            a.copy_(source)
            hits = scene.cast(a, b)
            assert not stream.query()  # The call returned before the work was done.
            copied = hits.t.clone()
        stream.synchronize()
        assert np.array_equal(copied.cpu().numpy(), expected.t)


def test_a_stream_by_argument(torch, cupy, rng):
    scene = scenes(rng)["planes"]
    origins, directions = rays_at(rng, 1000)
    expected = scene.cast(origins, directions)
    a, b = torch.from_numpy(origins).cuda(), torch.from_numpy(directions).cuda()
    c, d = cupy.asarray(origins), cupy.asarray(directions)
    other = torch.cuda.Stream()
    for stream in (other, other.cuda_stream, cupy.cuda.ExternalStream(other.cuda_stream)):
        for x, y in ((a, b), (c, d)):
            t = scene.cast(x, y, stream=stream).t
            other.synchronize()
            assert np.array_equal(t.cpu().numpy() if x is a else cupy.asnumpy(t), expected.t)


class OnlyInterface:
    """An array of a library that hiprt does not know."""

    def __init__(self, array, **entries):
        self.array, self.entries = array, entries

    @property
    def __cuda_array_interface__(self):
        return {**self.array.__cuda_array_interface__, **self.entries}


def test_arrays_with_the_interface_only(cupy, rng):
    scene = scenes(rng)["planes"]
    origins, directions = rays_at(rng, 1000)
    expected = scene.cast(origins, directions)
    stream = cupy.cuda.Stream(non_blocking=True)
    for named in ({}, {"stream": stream.ptr}):
        with stream:
            a, b = cupy.asarray(origins), cupy.asarray(directions)
        stream.synchronize()
        hits = scene.cast(OnlyInterface(a, **named), OnlyInterface(b, **named))
        assert type(hits.t) is hiprt.GpuArray and "cuda:0" in repr(hits.t)
        assert np.array_equal(cupy.asnumpy(cupy.asarray(hits.t)), expected.t)
        assert np.array_equal(cupy.asnumpy(cupy.from_dlpack(hits.primitive)), expected.primitive)
        assert np.array_equal(cupy.asnumpy(cupy.asarray(hits.normal)), expected.normal)
        mixed = scene.cast(a, OnlyInterface(b, **named))
        assert np.array_equal(cupy.asnumpy(mixed.t), expected.t)


def test_errors_name_the_argument(torch, rng):
    scene = scenes(rng)["planes"]
    a = torch.zeros((4, 3), device="cuda")
    with pytest.raises(hiprt.InputError, match=r"directions is in the memory of the CPU, and origins is on cuda:0"):
        scene.cast(a, torch.zeros(4, 3))
    with pytest.raises(hiprt.InputError, match=r"origins is in the memory of the CPU"):
        scene.cast(np.zeros((4, 3), np.float32), a)
    with pytest.raises(hiprt.InputError, match=r"tmax is in the memory of the CPU.*single numbers"):
        scene.cast(a, a, tmax=np.ones(4))
    with pytest.raises(hiprt.InputError, match=r"tmin: expected numbers"):
        scene.cast(a, a, tmin="near")
    with pytest.raises(hiprt.InputError, match=r"mask.*: -1 is not between 0 and"):
        scene.cast(a, a, mask=-1)
    with pytest.raises(hiprt.InputError, match=r"origins: .*float32 or float64, found float16"):
        scene.cast(a.half(), a)
    with pytest.raises(hiprt.InputError, match=r"mask: .*uint32 or int32, found int64"):
        scene.cast(a, a, mask=torch.ones(4, dtype=torch.int64, device="cuda"))
    with pytest.raises(hiprt.InputError, match=r"different shapes"):
        scene.cast(a, torch.zeros((5, 3), device="cuda"))
    with pytest.raises(hiprt.InputError, match=r"origins: expected \.\.\. x 3 numbers, found shape \(4, 2\)"):
        scene.cast(a[:, :2], a)
    with pytest.raises(hiprt.InputError, match=r"origins: .*DLPack.*detach"):
        scene.cast(a.clone().requires_grad_(), a)
    with pytest.raises(hiprt.InputError, match=r"precision: 'exact' is none of"):
        scene.cast(a, a, precision="exact")
    with pytest.raises(hiprt.InputError, match=r"stream: expected a stream"):
        scene.cast(a, a, stream="first")
    with pytest.raises(hiprt.InputError, match=r"up to 4: make contiguous copies"):
        scene.cast(torch.zeros((3, 4, 3, 4, 3, 4, 3), device="cuda")[:, ::2, :, ::2, :, ::2].transpose(0, 2), a[0])
    for call in (scene.list, scene.within, lambda x, y: scene.nearest(x, 2)):
        with pytest.raises(hiprt.InputError, match=r"memory of a GPU"):
            call(a, a)
    if torch.cuda.device_count() > 1:
        with pytest.raises(hiprt.InputError, match=r"directions is on cuda:1, and origins is on cuda:0"):
            scene.cast(a, a.to("cuda:1"))
