#!/usr/bin/env python3
"""Writes the golden files beside this script, from FORMAT.md alone (no code of hiprt).

float.bvh, planes.bvh (version 1.0), half.bvh and quantized.bvh (1.1) hold four leaves in a row along x. Leaf i is the
unit square from (2i, 0, 0) to (2i + 1, 1, 0): v0 = (2i, 0, 0), v1 = (2i + 1, 0, 0), v2 = (2i, 1, 0),
v3 = (2i + 1, 1, 0). Leaf 2 has only one triangle, so there v3 = v2.

Geometry 0 has 6 triangles: 0 and 1 in leaf 0, 2 and 3 in leaf 1, 5 in leaf 2; 4 is dropped. Geometry 1, with mask 2,
has 2 triangles in leaf 3: 1, with its corners rotated by 1, and 0, rotated by 2.

    node 0: slot 0 = run of leaves 0 and 1, slot 2 = node 1      (slots 1 and 3 absent)
    node 1: slot 1 = leaf 2, slot 3 = leaf 3                     (slots 0 and 2 absent)

custom.bvh (1.1, layout kPlanes) holds a mesh of two triangles in leaf 0 (the square 0), and a custom geometry of type 7
with 6 primitives: 0 and 1 in leaf 1, 3 in leaf 2, 5 and 4 in leaf 3; 2 is dropped.

    node 0: slot 0 = node 1, slot 2 = run of leaves 2 and 3      (slots 1 and 3 absent)
    node 1: slot 1 = leaf 0, slot 3 = leaf 1                     (slots 0 and 2 absent)
"""
import ctypes
import math
import pathlib
import struct

NONE = 0xFFFFFFFF
INF = float("inf")
EMPTY = (INF, INF, INF, -INF, -INF, -INF)
ABSENT = (NONE, EMPTY, 0)
PROVENANCE = '{"tool": "make_golden.py", "note": "gr\u00fc\u00dfe"}'.encode()
FLOAT, PLANES, HALF, QUANTIZED = 1, 2, 3, 4
NODES_AT = 384
EXPONENT = (124, 123, 124)  # of quantized nodes: scales 1/8, 1/16, 1/8


def node_size(layout):
    return 128 if layout in (FLOAT, PLANES) else 64


def node_ref(layout, i):
    return (NODES_AT + node_size(layout) * i) // 64 << 3 | (4 if layout == HALF else 5)


def leaf_ref(layout, i, custom=False):
    return (NODES_AT + 2 * node_size(layout) + 64 * i) // 64 << 3 | (7 if custom else 0)


def row_box(first, last):
    """The box of leaves first to last."""
    return (2 * first, 0, 0, 2 * last + 1, 1, 0)


def node(layout, children):
    """children: four of (reference, box, flags)."""
    refs = struct.pack("<4I", *(ref for ref, _, _ in children))
    flags = bytes(flag for _, _, flag in children)
    planes = [(axis, side, c) for axis in range(3) for side in range(2) for c in range(4)]
    if layout == FLOAT:
        return refs + b"".join(struct.pack("<6f", *box) for _, box, _ in children) + flags + bytes(12)
    if layout == PLANES:
        values = (struct.pack("<f", children[c][1][3 * side + axis]) for axis, side, c in planes)
        return refs + b"".join(values) + flags + bytes(12)
    if layout == HALF:
        return refs + b"".join(struct.pack("<6e", *box) for _, box, _ in children)
    origin = [math.floor(min(box[axis] for _, box, _ in children)) - 1 for axis in range(3)]
    present = sum(1 << c for c in range(4) if children[c][0] != NONE)

    def plane(axis, side, c):
        if children[c][0] == NONE:
            return 255 if side == 0 else 0
        q = (children[c][1][3 * side + axis] - origin[axis]) * 2 ** (127 - EXPONENT[axis])
        assert q == int(q)
        return int(q)

    return (struct.pack("<3f", *origin) + bytes(EXPONENT) + bytes([present]) + refs +
            bytes(plane(*where) for where in planes) + flags + bytes(4))


def leaf(layout, vertices, primitives, geometry, last, ids):
    if layout in (FLOAT, HALF):
        points = b"".join(struct.pack("<3f", *v) for v in vertices)
    else:
        points = b"".join(struct.pack("<4f", *(v[axis] for v in vertices)) for axis in range(3))
    return points + leaf_info(primitives, geometry, last, ids)


def custom_leaf(boxes, primitives, last):
    ids = [0 if primitive == NONE else 0xC0 for primitive in primitives]
    return b"".join(struct.pack("<6f", *box) for box in boxes) + leaf_info(primitives, 1, last, ids)


def leaf_info(primitives, geometry, last, ids):
    return struct.pack("<3I", *primitives, geometry | (0x80000000 if last else 0)) + bytes([*ids, 0, 0])


def square(i, triangles=2):
    x = 2 * i
    v = [(x, 0, 0), (x + 1, 0, 0), (x, 1, 0), (x + 1, 1, 0)]
    return v if triangles == 2 else v[:3] + v[2:3]


def geometry_record(first, count, dropped, mask=NONE, flags=0):
    return struct.pack("<3Q2I", first, count, dropped, mask, flags)


def row_file(layout, minor):
    nodes = node(layout, [(leaf_ref(layout, 0), row_box(0, 1), 5), ABSENT,
                          (node_ref(layout, 1), row_box(2, 3), 5), ABSENT])
    nodes += node(layout, [ABSENT, (leaf_ref(layout, 2), (4, 0, 0, 5, 1, 0), 5),
                           ABSENT, (leaf_ref(layout, 3), row_box(3, 3), 5)])
    leaves = leaf(layout, square(0), (0, 1), 0, False, (0x89, 0x89))
    leaves += leaf(layout, square(1), (2, 3), 0, True, (0x89, 0x89))
    leaves += leaf(layout, square(2, 1), (5, NONE), 0, True, (0x89, 0))
    leaves += leaf(layout, square(3), (1, 0), 1, True, (0x84, 0x82))
    primitive_map = struct.pack("<8I", 0, 1, 2, 3, NONE, 4, 7, 6)
    geometries = geometry_record(0, 6, 1) + geometry_record(6, 2, 0, mask=2)
    sections = [(1, 1, nodes, node_size(layout)), (2, 1, leaves, 64), (3, 1, primitive_map, 4), (4, 1, geometries, 32),
                (5, 0, PROVENANCE, 1)]
    return assemble(layout, minor, 1 | 2, row_box(0, 3), sections)


def custom_file():
    layout = PLANES
    near, far = (2, 0, 0, 3.5, 1.5, 1), (4, 0, 0, 7, 1, 1)
    nodes = node(layout, [(node_ref(layout, 1), (0, 0, 0, 3.5, 1.5, 1), 1), ABSENT,
                          (leaf_ref(layout, 2, True), far, 9), ABSENT])
    nodes += node(layout, [ABSENT, (leaf_ref(layout, 0), row_box(0, 0), 5),
                           ABSENT, (leaf_ref(layout, 1, True), near, 9)])
    leaves = leaf(layout, square(0), (0, 1), 0, True, (0x89, 0x89))
    leaves += custom_leaf([(2, 0, 0, 3, 1, 1), (2.5, 0.5, 0, 3.5, 1.5, 1)], (0, 1), True)
    leaves += custom_leaf([(4, 0, 0, 5, 1, 1), EMPTY], (3, NONE), False)
    leaves += custom_leaf([(6, 0, 0, 7, 1, 1), (6, 0, 0, 6, 0, 0)], (5, 4), True)
    primitive_map = struct.pack("<8I", 0, 1, 2, 3, NONE, 4, 7, 6)
    geometries = geometry_record(0, 2, 0) + geometry_record(2, 6, 1, flags=1 | 7 << 8)
    sections = [(1, 1, nodes, 128), (2, 1, leaves, 64), (3, 1, primitive_map, 4), (4, 1, geometries, 32)]
    return assemble(layout, 1, 1 | 8, (0, 0, 0, 7, 1.5, 1), sections)


def assemble(layout, minor, features, bounds, sections):
    """Both scenes have a root node 0, a stack bound of 2, 2 geometries and 8 primitives."""
    table, body, offset = b"", b"", NODES_AT
    for i, (kind, flags, content, stride) in enumerate(sections):
        table += struct.pack("<2I3Q", kind, flags, offset, len(content) // stride, stride)
        content += bytes(-len(content) % 128 if i + 1 < len(sections) else 0)
        body += content
        offset += len(content)
    head = struct.pack("<8s2HIQQ", b"HIPRTBVH", 1, minor, layout, features, offset)
    tail = struct.pack("<4I6fQ5Q", len(sections), node_ref(layout, 0), 2, 2, *bounds, 8, 0, 0, 0, 0, 0)
    tail += table + bytes(NODES_AT - 128 - len(table)) + body
    return head + struct.pack("<Q", xxh3(head + tail)) + tail


def xxh3(data):
    library = ctypes.CDLL("libxxhash.so.0")
    library.XXH3_64bits.restype = ctypes.c_uint64
    library.XXH3_64bits.argtypes = [ctypes.c_char_p, ctypes.c_size_t]
    return library.XXH3_64bits(data, len(data))


if __name__ == "__main__":
    folder = pathlib.Path(__file__).parent
    versions = ((FLOAT, "float", 0), (PLANES, "planes", 0), (HALF, "half", 1), (QUANTIZED, "quantized", 1))
    for layout, name, minor in versions:
        (folder / f"{name}.bvh").write_bytes(row_file(layout, minor))
    (folder / "custom.bvh").write_bytes(custom_file())
