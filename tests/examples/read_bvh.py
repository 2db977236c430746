#!/usr/bin/env python3
"""Reads BVH files with numpy, from what FORMAT.md says. Big-endian machines can read them, too.

    bvh = read_bvh.Bvh(open("scene.bvh", "rb").read())
    bvh.child, bvh.box                  # per node: references, and boxes as [node, slot, min or max, axis]
    for geometry, primitive, corners in bvh.triangles(): ...
    bvh.sections["kInstances"], bvh.objects()

It trusts the file; the library's validate() checks files of unknown origin.
"""
import numpy as np

NONE, HALF, QUANTIZED = 0xFFFFFFFF, 3, 4
HEADER = np.dtype([("magic", "S8"), ("version", "<u2", 2), ("layout", "<u4"), ("features", "<u8"), ("byte_size", "<u8"),
                   ("checksum", "<u8"), ("section_count", "<u4"), ("root", "<u4"), ("stack_bound", "<u4"),
                   ("geometry_count", "<u4"), ("bounds", "<f4", (2, 3)), ("primitive_count", "<u8"), ("levels", "<u4"),
                   ("condition", "<f4"), ("reach", "<f4"), ("shutter", "<f4", 2), ("reserved", "<u4", 5)])
SECTION = np.dtype([("kind", "<u4"), ("flags", "<u4"), ("offset", "<u8"), ("count", "<u8"), ("stride", "<u8")])
TAIL = [("child_flags", "<u4"), ("reserved", "<u4", 3)]
NODES = [np.dtype([("child", "<u4", 4), ("box", "<f4", (4, 2, 3))] + TAIL),  # kFloat
         np.dtype([("child", "<u4", 4), ("plane", "<f4", (3, 2, 4))] + TAIL),  # kPlanes
         np.dtype([("child", "<u4", 4), ("box", "<f2", (4, 2, 3))]),  # kHalf
         np.dtype([("origin", "<f4", 3), ("exponent", "u1", 3), ("children", "u1"), ("child", "<u4", 4),
                   ("plane", "u1", (3, 2, 4)), ("child_flags", "<u4"), ("reserved", "<u4")])]  # kQuantized
LEAF = np.dtype([("body", "<f4", 12), ("primitive", "<u4", 2), ("geometry_and_flags", "<u4"), ("ids", "u1", 4)])
KINDS = {2: ("kLeaves", LEAF), 3: ("kPrimitiveMap", "<u4"), 5: ("kProvenance", "u1"), 8: ("kObjectFiles", "u1"),
         13: ("kCurveSegments", "<u4"), 14: ("kObjectShapes", "<u8"),
         4: ("kGeometries", [("first_primitive", "<u8"), ("primitive_count", "<u8"), ("dropped_count", "<u8"),
                             ("mask", "<u4"), ("flags", "<u4")]),
         6: ("kInstances", [("linear", "<f4", (3, 3)), ("translation", "<f4", 3), ("object", "<u4"), ("mask", "<u4"),
                            ("id", "<u4"), ("flags", "<u4")]),
         7: ("kObjects", [("offset", "<u8"), ("size", "<u8"), ("geometries", "<u8"), ("instances", "<u8"),
                          ("features", "<u8"), ("bounds", "<f4", (2, 3)), ("root", "<u4"), ("condition", "<f4"),
                          ("reach", "<f4"), ("stack_bound", "<u4"), ("levels", "<u4"), ("reserved", "<u4"),
                          ("motions", "<u8")]),
         9: ("kMotions", [("segments", "<u8"), ("count", "<u4"), ("kind", "<u4"), ("rounding", "<f4"),
                          ("farthest", "<f4"), ("reserved", "<u4", 2)]),
         10: ("kMotionSegments", [("time", "<f4", 2), ("translation", "<f4", (2, 3)), ("turning", "<f4", 21),
                                  ("reserved", "<u4", 3)]),
         11: ("kShapes", [("points", "<u8"), ("segments", "<u8"), ("point_count", "<u4"), ("kind", "<u4"),
                          ("keys", "<u4"), ("reserved", "<u4")]),
         12: ("kShapePoints", [("position", "<f4", 3), ("radius", "<f4")])}


class Bvh:
    def __init__(self, data):
        self.data = data
        self.header = np.frombuffer(data, HEADER, 1)[0]
        version = self.header["version"]
        if self.header["magic"] != b"HIPRTBVH" or version[0] != 1 or len(data) != self.header["byte_size"]:
            raise ValueError("not a whole BVH file of version 1")
        self.layout = int(self.header["layout"])
        self.sections = {}
        for entry in np.frombuffer(data, SECTION, self.header["section_count"], HEADER.itemsize):
            name, record = ("kNodes", NODES[self.layout - 1]) if entry["kind"] == 1 else KINDS.get(
                int(entry["kind"]), (None, None))
            if name:  # Unknown kinds are skipped; those with flag bit 0 would be an error.
                self.sections[name] = self._records(record, entry)
            elif entry["flags"] & 1:
                raise ValueError(f"section kind {entry['kind']} is required and unknown")
        self.leaves = self.sections["kLeaves"]
        self.geometry = self.leaves["geometry_and_flags"] & 0x0FFFFFFF
        self.last_in_run = self.leaves["geometry_and_flags"] >> 31 == 1
        self.custom = self.sections["kGeometries"]["flags"][self.geometry] & 1 == 1
        self.child, self.box = self._nodes(self.sections["kNodes"])

    def _records(self, record, entry):
        record, count, stride = np.dtype(record), int(entry["count"]), int(entry["stride"])
        if stride == record.itemsize:
            return np.frombuffer(self.data, record, count, int(entry["offset"]))
        # Nodes of 128 bytes: after every 64 of them a stride of 64 bytes is unused.
        number = np.arange(count // 129 * 64 + count % 129 // 2)
        units = np.frombuffer(self.data, ("V", stride), count, int(entry["offset"]))
        first = 2 * number + number // 64
        return units[first[:, None] + [0, 1]].view(record)[:, 0]

    def _nodes(self, nodes):
        if self.layout == QUANTIZED:
            scale = np.ldexp(np.float32(1), nodes["exponent"].astype(int) - 127)
            box = nodes["origin"][:, :, None, None] + nodes["plane"] * scale[:, :, None, None]
        else:
            box = nodes["box" if "box" in nodes.dtype.names else "plane"].astype(np.float32)
        if "plane" in nodes.dtype.names:
            box = box.transpose(0, 3, 2, 1)
        if self.layout == HALF:  # Infinite planes of children that are there.
            infinite = np.isinf(box) & (nodes["child"] != NONE)[:, :, None, None]
            box = np.where(infinite, self.header["bounds"], box)
        return nodes["child"], box.astype(np.float32)

    def triangles(self):
        """(geometry, primitive, its corners in the mesh's order) of each triangle in each leaf."""
        for i in np.flatnonzero(~self.custom):
            body = self.leaves["body"][i]
            vertex = body.reshape(4, 3) if self.layout in (1, HALF) else body.reshape(3, 4).T
            for which, stored in enumerate([(0, 1, 2), (1, 3, 2)]):
                if self.leaves["primitive"][i][which] != NONE:
                    u, v = self.leaves["ids"][i][which] & 3, self.leaves["ids"][i][which] >> 2 & 3
                    corners = [stored[3 - int(u) - int(v)], stored[u], stored[v]]
                    yield int(self.geometry[i]), int(self.leaves["primitive"][i][which]), vertex[corners]

    def customs(self):
        """(leaf, the two numbers in it, their boxes) of each custom leaf; of instances see FORMAT_INSTANCES.md."""
        for i in np.flatnonzero(self.custom):
            yield int(i), self.leaves["primitive"][i], self.leaves["body"][i].reshape(2, 2, 3)

    def objects(self):
        """The BVHs of the objects of a scene of instances."""
        records = self.sections.get("kObjects", [])
        return [Bvh(self.data[int(o["offset"]):int(o["offset"] + o["size"])]) for o in records]
