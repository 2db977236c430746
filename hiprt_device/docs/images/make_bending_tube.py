#!/usr/bin/env python3
"""make_bending_tube.py TOOLS OUT.png: a tube whose skin bends by a right angle while the shutter is open. TOOLS is the
folder of bvhbuild and bvhrender."""

import base64
import json
import math
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

RINGS, SIDES = 40, 48


class Gltf:
    """Accessors of one buffer."""

    def __init__(self):
        self.buffer, self.views, self.accessors = b"", [], []

    def add(self, code, component_type, kind, values):
        """Appends the numbers of vectors. Returns the accessor's number."""
        self.buffer += b"\0" * (-len(self.buffer) % 4)
        flat = [x for value in values for x in value]
        data = struct.pack("<%d%s" % (len(flat), code), *flat)
        self.views.append({"buffer": 0, "byteOffset": len(self.buffer), "byteLength": len(data)})
        self.accessors.append({"bufferView": len(self.views) - 1, "componentType": component_type, "type": kind,
                               "count": len(values)})
        self.buffer += data
        return len(self.accessors) - 1

    def floats(self, kind, values):
        return self.add("f", 5126, kind, values)


def tube(file):
    """A primitive: a tube along x, whose vertices have two joints."""
    grid = [(i / RINGS, 2 * math.pi * k / SIDES) for i in range(RINGS + 1) for k in range(SIDES)]
    positions = [(4 * s - 2, 0.4 * math.cos(a), 0.4 * math.sin(a)) for s, a in grid]
    second = [min(max((p[0] + 0.6) / 1.2, 0), 1) for p in positions]
    corners = []
    for i in range(RINGS):
        for k in range(SIDES):
            a, b = i * SIDES + k, i * SIDES + (k + 1) % SIDES
            corners += [(a,), (a + SIDES,), (b,), (b,), (a + SIDES,), (b + SIDES,)]
    return {"attributes": {"POSITION": file.floats("VEC3", positions),
                           "NORMAL": file.floats("VEC3", [(0, math.cos(a), math.sin(a)) for _, a in grid]),
                           "JOINTS_0": file.add("B", 5121, "VEC4", [(0, 1, 0, 0)] * len(grid)),
                           "WEIGHTS_0": file.floats("VEC4", [(1 - w, w, 0, 0) for w in second])},
            "indices": file.add("H", 5123, "SCALAR", corners), "material": 0}


def scene():
    file, h = Gltf(), math.sqrt(0.5)
    skin = tube(file)
    floor = {"attributes": {"POSITION": file.floats("VEC3", [(-9, -1, -9), (-9, -1, 9), (9, -1, 9), (9, -1, -9)])},
             "indices": file.add("H", 5123, "SCALAR", [(i,) for i in (0, 1, 2, 0, 2, 3)]), "material": 1}
    samplers = [{"input": file.floats("SCALAR", [(0,), (1,)]),
                 "output": file.floats("VEC4", [(0, 0, 0, 1), (0, 0, h, h)])}]
    colours = [[0.8, 0.2, 0.1, 1], [0.5, 0.5, 0.5, 1]]
    return {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 2, 3]}],
            "nodes": [{"mesh": 0, "skin": 0}, {}, {}, {"mesh": 1}], "skins": [{"joints": [1, 2]}],
            "meshes": [{"primitives": [skin]}, {"primitives": [floor]}],
            "materials": [{"pbrMetallicRoughness": {"baseColorFactor": c, "metallicFactor": 0}} for c in colours],
            "animations": [{"channels": [{"sampler": 0, "target": {"node": 2, "path": "rotation"}}],
                            "samplers": samplers}],
            "bufferViews": file.views, "accessors": file.accessors,
            "buffers": [{"byteLength": len(file.buffer), "uri": "data:application/octet-stream;base64," +
                         base64.b64encode(file.buffer).decode()}]}


def main():
    tools, out = Path(sys.argv[1]), Path(sys.argv[2]).resolve()
    with tempfile.TemporaryDirectory() as name:
        gltf, bvh = Path(name) / "tube.gltf", Path(name) / "tube.bvh"
        gltf.write_text(json.dumps(scene()))
        subprocess.run([tools / "bvhbuild", gltf, "-o", bvh, "--instances", "--shutter", "0,1", "--motion-keys", "9"],
                       check=True)
        subprocess.run([tools / "bvhrender", bvh, "-o", out, "--size", "640x320", "--spp", "512", "--shutter", "0,1",
                        "--integrator", "path", "--materials", gltf, "--camera", "0,1.5,8/0,0.4,0/0,1,0/28"],
                       check=True)


if __name__ == "__main__":
    main()
