"""How far the points of a grid are from a mesh, and on which side: a slice of its signed distance field.

Scene.signed_distance() is negative inside. The picture has a band for every tenth of a unit of distance: red inside,
blue outside.
"""

import sys

import numpy as np

import hiprt
from hiprt import render

MAJOR, MINOR = 1.0, 0.4


def torus(sides: int = 128) -> hiprt.Mesh:
    around, tube = np.meshgrid(np.arange(sides), np.arange(sides), indexing="ij")
    a, b = 2 * np.pi / sides * around, 2 * np.pi / sides * tube
    ring = MAJOR + MINOR * np.cos(b)
    vertices = np.stack((ring * np.cos(a), ring * np.sin(a), MINOR * np.sin(b)), axis=-1).reshape(-1, 3)
    corner = [(around + i) % sides * sides + (tube + k) % sides for i, k in ((0, 0), (1, 0), (1, 1), (0, 1))]
    quads = np.stack(corner, axis=-1).reshape(-1, 4)
    return hiprt.Mesh(vertices, np.concatenate((quads[:, [0, 1, 2]], quads[:, [0, 2, 3]])))


def main(output: str) -> None:
    scene = hiprt.build(torus(), "fast")
    x, y = np.meshgrid(np.linspace(-2, 2, 320), np.linspace(1.5, -1.5, 240))
    points = np.stack((x, y, 0.2 * np.ones_like(x)), axis=-1)
    distance = scene.signed_distance(points, precision="float")

    exact = np.hypot(np.hypot(points[..., 0], points[..., 1]) - MAJOR, points[..., 2]) - MINOR
    print(f"{distance.size} points: {distance.min():.2f} to {distance.max():.2f}, "
          f"{np.abs(distance - exact).max():.4f} from a smooth torus at most")

    shade = 0.6 + 0.4 * (np.floor(10 * np.abs(distance)) % 2)
    colour = np.where((distance < 0)[..., None], [0.9, 0.3, 0.2], [0.3, 0.5, 0.9])
    render.write_png(output, shade[..., None] * colour)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "distance_field.png")
