"""The shadows of a city over a day: hours of sun at each point of the ground.

One house is built once and placed by instances. Scene.occluded() asks whether the sun is hidden.
"""

import sys

import numpy as np

import hiprt
from hiprt import render

CUBE = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (0, 1)], np.float32)
FACES = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [1, 5, 7], [1, 7, 3]]


def city(rng: np.random.Generator, blocks: int = 20) -> hiprt.Scene:
    house = hiprt.build(hiprt.Mesh(CUBE, FACES))
    x, y = np.meshgrid(np.arange(blocks), np.arange(blocks))
    matrices = np.zeros((blocks * blocks, 3, 4), np.float32)
    matrices[:, 0, 0], matrices[:, 1, 1] = rng.uniform(12, 20, (2, blocks * blocks))
    matrices[:, 2, 2] = rng.gamma(2, 4, blocks * blocks) + 4
    matrices[:, :2, 3] = 30 * np.stack((x, y), axis=-1).reshape(-1, 2) + 15
    return hiprt.build(hiprt.Instances(house, matrices))


def sun_at(hour: float) -> np.ndarray:
    """Direction to the sun at 50 degrees north on the equinox; x is east, y is north."""
    angle, latitude = np.pi / 12 * (hour - 12), np.radians(50)
    return np.array([-np.sin(angle), -np.cos(angle) * np.sin(latitude), np.cos(angle) * np.cos(latitude)], np.float32)


def main(output: str) -> None:
    scene = city(np.random.default_rng(5))
    x, y = np.meshgrid(np.linspace(0, 600, 480), np.linspace(600, 0, 480))
    ground = np.stack((x, y, np.zeros_like(x)), axis=-1).astype(np.float32)
    hours = np.arange(7, 17.5, 0.5)
    sunny = np.zeros(x.shape)
    for hour in hours:
        sunny += 0.5 * ~scene.occluded(ground, sun_at(hour))
    # The points below houses: a ray upwards from below meets a roof.
    free = ~scene.occluded(ground, np.array([0, 0, 1], np.float32))
    print(f"{scene.primitives} houses; {sunny[free].mean():.1f} hours of sun on average, "
          f"{(sunny[free] < 2).mean():.0%} of the streets have less than 2")
    shade = sunny / sunny.max()
    render.write_png(output, np.where(free[..., None], shade[..., None] * [1, 0.95, 0.8], [0.35, 0.35, 0.45]))


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "city_shadows.png")
