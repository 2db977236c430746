"""Meshes and rays of the tests."""

import numpy as np


def soup(rng, triangles, size=0.3):
    """Triangles without order in the unit cube: vertices and indices. The vertices have no order either."""
    corner = rng.uniform(0, 1, (triangles, 1, 3))
    vertices = (corner + rng.normal(0, size, (triangles, 3, 3))).reshape(-1, 3).astype(np.float32)
    order = rng.permutation(3 * triangles)
    return vertices[order], np.argsort(order).astype(np.uint32).reshape(-1, 3)


def sphere(rows=24, radius=1.0):
    """A closed mesh. The poles are single vertices."""
    columns = 2 * rows
    polar, around = np.meshgrid(np.linspace(0, np.pi, rows + 1)[1:-1], 2 * np.pi / columns * np.arange(columns),
                                indexing="ij")
    ring = np.stack((np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)), -1).reshape(-1, 3)
    vertices = radius * np.concatenate((ring, [[0, 0, 1], [0, 0, -1]])).astype(np.float32)
    north, south, faces = len(ring), len(ring) + 1, []
    for column in range(columns):
        after = (column + 1) % columns
        faces.append((north, column, after))
        faces.append((south, (rows - 2) * columns + after, (rows - 2) * columns + column))
        for row in range(rows - 2):
            a, b = row * columns + column, row * columns + after
            faces += [(a, a + columns, b + columns), (a, b + columns, b)]
    return vertices, np.array(faces, np.uint32)


def rays_at(rng, count, low=0.0, high=1.0, reach=3.0):
    """float32 rays from around a box to points in it, with directions of any length."""
    origins = rng.normal(0, 1, (count, 3))
    origins = 0.5 * (low + high) + reach * origins / np.linalg.norm(origins, axis=1, keepdims=True)
    directions = rng.uniform(low, high, (count, 3)) - origins
    return origins.astype(np.float32), (directions * rng.uniform(0.1, 4, (count, 1))).astype(np.float32)


def same(a, b):
    """Whether two results of cast() or list() have the same bits."""
    return all(np.array_equal(x.view(np.uint8) if x.flags.c_contiguous and x.ndim else x,
                              y.view(np.uint8) if y.flags.c_contiguous and y.ndim else y) for x, y in zip(a, b))
