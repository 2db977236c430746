#!/usr/bin/env python3
"""Makes scenes of instances, to measure what opening them does. Needs numpy. See --help."""

import argparse
import struct
import sys
from pathlib import Path

import numpy as np

SEED = 5
SCN1 = 0x314E4353


def write_scene(path, meshes, instances):
    """@param meshes (vertices, triangles). @param instances (number of the mesh, 3 x 4 matrix to the scene)."""
    with open(path, "wb") as file:
        file.write(struct.pack("<2I", SCN1, len(meshes) + 1))
        for vertices, triangles in meshes:
            file.write(struct.pack("<3I", 0, len(vertices), len(triangles)))
            file.write(vertices.astype("<f4").tobytes() + triangles.astype("<u4").tobytes())
        file.write(struct.pack("<2I", 1, len(instances)))
        for mesh, matrix in instances:
            file.write(struct.pack("<I12f", mesh, *np.ravel(matrix)))


def write_camera(path, eye, at):
    path.write_text(f"eye {' '.join(map(str, eye))} / at {' '.join(map(str, at))} / up 0 1 0 / 50\n")


def turned(angle, position, scale=1.0):
    c, s = scale * np.cos(angle), scale * np.sin(angle)
    x, y, z = position
    return [[c, 0, s, x], [0, scale, 0, y], [-s, 0, c, z]]


def box(low, high, count):
    """A box whose faces have count x count squares."""
    steps = np.linspace(0, 1, count + 1)
    vertices, triangles = [], []
    for axis in range(3):
        for side in (0, 1):
            first = len(vertices)
            for a in steps:
                for b in steps:
                    at = np.empty(3)
                    at[[axis, (axis + 1) % 3, (axis + 2) % 3]] = side, a, b
                    vertices.append(low + (high - low) * at)
            for i in range(count):
                for j in range(count):
                    q = first + i * (count + 1) + j
                    triangles += [[q, q + 1, q + count + 1], [q + 1, q + count + 2, q + count + 1]]
    return np.array(vertices), np.array(triangles)


def joined(parts):
    first = np.cumsum([0] + [len(vertices) for vertices, _ in parts])
    return (np.concatenate([vertices for vertices, _ in parts]),
            np.concatenate([triangles + n for (_, triangles), n in zip(parts, first)]))


def house(rng):
    """A body with a roof, ten chimneys, and a fence: 378 triangles."""
    width, depth, height = rng.uniform([5, 5, 4], [8, 8, 14])
    x, z = width / 2, depth / 2
    parts = [box(np.array([-x, 0, -z]), np.array([x, height, z]), 3)]
    roof = [[-x, height, -z], [x, height, -z], [x, height, z], [-x, height, z], [0, height + 2, -z], [0, height + 2, z]]
    parts.append((np.array(roof), np.array([[0, 1, 4], [3, 5, 2], [0, 4, 5], [0, 5, 3], [1, 2, 5], [1, 5, 4]])))
    for at in rng.uniform([-x, -z], [x, z], (10, 2)):
        low = np.array([at[0] - 0.2, height, at[1] - 0.2])
        parts.append(box(low, low + [0.4, 2.5, 0.4], 1))
    for at in rng.uniform(-5, 5, 12):
        parts.append(box(np.array([at - 0.1, 0, -5]), np.array([at + 0.1, 1, -4.9]), 1))
    return joined(parts)


def ground(size, count):
    steps = np.linspace(-20, size + 20, count + 1)
    x, z = np.meshgrid(steps, steps)
    vertices = np.stack([x, 0.4 * np.sin(0.05 * x) * np.cos(0.05 * z), z], -1).reshape(-1, 3)
    first = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).reshape(-1, 1)
    return vertices, np.concatenate([first + [0, 1, count + 1], first + [1, count + 2, count + 1]])


def town(folder, name, rng):
    side = 169
    meshes = [house(rng) for _ in range(24)] + [ground(12 * side, 64)]
    instances = [(rng.integers(24), turned(rng.integers(4) * np.pi / 2 + rng.uniform(-0.1, 0.1),
                                           (12 * x, rng.uniform(-0.5, 0.5), 12 * z)))
                 for z in range(side) for x in range(side)]
    write_scene(folder / f"{name}.scene", meshes, instances + [(24, turned(0, (0, 0, 0)))])
    write_camera(folder / f"{name}.cam", (-40, 60, -40), (300, 0, 300))


def crowns(folder, name, rng, spacing):
    """Crowns of 380 loose triangles at random places."""
    meshes = []
    for _ in range(16):
        at = rng.normal(size=(380, 3))
        at *= 3 * rng.uniform(0, 1, (380, 1)) ** (1 / 3) / np.linalg.norm(at, axis=1)[:, None]
        at[:, 1] += 5
        corners = np.concatenate([at[:, None], at[:, None] + 0.5 * rng.normal(size=(380, 2, 3))], 1)
        meshes.append((corners.reshape(-1, 3), np.arange(1140).reshape(-1, 3)))
    side = 169 * spacing
    instances = [(rng.integers(16), turned(rng.uniform(0, 2 * np.pi), (x, 0, z), rng.uniform(0.7, 1.3)))
                 for x, z in rng.uniform(0, side, (28524, 2))]
    write_scene(folder / f"{name}.scene", meshes, instances)
    write_camera(folder / f"{name}.cam", (-5 * spacing, 6 * spacing, -5 * spacing), (0.3 * side, 0, 0.3 * side))


def parts(mesh, count, output):
    """Cuts a mesh into objects of neighbouring triangles in its file, each with one instance."""
    data = mesh.read_bytes()
    vertex_count, triangle_count = struct.unpack("<2I", data[:8])
    vertices = np.frombuffer(data, "<f4", 3 * vertex_count, 8).reshape(-1, 3)
    triangles = np.frombuffer(data, "<u4", 3 * triangle_count, 8 + 12 * vertex_count).reshape(-1, 3)
    meshes, instances = [], []
    for part in np.array_split(triangles, count):
        used, numbers = np.unique(part, return_inverse=True)
        centre = vertices[used].mean(0)
        meshes.append((vertices[used] - centre, numbers.reshape(-1, 3)))
        instances.append((len(instances), turned(0, centre)))
    write_scene(output, meshes, instances)


def main():
    parser = argparse.ArgumentParser(description="Makes .scene files of instances, and cameras beside them.")
    commands = parser.add_subparsers(dest="command", required=True)
    for name, text in [("town", "28,561 houses on a ground, apart"), ("orchard", "28,524 crowns, mostly apart"),
                       ("thicket", "28,524 crowns that lie in each other")]:
        commands.add_parser(name, help=text).add_argument("folder", type=Path)
    command = commands.add_parser("parts", help="a mesh in pieces that lie in each other, one instance each")
    command.add_argument("mesh", type=Path)
    command.add_argument("count", type=int, help="pieces, 1 or more")
    command.add_argument("output", type=Path)
    arguments = parser.parse_args()
    rng = np.random.default_rng(SEED)
    if arguments.command == "parts":
        if arguments.count < 1:
            parser.error("count must be 1 or more")
        parts(arguments.mesh, arguments.count, arguments.output)
        return 0
    arguments.folder.mkdir(parents=True, exist_ok=True)
    if arguments.command == "town":
        town(arguments.folder, "town", rng)
    else:
        crowns(arguments.folder, arguments.command, rng, {"orchard": 10.0, "thicket": 4.0}[arguments.command])
    return 0


if __name__ == "__main__":
    sys.exit(main())
