#!/usr/bin/env python3
"""Writes the golden files float.bvh and planes.bvh beside this script, from FORMAT.md alone (no code of hiprt).

The scene: four leaves in a row along x. Leaf i is the unit square from (2i, 0, 0) to (2i + 1, 1, 0): v0 = (2i, 0, 0),
v1 = (2i + 1, 0, 0), v2 = (2i, 1, 0), v3 = (2i + 1, 1, 0), but leaf 2 has one triangle only, so v3 = v2.
Geometry 0 has 6 triangles: 0 and 1 in leaf 0, 2 and 3 in leaf 1, 5 in leaf 2; 4 is dropped. Geometry 1, with mask 2, has 2
triangles in leaf 3: 1, with its corners rotated by 1, and 0, rotated by 2.

    node 0: slot 0 = run of leaves 0 and 1, slot 2 = node 1      (slots 1 and 3 absent)
    node 1: slot 1 = leaf 2, slot 3 = leaf 3                     (slots 0 and 2 absent)
"""
import ctypes
import pathlib
import struct

NONE = 0xFFFFFFFF
INF = float("inf")
EMPTY = (INF, INF, INF, -INF, -INF, -INF)
PROVENANCE = '{"tool": "make_golden.py", "note": "gr\u00fc\u00dfe"}'.encode()
NODES_AT, LEAVES_AT = 384, 384 + 2 * 128


def node_ref(i):
    return (NODES_AT + 128 * i) // 64 << 3 | 5


def leaf_ref(i):
    return (LEAVES_AT + 64 * i) // 64 << 3 | 0


def row_box(first, last):
    """The box of leaves first to last."""
    return (2 * first, 0, 0, 2 * last + 1, 1, 0)


def node(layout, children):
    """children: four of (reference, box, flags)."""
    refs = struct.pack("<4I", *(ref for ref, _, _ in children))
    if layout == 1:
        boxes = b"".join(struct.pack("<6f", *box) for _, box, _ in children)
    else:
        boxes = b"".join(struct.pack("<f", children[c][1][3 * side + axis])
                         for axis in range(3) for side in range(2) for c in range(4))
    return refs + boxes + bytes(flags for _, _, flags in children) + bytes(12)


def leaf(layout, vertices, primitives, geometry, last, ids):
    if layout == 1:
        points = b"".join(struct.pack("<3f", *v) for v in vertices)
    else:
        points = b"".join(struct.pack("<4f", *(v[axis] for v in vertices)) for axis in range(3))
    return points + struct.pack("<3I", *primitives, geometry | (0x80000000 if last else 0)) + bytes([*ids, 0, 0])


def square(i, triangles=2):
    x = 2 * i
    v = [(x, 0, 0), (x + 1, 0, 0), (x, 1, 0), (x + 1, 1, 0)]
    return v if triangles == 2 else v[:3] + v[2:3]


def sections(layout):
    absent = (NONE, EMPTY, 0)
    nodes = node(layout, [(leaf_ref(0), row_box(0, 1), 5), absent, (node_ref(1), row_box(2, 3), 5), absent])
    nodes += node(layout, [absent, (leaf_ref(2), (4, 0, 0, 5, 1, 0), 5), absent, (leaf_ref(3), row_box(3, 3), 5)])
    leaves = leaf(layout, square(0), (0, 1), 0, False, (0x89, 0x89))
    leaves += leaf(layout, square(1), (2, 3), 0, True, (0x89, 0x89))
    leaves += leaf(layout, square(2, 1), (5, NONE), 0, True, (0x89, 0))
    leaves += leaf(layout, square(3), (1, 0), 1, True, (0x84, 0x82))
    primitive_map = struct.pack("<8I", 0, 1, 2, 3, NONE, 4, 7, 6)
    geometries = struct.pack("<3Q2I", 0, 6, 1, NONE, 0) + struct.pack("<3Q2I", 6, 2, 0, 2, 0)
    return [(1, 1, nodes, 128), (2, 1, leaves, 64), (3, 1, primitive_map, 4), (4, 1, geometries, 32),
            (5, 0, PROVENANCE, 1)]


def assemble(layout):
    table, body, offset = b"", b"", 384
    for kind, flags, content, stride in sections(layout):
        table += struct.pack("<2I3Q", kind, flags, offset, len(content) // stride, stride)
        content += bytes(-len(content) % 128 if kind != 5 else 0)
        body += content
        offset += len(content)
    head = struct.pack("<8s2HIQQ", b"HIPRTBVH", 1, 0, layout, 1 | 2, offset)
    tail = struct.pack("<4I6fQ5Q", 5, node_ref(0), 2, 2, *row_box(0, 3), 8, 0, 0, 0, 0, 0)
    tail += table + bytes(384 - 128 - len(table)) + body
    return head + struct.pack("<Q", xxh3(head + tail)) + tail


def xxh3(data):
    library = ctypes.CDLL("libxxhash.so.0")
    library.XXH3_64bits.restype = ctypes.c_uint64
    library.XXH3_64bits.argtypes = [ctypes.c_char_p, ctypes.c_size_t]
    return library.XXH3_64bits(data, len(data))


if __name__ == "__main__":
    for layout, name in ((1, "float"), (2, "planes")):
        (pathlib.Path(__file__).parent / f"{name}.bvh").write_bytes(assemble(layout))
