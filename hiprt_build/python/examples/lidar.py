"""A LiDAR above trees: beams have several returns, because leaves let part of the light pass.

Scene.list() gives all hits of each beam in order. The picture shows the returns from the side, coloured by number.
"""

import sys

import numpy as np

import hiprt
from hiprt import render

RETURNS = 4
LEAF_PASSES = 0.6  # Part of the light that passes a leaf.


def forest(rng: np.random.Generator) -> list[hiprt.Mesh]:
    """Mesh 0: the ground. Mesh 1: leaves, triangles without order in the crowns of trees."""
    ground = np.array([[-50, -50, 0], [50, -50, 0], [50, 50, 0], [-50, 50, 0]], np.float32)
    trunks = rng.uniform(-45, 45, (60, 2))
    middle = np.concatenate((trunks, rng.uniform(6, 12, (60, 1))), axis=1)
    place = np.repeat(middle, 400, axis=0) + rng.normal(0, (1.6, 1.6, 2.0), (60 * 400, 3))
    leaves = place[:, None] + rng.normal(0, 0.45, (len(place), 3, 3))
    return [hiprt.Mesh(ground, [[0, 1, 2], [0, 2, 3]], name="ground"), hiprt.Mesh(leaves.reshape(-1, 3), name="leaves")]


def main(output: str) -> None:
    scene = hiprt.build(forest(np.random.default_rng(7)), builder="hploc")
    # Two passes at 60 m, 400 beams across and 300 along.
    x, y = np.meshgrid(np.linspace(-48, 48, 400), np.linspace(-48, 48, 300))
    origins = np.stack((np.zeros_like(x), y, np.full_like(x, 60)), axis=-1).reshape(-1, 3).astype(np.float32)
    targets = np.stack((x, y, np.zeros_like(x)), axis=-1).reshape(-1, 3).astype(np.float32)
    directions = targets - origins
    hits = scene.list(origins, directions, max_hits=RETURNS)

    number = np.arange(len(hits.t)) - hits.offsets[hits.rays]  # 0: first return.
    energy = LEAF_PASSES ** number.astype(float)
    points = origins[hits.rays] + hits.t[:, None] * directions[hits.rays]
    beams = np.bincount(np.diff(hits.offsets), minlength=RETURNS + 1)
    ground = (hits.geometry == 0).sum() / len(origins)
    print(f"beams with 1, 2, 3, 4 returns: {', '.join(str(n) for n in beams[1:])}")
    print(f"{ground:.0%} of the beams reach the ground, with {energy[hits.geometry == 0].mean():.0%} of their light")

    colours = np.array([[0.1, 0.3, 0.9], [0.1, 0.7, 0.2], [0.9, 0.6, 0.0], [0.8, 0.1, 0.1]])
    picture = np.ones((200, 800, 3))
    column = np.clip(((points[:, 0] + 50) * 8).astype(int), 0, 799)
    row = np.clip(190 - (points[:, 2] * 9).astype(int), 0, 199)
    picture[row, column] = colours[number]
    render.write_png(output, picture)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "lidar.png")
