#!/usr/bin/env python3
"""What the Python module hiprt costs over C++, and how it compares with Open3D and trimesh's embree backend.

Random rays against a bumpy sphere, first hits. All sides trace the same rays in turn, round by round; each figure is a
median. Only ratios of one run mean something, and on a machine that others use they move by several percent.
Peers that are not installed are left out.
"""

import argparse
import json
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import hiprt


def bumpy_sphere(triangles: int) -> tuple[np.ndarray, np.ndarray]:
    """About so many triangles, with bumps on three scales."""
    rows = max(3, round((triangles / 4) ** 0.5))
    columns = 2 * rows
    polar, around = np.meshgrid(np.linspace(0, np.pi, rows + 1), np.linspace(0, 2 * np.pi, columns + 1), indexing="ij")
    radius = 1 + sum(s * np.sin(polar * f) * np.sin(around * f) for s, f in ((0.1, 5), (0.02, 37), (0.004, 211)))
    points = np.stack((np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)), axis=-1)
    vertices = (radius[..., None] * points).reshape(-1, 3).astype(np.float32)
    corner = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).reshape(-1, 1)
    quads = corner + np.array([0, 1, columns + 2, columns + 1])
    return vertices, np.concatenate((quads[:, :3], quads[:, [0, 2, 3]])).astype(np.uint32)


def random_rays(count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """From a sphere around the mesh to points in it: about four in five hit."""
    origins = rng.normal(size=(count, 3))
    origins *= 3 / np.linalg.norm(origins, axis=1, keepdims=True)
    return origins.astype(np.float32), (rng.uniform(-1, 1, (count, 3)) - origins).astype(np.float32)


class Cpp:
    """closest_hits() in a program, which traces whenever it reads a line."""

    def __init__(self, program: str, folder: Path, threads: int) -> None:
        self.process = subprocess.Popen([program, folder / "scene.bvh", folder / "rays", str(threads)],
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def __call__(self) -> float:
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        return float(self.process.stdout.readline().split()[0])


def timed(call) -> float:
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def sides(options, vertices, indices, origins, directions, folder: Path) -> dict:
    """Functions that trace once and return seconds."""
    scene = hiprt.build(hiprt.Mesh(vertices, indices), options.quality)
    found = {}
    if options.program:
        scene.save(folder / "scene.bvh")
        np.concatenate((origins, directions), axis=1).tofile(folder / "rays")
        found["C++ closest_hits"] = Cpp(options.program, folder, options.threads)
    found["hiprt cast"] = lambda: timed(lambda: scene.cast(origins, directions, threads=options.threads))
    found["hiprt cast double"] = lambda: timed(
        lambda: scene.cast(origins, directions, threads=options.threads, precision="double"))
    rays = np.concatenate((origins, directions), axis=1)
    from hiprt.open3d_like import RaycastingScene
    like = RaycastingScene(quality=options.quality)
    like.add_triangles(vertices, indices)
    found["hiprt.open3d_like cast_rays"] = lambda: timed(lambda: like.cast_rays(rays, nthreads=options.threads))
    try:
        import open3d
        peer = open3d.t.geometry.RaycastingScene()
        peer.add_triangles(open3d.core.Tensor(vertices), open3d.core.Tensor(indices))
        tensor = open3d.core.Tensor(rays)
        found["Open3D cast_rays"] = lambda: timed(lambda: peer.cast_rays(tensor, nthreads=options.threads))
    except ImportError as reason:
        print(f"without Open3D: {reason}", file=sys.stderr)
    try:
        import trimesh
        from trimesh.ray.ray_pyembree import RayMeshIntersector as Embree

        from hiprt.trimesh import RayMeshIntersector as Ours
        mesh = trimesh.Trimesh(vertices, indices, process=False)
        ours = Ours(mesh, quality=options.quality, threads=options.threads)
        embree = Embree(mesh)
        found["hiprt.trimesh intersects_first"] = lambda: timed(lambda: ours.intersects_first(origins, directions))
        found["trimesh embree intersects_first"] = lambda: timed(lambda: embree.intersects_first(origins, directions))
    except ImportError as reason:
        print(f"without trimesh's embree backend: {reason}", file=sys.stderr)
    return found


RATIOS = [("hiprt cast", "C++ closest_hits"), ("Open3D cast_rays", "hiprt cast"),
          ("Open3D cast_rays", "hiprt.open3d_like cast_rays"),
          ("trimesh embree intersects_first", "hiprt.trimesh intersects_first")]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--program", help="bench_python_overhead, for the comparison with C++")
    parser.add_argument("--triangles", type=int, default=1_000_000)
    parser.add_argument("--rays", type=int, default=1_000_000)
    parser.add_argument("--threads", type=int, default=0, help="0: all. trimesh's backend always has one")
    parser.add_argument("--rounds", type=int, default=11)
    parser.add_argument("--quality", default="balanced", choices=("fast", "balanced", "high"))
    parser.add_argument("--json", action="store_true", help="print JSON")
    options = parser.parse_args()
    vertices, indices = bumpy_sphere(options.triangles)
    origins, directions = random_rays(options.rays, np.random.default_rng(1))
    with tempfile.TemporaryDirectory() as folder:
        traced = sides(options, vertices, indices, origins, directions, Path(folder))
        for trace in traced.values():
            trace()
        seconds = {name: [] for name in traced}
        for _ in range(options.rounds):
            for name, trace in traced.items():
                seconds[name].append(trace())
    medians = {name: statistics.median(times) for name, times in seconds.items()}
    # Of each round, so that what slows the machine down slows both.
    ratios = {f"{a} / {b}": statistics.median(x / y for x, y in zip(seconds[a], seconds[b]))
              for a, b in RATIOS if a in seconds and b in seconds}
    if options.json:
        print(json.dumps({"machine": platform.processor() or platform.machine(), "triangles": len(indices),
                          "rays": options.rays, "threads": options.threads, "seconds": seconds, "medians": medians,
                          "ratios": ratios}, indent=1))
        return 0
    print(f"{options.rays} rays, {len(indices)} triangles, {options.threads or 'all'} threads, "
          f"median of {options.rounds} rounds")
    for name, median in medians.items():
        print(f"{name:34} {median:8.4f} s  {options.rays / median * 1e-6:7.2f} Mrays/s")
    for name, ratio in ratios.items():
        print(f"{name:68} {ratio:6.3f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
