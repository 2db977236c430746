#!/usr/bin/env python3
"""make_spinning_wheel.py TOOLS OUT.png: two wheels that make a third of a turn while the shutter is open, the left one
between matrices, the right one by its rotation. TOOLS is the folder of bvhbuild and bvhrender."""

import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

SPOKES, RIM_STEPS, TUBE_STEPS = 5, 96, 12


def wheel():
    """Vertices and faces of a rim in the plane z = 0, radius 1, with spokes and a hub."""
    vertices, faces = [], []

    def grid(point, columns, rows):
        """A closed strip of quads: point(i, k) on a torus-like surface of columns x rows."""
        first = len(vertices)
        vertices.extend(point(i, k) for i in range(columns) for k in range(rows))
        for i in range(columns):
            for k in range(rows):
                j, m = (i + 1) % columns, (k + 1) % rows
                faces.append([first + a * rows + b for a, b in ((i, k), (j, k), (j, m), (i, m))])

    def torus(radius, tube):
        def point(i, k):
            a, b = 2 * math.pi * i / RIM_STEPS, 2 * math.pi * k / TUBE_STEPS
            r = radius + tube * math.cos(b)
            return (r * math.cos(a), r * math.sin(a), tube * math.sin(b))
        grid(point, RIM_STEPS, TUBE_STEPS)

    torus(1.0, 0.07)
    torus(0.12, 0.06)
    for spoke in range(SPOKES):
        a = 2 * math.pi * spoke / SPOKES
        c, s, width = math.cos(a), math.sin(a), 0.035
        corners = [(x, y, z) for x in (0.12, 1.0) for y in (-width, width) for z in (-width, width)]
        first = len(vertices)
        vertices.extend((c * x - s * y, s * x + c * y, z) for x, y, z in corners)
        faces.extend([first + i for i in f] for f in ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6),
                                                      (0, 2, 6, 4), (1, 5, 7, 3)))
    return vertices, faces


def key(time, degrees, x):
    return {"time": time, "translate": [x, 0, 0], "rotate": {"axis": [0, 0, 1], "degrees": degrees}}


def main():
    tools, out = Path(sys.argv[1]), Path(sys.argv[2]).resolve()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        vertices, faces = wheel()
        text = "".join("v %.7g %.7g %.7g\n" % v for v in vertices)
        text += "".join("f " + " ".join(str(i + 1) for i in f) + "\n" for f in faces)
        (folder / "wheel.obj").write_text(text)
        wheels = [{"object": "wheel", "motion": {"interpolation": how, "keys": [key(0, 0, x), key(1, 120, x)]}}
                  for how, x in (("matrix", -1.25), ("slerp", 1.25))]
        (folder / "wheels.json").write_text(json.dumps(
            {"format": "hiprt scene", "version": 1, "objects": {"wheel": ["wheel.obj"]}, "groups": {"wheels": wheels},
             "scene": "wheels"}))
        subprocess.run([tools / "bvhbuild", folder / "wheels.json", "-o", folder / "wheels.bvh"], check=True)
        subprocess.run([tools / "bvhrender", folder / "wheels.bvh", "-o", out, "--size", "800x400", "--spp", "256",
                        "--shutter", "0,1", "--mode", "primary", "--camera", "0,0,6.4/0,0,0/0,1,0/24"], check=True)


if __name__ == "__main__":
    main()
