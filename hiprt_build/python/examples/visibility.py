"""Which points see each other: all pairs of 400 points among spheres.

A ray from a to b with direction b - a is between them for 0 < t < 1. The picture is the matrix of visible pairs, sorted
by how many points each one sees.
"""

import sys

import numpy as np

import hiprt
from hiprt import render


def ball(segments: int = 24) -> hiprt.Mesh:
    polar, around = np.meshgrid(np.linspace(0, np.pi, segments + 1), np.linspace(0, 2 * np.pi, 2 * segments + 1),
                                indexing="ij")
    vertices = np.stack((np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)), axis=-1)
    width = 2 * segments + 1
    corner = (np.arange(segments)[:, None] * width + np.arange(width - 1)).reshape(-1, 1)
    quads = corner + np.array([0, 1, width + 1, width])
    return hiprt.Mesh(vertices.reshape(-1, 3), np.concatenate((quads[:, :3], quads[:, [0, 2, 3]])))


def main(output: str) -> None:
    random = np.random.default_rng(11)
    middles, radii = random.uniform(-10, 10, (150, 3)), random.uniform(0.4, 1.6, 150)
    matrices = np.zeros((150, 3, 4))
    for axis in range(3):
        matrices[:, axis, axis] = radii
    matrices[:, :, 3] = middles
    scene = hiprt.build(hiprt.Instances(hiprt.build(ball(), "high"), matrices))

    points = random.uniform(-10, 10, (1000, 3))
    apart = np.linalg.norm(points[:, None] - middles, axis=-1) > 1.01 * radii
    points = points[apart.all(axis=1)][:400].astype(np.float32)
    visible = ~scene.occluded(points[:, None], points[None] - points[:, None], tmin=0, tmax=1)
    np.fill_diagonal(visible, True)
    print(f"{len(points)} points: {visible.mean():.0%} of the pairs see each other, "
          f"{(visible != visible.T).sum()} in one direction only")
    order = np.argsort(visible.sum(axis=1))
    render.write_png(output, visible[np.ix_(order, order)].astype(float))


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "visibility.png")
