"""Which points are inside of a closed mesh, and how large it is.

Scene.count() with precision "reference" counts crossings exactly, so an odd number means inside, also for rays through
edges and corners. The picture is a slice of the mesh.
"""

import sys

import numpy as np

import hiprt
from hiprt import render


def torus(major: float, minor: float, sides: int = 96) -> hiprt.Mesh:
    around, tube = np.meshgrid(np.arange(sides), np.arange(sides), indexing="ij")
    a, b = 2 * np.pi / sides * around, 2 * np.pi / sides * tube
    ring = major + minor * np.cos(b)
    vertices = np.stack((ring * np.cos(a), ring * np.sin(a), minor * np.sin(b)), axis=-1).reshape(-1, 3)
    corner = [(around + i) % sides * sides + (tube + k) % sides for i, k in ((0, 0), (1, 0), (1, 1), (0, 1))]
    quads = np.stack(corner, axis=-1).reshape(-1, 4)
    return hiprt.Mesh(vertices, np.concatenate((quads[:, [0, 1, 2]], quads[:, [0, 2, 3]])))


def inside(scene: hiprt.Scene, points: np.ndarray) -> np.ndarray:
    up = np.array([0, 0, 1], np.float32)
    return scene.count(points.astype(np.float32), up, precision="reference") % 2 == 1


def main(output: str) -> None:
    scene = hiprt.build(torus(1.0, 0.4), "fast")
    random = np.random.default_rng(3)
    low, high = scene.bounds
    points = random.uniform(low, high, (200_000, 3))
    volume = inside(scene, points).mean() * np.prod(high - low)
    print(f"volume: {volume:.3f} by random points, {2 * np.pi**2 * 0.4**2:.3f} of a smooth torus")

    x, y = np.meshgrid(np.linspace(-1.5, 1.5, 400), np.linspace(1.5, -1.5, 400))
    slice_points = np.stack((x, y, 0.25 * np.ones_like(x)), axis=-1)
    render.write_png(output, np.where(inside(scene, slice_points), 0.2, 1.0))


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "point_in_mesh.png")
