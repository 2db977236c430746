"""Which points see each other, on a GPU: all pairs of 2000 points among spheres, as tensors of PyTorch.

Origins are broadcast: the kernel reads each point in place for all its rays. The picture is the matrix of visible
pairs, sorted by how many points each one sees.
"""

import sys

import numpy as np

import hiprt
from hiprt import render


def spheres(random: np.random.Generator, count: int) -> "tuple[hiprt.Scene, np.ndarray, np.ndarray]":
    """A scene of spheres, their middles and radii."""
    polar, around = np.meshgrid(np.linspace(0, np.pi, 25), np.linspace(0, 2 * np.pi, 49), indexing="ij")
    vertices = np.stack((np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)), axis=-1)
    corner = (np.arange(24)[:, None] * 49 + np.arange(48)).reshape(-1, 1)
    quads = corner + np.array([0, 1, 50, 49])
    ball = hiprt.build(hiprt.Mesh(vertices.reshape(-1, 3), np.concatenate((quads[:, :3], quads[:, [0, 2, 3]]))), "high")
    middles, radii = random.uniform(-10, 10, (count, 3)), random.uniform(0.4, 1.6, count)
    matrices = np.concatenate((np.eye(3) * radii[:, None, None], middles[:, :, None]), axis=2)
    return hiprt.build(hiprt.Instances(ball, matrices)), middles, radii


def main(output: str, device: str = "cuda") -> None:
    import torch

    random = np.random.default_rng(11)
    scene, middles, radii = spheres(random, 150)
    points = random.uniform(-10, 10, (5000, 3))
    apart = np.linalg.norm(points[:, None] - middles, axis=-1) > 1.01 * radii
    points = torch.tensor(points[apart.all(axis=1)][:2000], dtype=torch.float32, device=device)

    visible = ~scene.occluded(points[:, None], points[None] - points[:, None], tmin=0, tmax=1)
    visible.fill_diagonal_(True)
    seen = visible.sum(dim=1)
    order = seen.argsort()
    one_way = int((visible != visible.T).sum())
    print(f"{len(points)} points on {points.device}: {float(seen.float().mean()) / len(points):.0%} of the pairs see "
          f"each other, {one_way} in one direction only")
    render.write_png(output, visible[order][:, order].float().cpu().numpy().astype(float))


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "visibility_gpu.png")
