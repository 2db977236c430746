"""emulated_gpu.py COUNT [quick]: queries of AMD's GPU code, run by amdrun on the CPU. test_gpu_amd.py starts it.

Memory comes from the HIP runtime by ctypes, and has DLPack's methods. The judge is the CPU.
"""

import ctypes
import sys

import numpy as np

import hiprt
from hiprt import _core
from shapes import rays_at, soup
from test_instances import random_matrices

hip = ctypes.CDLL("libamdhip64.so.5")


def checked(status):
    assert status == 0, f"HIP error {status}"


class Tensor:
    """A numpy array's copy on the device."""

    def __init__(self, array):
        self.array, self.streams = np.ascontiguousarray(array), []
        self.memory = _core.GpuMemory(True, 0, max(self.array.nbytes, 1))
        checked(hip.hipMemcpy(ctypes.c_void_p(self.memory.address), ctypes.c_void_p(self.array.ctypes.data),
                              ctypes.c_size_t(self.array.nbytes), 1))

    def __dlpack_device__(self):
        return 10, 0

    def __dlpack__(self, *, stream=None):
        self.streams.append(stream)
        return _core.gpu_tensor(self.memory, self.memory.address, list(self.array.shape), str(self.array.dtype))


def to_numpy(result):
    """By the result's DLPack capsule."""
    assert type(result) is hiprt.GpuArray and result.__dlpack_device__() == (10, 0)
    view = _core.GpuView(result.__dlpack__(stream=0))
    array = np.empty(view.shape, view.type)
    checked(hip.hipDeviceSynchronize())
    checked(hip.hipMemcpy(ctypes.c_void_p(array.ctypes.data), ctypes.c_void_p(view.address),
                          ctypes.c_size_t(array.nbytes), 2))
    return array


def check(name, on_gpu, on_cpu):
    on_gpu, on_cpu = (x if isinstance(x, tuple) else (x,) for x in (on_gpu, on_cpu))
    assert len(on_gpu) == len(on_cpu)
    for k, (a, b) in enumerate(zip(map(to_numpy, on_gpu), on_cpu)):
        assert a.shape == b.shape and a.dtype == b.dtype, (name, k, a.shape, b.shape, a.dtype, b.dtype)
        nan = np.isnan(b) if b.dtype.kind == "f" else np.zeros(b.shape, bool)
        same = (a.view(f"u{a.itemsize}") == b.view(f"u{b.itemsize}")) | (nan & (a != a))
        assert same.all(), (name, k, np.argwhere(~same)[:5], a[~same][:5], b[~same][:5])
    print(f"{name}: the same bits", flush=True)


def main(count, is_quick):
    rng = np.random.default_rng(5)
    plain = hiprt.build(hiprt.Mesh(*soup(rng, 40)))
    placed = hiprt.build(hiprt.Instances(plain, random_matrices(rng, 3, 0.7)))
    origins, directions = rays_at(rng, count)
    a, b = Tensor(origins), Tensor(directions)
    check("cast", plain.cast(a, b), plain.cast(origins, directions))
    assert len(a.streams) == 1 and a.streams[0] != 0  # It was told of hiprt's own stream.
    some = directions.reshape(-1, 1, 3)[:8]
    check("broadcast", plain.cast(a, Tensor(some), 0.1, 2), plain.cast(origins, some, 0.1, 2))
    none = np.zeros((0, 3), np.float32)
    check("empty", plain.cast(Tensor(none), Tensor(none)), plain.cast(none, none))
    points = rng.uniform(-0.5, 1.5, (count, 3))
    check("closest_point", plain.closest_point(Tensor(points), 0.5), plain.closest_point(points, 0.5))
    if is_quick:
        return
    check("cast in instances", placed.cast(a, b, 0.1, 2), placed.cast(origins, directions, 0.1, 2))
    check("occluded", plain.occluded(a, b), plain.occluded(origins, directions))
    check("count", plain.count(a, b, precision="reference"), plain.count(origins, directions, precision="reference"))


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2:] == ["quick"])
