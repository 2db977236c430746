#!/usr/bin/env python3
"""What cast() of PyTorch's tensors on a GPU costs over its kernel, and how it compares with cast() of numpy arrays.

Random rays against a bumpy sphere, first hits. Each figure is a median. `kernel` is between two events of the stream
while the call's own work is hidden: it was enqueued behind other work. `call` is the time until the call returns,
`waited` until its hits are there.
"""

import argparse
import json
import statistics
import time

import numpy as np
from python_overhead import bumpy_sphere, random_rays

import hiprt


def milliseconds(call, rounds: int) -> float:
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return 1e3 * statistics.median(times)


def measure(torch, scene, origins, directions, precision: str, rounds: int) -> dict:
    a, b = torch.from_numpy(origins).cuda(), torch.from_numpy(directions).cuda()

    def cast():
        return scene.cast(a, b, precision=precision)

    def waited():
        cast()
        torch.cuda.synchronize()

    start = time.perf_counter()
    waited()
    first = time.perf_counter() - start
    hits = cast()
    on_cpu = scene.cast(origins, directions, precision=precision)
    same = all(np.array_equal(x.cpu().numpy().view(np.uint8), y.view(np.uint8)) for x, y in zip(hits, on_cpu) if y.size)
    kernels = []
    for _ in range(rounds):
        begin, end = torch.cuda.Event(enable_timing=True), torch.cuda.Event(enable_timing=True)
        torch.cuda._sleep(20_000_000)
        begin.record()
        cast()
        end.record()
        torch.cuda.synchronize()
        kernels.append(begin.elapsed_time(end))
    calls = []
    for _ in range(rounds):
        calls.append(milliseconds(cast, 1))
        torch.cuda.synchronize()
    return {"precision": precision, "same_bits": same, "found": float(on_cpu.found.mean()),
            "first_call_ms": 1e3 * first, "kernel_ms": statistics.median(kernels), "call_ms": statistics.median(calls),
            "waited_ms": milliseconds(waited, rounds),
            "numpy_ms": milliseconds(lambda: scene.cast(origins, directions, precision=precision), min(rounds, 5))}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--triangles", type=int, default=1_000_000)
    parser.add_argument("--rays", type=int, default=1_000_000)
    parser.add_argument("--rounds", type=int, default=21)
    parser.add_argument("--precisions", nargs="+", default=["watertight", "double"])
    options = parser.parse_args()
    import torch

    start = time.perf_counter()
    scene = hiprt.build(hiprt.Mesh(*bumpy_sphere(options.triangles)))
    print(f"{torch.cuda.get_device_name()}, PyTorch {torch.__version__}, hiprt {hiprt.__version__}; "
          f"{scene.primitives} triangles built in {time.perf_counter() - start:.1f} s on the CPU", flush=True)
    origins, directions = random_rays(options.rays, np.random.default_rng(20261128))
    for precision in options.precisions:
        print(json.dumps(measure(torch, scene, origins, directions, precision, options.rounds)), flush=True)


if __name__ == "__main__":
    main()
