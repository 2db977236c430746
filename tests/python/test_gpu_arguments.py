"""What is said of memory of a GPU on a machine without one. A fake object says that it has such memory."""

import numpy as np
import pytest

import hiprt
from hiprt import _core, _gpu, _gpu_arrays
from shapes import soup


class FakeInterface:
    def __init__(self, shape=(4, 3), typestr="<f4", **entries):
        self.entries = {"shape": shape, "typestr": typestr, "data": (4096, False), "version": 3, **entries}

    @property
    def __cuda_array_interface__(self):
        return self.entries


class FakeTensor:
    """With DLPack: of device type 2 (CUDA) or 10 (ROCm)."""

    def __init__(self, kind):
        self.kind = kind

    def __dlpack_device__(self):
        return self.kind, 0

    def __dlpack__(self, **_):
        raise BufferError("there is no memory")


def driver_fault(is_hip):
    """The message of a missing driver or GPU, or None where there is one."""
    try:
        _core.gpu_check_driver(is_hip)
    except hiprt.GpuError as fault:
        return str(fault)
    return None


@pytest.fixture
def scene(rng):
    return hiprt.build(hiprt.Mesh(*soup(rng, 20)))


@pytest.mark.parametrize("kind, name", ((2, "CUDA"), (10, "HIP")))
def test_without_a_driver(scene, kind, name):
    fault = driver_fault(kind == 10)
    if fault is None:
        pytest.skip(f"there is a GPU with {name}")
    assert name in fault and ("driver: " in fault or "finds no GPU" in fault)
    fakes = [FakeTensor(kind)] + ([FakeInterface()] if kind == 2 and driver_fault(True) is not None else [])
    for fake in fakes:
        for call in (scene.cast, scene.occluded, scene.count):
            with pytest.raises(hiprt.GpuError, match=name):
                call(fake, fake)
        for call in (scene.closest_point, scene.occupancy, scene.signed_distance):
            with pytest.raises(hiprt.GpuError, match=name):
                call(fake)


def test_arguments_are_checked_before_the_driver_is_asked(scene):
    cpu, fake = np.zeros((4, 3), np.float32), FakeTensor(2)
    with pytest.raises(hiprt.InputError, match="directions is in the memory of the CPU, and origins is on cuda:0"):
        scene.cast(fake, cpu)
    with pytest.raises(hiprt.InputError, match="origins is in the memory of the CPU, and tmax is on cuda:0"):
        scene.cast(cpu, cpu, tmax=fake)
    with pytest.raises(hiprt.InputError, match="directions is on rocm:0, and origins is on cuda:0"):
        scene.cast(fake, FakeTensor(10))
    with pytest.raises(hiprt.InputError, match="tmin is in the memory of the CPU, and origins is on cuda:0"):
        scene.cast(fake, [0, 0, 1], tmin=[1, 2])
    with pytest.raises(hiprt.InputError, match="has a mask"):
        scene.cast(FakeInterface(mask=FakeInterface()), [0, 0, 1])
    with pytest.raises(hiprt.InputError, match="none of float, double"):
        scene.closest_point(fake, precision="fast")
    for call in (scene.cast, scene.occluded, scene.count):
        with pytest.raises(hiprt.InputError, match="stream: none of the arrays"):
            call(cpu, cpu, stream=1)
    for call in (scene.closest_point, scene.occupancy, scene.signed_distance):
        with pytest.raises(hiprt.InputError, match="stream: none of the arrays"):
            call(cpu, stream=1)


def test_devices_by_name(scene):
    assert _gpu_arrays.device_named("cpu") is None and scene.copy_to("cpu") is scene
    assert _gpu_arrays.device_named("cuda") == (False, 0) and _gpu_arrays.device_named("rocm:12") == (True, 12)
    for name in ("gpu", "cuda:", "cuda:-1", "cuda:1.5", "cpu:0", "", 3, None, "cuda:\u0663"):
        with pytest.raises(hiprt.InputError, match="device: expected 'cpu', 'cuda'"):
            scene.copy_to(name)
        with pytest.raises(hiprt.InputError, match="device: expected 'cpu', 'cuda'"):
            hiprt.build([], device=name)


def test_other_calls_say_that_they_work_on_the_cpu(scene):
    for fake in (FakeTensor(2), FakeTensor(10), FakeInterface()):
        for call in (scene.list, scene.within, lambda x, _: scene.nearest(x, 2), lambda x, _: scene.overlap(x),
                     lambda x, _: hiprt.Mesh(x), lambda x, _: hiprt.Instances(scene, x)):
            with pytest.raises(hiprt.InputError, match=r"memory of a GPU.*copy it first"):
                call(fake, fake)


@pytest.mark.parametrize("seed", range(20))
def test_merged_dimensions_name_the_same_numbers(seed):
    rng = np.random.default_rng(seed)
    shape = tuple(int(n) for n in rng.integers(1, 4, rng.integers(0, 5)))
    arrays = []
    for _ in range(3):
        kept = [n if rng.random() < 0.7 else 1 for n in shape]
        array = rng.random(kept).transpose() if rng.random() < 0.3 and kept == kept[::-1] else rng.random(kept)
        arrays.append(np.broadcast_to(array, shape))
    lengths, strides = _gpu._merged(shape, [array.strides for array in arrays])
    assert len(lengths) <= max(len(shape), 1) and np.prod(lengths) == np.prod(shape)
    for array, steps in zip(arrays, strides):
        assert np.array_equal(np.lib.stride_tricks.as_strided(array, lengths, steps).ravel(), array.ravel())


def test_neighbours_without_gaps_are_merged():
    array = np.zeros((2, 3, 4))
    assert _gpu._merged(array.shape, [array.strides]) == ([24], [[8]])
    assert _gpu._merged((5, 7), [(0, 4), (28, 4)]) == ([5, 7], [[0, 4], [28, 4]])
    assert _gpu._merged((1, 1), [(8, 8)]) == ([1], [[0]])


@pytest.mark.parametrize("architecture", ("sm_90", "gfx1030"))
def test_kernels_compile(rng, architecture):
    """NVRTC and hipRTC need no GPU."""
    _gpu._find_compiler()
    mesh = hiprt.Mesh(*soup(rng, 50))
    plain = hiprt.build(mesh)
    matrices = np.repeat(np.eye(4, dtype=np.float32)[None, None, :3], 2, 1)
    moving = hiprt.build(hiprt.Instances(hiprt.Instances(plain, matrices, times=[0, 1]), matrices[:, 0]))
    scenes = ((hiprt.build(mesh, layout="half"), "cast", "watertight"), (plain, "cast", "fast"),
              (hiprt.build(mesh, "high"), "count", "reference"), (moving, "cast", "double"),
              (moving, "closest_point", "double"), (plain, "occluded", "watertight"))
    try:
        sizes = [_core.gpu_compile(scene._core, query, precision, architecture) for scene, query, precision in scenes]
    except hiprt.GpuError as fault:
        assert "cannot load" in str(fault)
        pytest.skip(f"no run-time compiler for {architecture}: {str(fault).splitlines()[0]}")
    assert min(sizes) > 4096
