"""fake_driver.py compile | run: streams and lifetimes of queries with the driver of fake_cuda.c.

test_gpu_driver.py starts it. `compile` fills the cache of kernels without the driver, `run` uses it.
"""

import ctypes
import gc
import sys

import numpy as np

import hiprt
from hiprt import _core, _gpu
from shapes import rays_at, soup

OWN, THEIRS = 0x77, 0x1230


class Tensor:
    """Memory of the driver with DLPack's methods, as JAX has it."""

    def __init__(self, array):
        self.array, self.streams = np.ascontiguousarray(array), []

    def __dlpack_device__(self):
        return 2, 0

    def __dlpack__(self, *, stream=None):
        self.streams.append(stream)
        memory = _core.GpuMemory(False, 0, self.array.nbytes)
        ctypes.memmove(memory.address, self.array.ctypes.data, self.array.nbytes)
        return _core.gpu_tensor(memory, memory.address, list(self.array.shape), str(self.array.dtype))


class Interface:
    """Host memory that the driver takes for its own."""

    def __init__(self, array, **entries):
        self.array = array
        self.entries = {"shape": array.shape, "typestr": array.dtype.str, "data": (array.ctypes.data, True),
                        "version": 3, **entries}

    @property
    def __cuda_array_interface__(self):
        return self.entries


def main(mode):
    rng = np.random.default_rng(3)
    scene = hiprt.build(hiprt.Mesh(*soup(rng, 30)))
    if mode == "compile":
        _gpu._find_compiler()
        print(_core.gpu_compile(scene._core, "cast", "watertight", "sm_90"))
        return
    fake = ctypes.CDLL("libcuda.so.1")
    fake.fake_launch_stream.restype = fake.fake_wait_stream.restype = ctypes.c_size_t
    origins, directions = rays_at(rng, 300)

    def cast(a, b, **more):
        launches = fake.fake_launches()
        hits = scene.cast(a, b, **more)
        assert fake.fake_launches() == launches + 1 and fake.fake_contexts() == 0
        return hits

    # A copy of the scene before the first query, which then makes none.
    memories = fake.fake_memories()
    assert scene.copy_to("cuda:0") is scene and fake.fake_memories() == memories + 1 and fake.fake_contexts() == 0
    scene.copy_to("cuda").copy_to("cpu")
    assert fake.fake_memories() == memories + 1
    other = hiprt.build(hiprt.Mesh(*soup(rng, 30)), device="cuda")
    assert fake.fake_memories() == memories + 2
    del other
    gc.collect()
    assert fake.fake_memories() == memories + 1

    # DLPack: the producer is told of the stream; a consumer's stream waits for the results.
    fake.fake_finish(0)
    a, b = Tensor(origins), Tensor(directions)
    hits = cast(a, b)
    assert fake.fake_launch_stream() == OWN and a.streams == b.streams == [OWN]
    waits = fake.fake_waits()
    capsule = hits.t.__dlpack__(stream=THEIRS, max_version=(1, 0))
    assert fake.fake_waits() == waits + 1 and fake.fake_wait_stream(waits) == THEIRS
    assert hits.t.__dlpack__(stream=-1) is not None and fake.fake_waits() == waits + 1
    cast(a, b, stream=THEIRS)
    assert fake.fake_launch_stream() == THEIRS and a.streams == [OWN, THEIRS]

    # The interface: its stream, or waiting for its stream.
    cast(Interface(origins, stream=THEIRS), Interface(directions))
    assert fake.fake_launch_stream() == THEIRS and fake.fake_waits() == waits + 1
    cast(Interface(origins), Interface(directions, stream=THEIRS))
    assert fake.fake_launch_stream() == 0 and fake.fake_wait_stream(waits + 1) == 0
    print("streams: right", flush=True)

    # Tensors live until the event behind the query is reached, and results until their last capsule dies.
    del a, b
    gc.collect()
    held = fake.fake_memories()
    assert held >= 4 + 2  # Of two queries, the scene's copy, and the first results.
    fake.fake_finish(1)
    cast(Interface(origins), Interface(directions))
    assert fake.fake_memories() == held - 4
    address = hits.t.__cuda_array_interface__["data"][0]
    del hits
    gc.collect()
    assert fake.fake_memories() == held - 4 and address != 0
    del capsule
    gc.collect()
    assert fake.fake_memories() == held - 5
    scene.refit(hiprt.Mesh(*soup(np.random.default_rng(3), 30)))
    gc.collect()
    assert fake.fake_memories() == held - 6
    _gpu._let_go()
    gc.collect()
    assert fake.fake_memories() == fake.fake_events() == 0
    print("lifetimes: right", flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
