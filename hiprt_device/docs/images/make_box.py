#!/usr/bin/env python3
"""make_box.py TOOLS OUT.png [SAMPLES [FLAG...]]: renders a box by the path tracer.

The box has a lamp, a metal and a glossy ball, a checked floor and an alpha cut-out. TOOLS is the folder of
bvhbuild and bvhrender; flags are bvhrender's."""

import base64
import json
import math
import struct
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path


def png(size, pixel):
    """A picture of size x size pixels; pixel(x, y) is (red, green, blue, alpha)."""
    rows = b"".join(b"\0" + bytes(c for x in range(size) for c in pixel(x, y)) for y in range(size))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", size, size, 8, 6, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def data_uri(kind, data):
    return f"data:{kind};base64," + base64.b64encode(data).decode()


class Gltf:
    """A document with one buffer."""

    def __init__(self):
        self.buffer = b""
        self.views, self.accessors, self.meshes = [], [], []

    def accessor(self, code, component, kind, values):
        data = struct.pack(f"<{len(values)}{code}", *values)
        self.views.append({"buffer": 0, "byteOffset": len(self.buffer), "byteLength": len(data)})
        self.buffer += data + b"\0" * (-len(data) % 4)
        count = len(values) // {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[kind]
        self.accessors.append(
            {"bufferView": len(self.views) - 1, "componentType": component, "count": count, "type": kind}
        )
        return len(self.accessors) - 1

    def mesh(self, material, positions, indices, **attributes):
        attributes = {name: self.accessor("f", 5126, kind, values) for name, (kind, values) in attributes.items()}
        attributes["POSITION"] = self.accessor("f", 5126, "VEC3", positions)
        indices = self.accessor("H", 5123, "SCALAR", indices)
        self.meshes.append(
            {"primitives": [{"attributes": attributes, "indices": indices, "material": material}]}
        )

    def quad(self, material, *corners):
        positions = [x for corner in corners for x in corner]
        self.mesh(material, positions, [0, 1, 2, 0, 2, 3], TEXCOORD_0=("VEC2", [0, 1, 1, 1, 1, 0, 0, 0]))

    def ball(self, material, centre, radius, steps=48):
        normals, indices, columns = [], [], 2 * steps + 1
        for j in range(steps + 1):
            for k in range(columns):
                down, around = math.pi * j / steps, math.pi * k / steps
                normals += [math.sin(down) * math.cos(around), math.cos(down), math.sin(down) * math.sin(around)]
        for j in range(steps):
            for k in range(2 * steps):
                a, b = j * columns + k, (j + 1) * columns + k
                indices += [a, b, a + 1, a + 1, b, b + 1]
        positions = [centre[i % 3] + radius * n for i, n in enumerate(normals)]
        self.mesh(material, positions, indices, NORMAL=("VEC3", normals))

    def document(self, materials, pictures):
        images = [{"uri": data_uri("image/png", picture)} for picture in pictures]
        return {
            "asset": {"version": "2.0"},
            "extensionsUsed": ["KHR_materials_emissive_strength"],
            "scenes": [{"nodes": list(range(len(self.meshes)))}],
            "nodes": [{"mesh": i} for i in range(len(self.meshes))],
            "meshes": self.meshes,
            "materials": materials,
            "textures": [{"source": i} for i in range(len(images))],
            "images": images,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [
                {"byteLength": len(self.buffer), "uri": data_uri("application/octet-stream", self.buffer)}
            ],
        }


def surface(color, metallic=0, roughness=1, **more):
    return {
        "pbrMetallicRoughness": {
            "baseColorFactor": [*color, 1],
            "metallicFactor": metallic,
            "roughnessFactor": roughness,
            **more,
        }
    }


def box():
    white, red, green, lamp, metal, glossy, card, floor = range(8)
    scene = Gltf()
    scene.quad(floor, (-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1))
    scene.quad(white, (-1, 2, -1), (1, 2, -1), (1, 2, 1), (-1, 2, 1))
    scene.quad(white, (-1, 0, -1), (1, 0, -1), (1, 2, -1), (-1, 2, -1))
    scene.quad(red, (-1, 0, 1), (-1, 0, -1), (-1, 2, -1), (-1, 2, 1))
    scene.quad(green, (1, 0, -1), (1, 0, 1), (1, 2, 1), (1, 2, -1))
    scene.quad(lamp, (-0.3, 1.98, -0.3), (0.3, 1.98, -0.3), (0.3, 1.98, 0.3), (-0.3, 1.98, 0.3))
    scene.quad(card, (-0.2, 0.1, 0.75), (0.35, 0.1, 0.75), (0.35, 0.65, 0.75), (-0.2, 0.65, 0.75))
    scene.ball(metal, (-0.45, 0.4, -0.35), 0.4)
    scene.ball(glossy, (0.45, 0.3, 0.2), 0.3)
    materials = [
        surface((0.73, 0.73, 0.73)),
        surface((0.65, 0.05, 0.05)),
        surface((0.12, 0.45, 0.15)),
        {
            **surface((0, 0, 0)),
            "emissiveFactor": [1, 0.85, 0.6],
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 15}},
        },
        surface((0.95, 0.8, 0.5), metallic=1, roughness=0.2),
        surface((0.1, 0.2, 0.6), roughness=0.15),
        {**surface((1, 1, 1), roughness=0.9, baseColorTexture={"index": 0}), "alphaMode": "MASK", "alphaCutoff": 0.5},
        surface((1, 1, 1), roughness=0.6, baseColorTexture={"index": 1}),
    ]
    holes = png(64, lambda x, y: (40, 160, 60, 255 if (x // 8 + y // 8) % 2 == 0 else 0))
    checks = png(32, lambda x, y: (200, 190, 170, 255) if (x // 4 + y // 4) % 2 == 0 else (90, 80, 70, 255))
    return scene.document(materials, [holes, checks])


def main(tools, out, samples="1024", *flags):
    with tempfile.TemporaryDirectory() as folder:
        gltf, bvh = Path(folder, "box.gltf"), Path(folder, "box.bvh")
        gltf.write_text(json.dumps(box()), encoding="ascii")
        subprocess.run([Path(tools, "bvhbuild"), gltf, "-o", bvh], check=True)
        command = [Path(tools, "bvhrender"), bvh, "-o", out, "--integrator", "path", "--materials", gltf]
        view = ["--camera", "0,1,4.6/0,1,0/0,1,0/30", "--size", "480x480", "--spp", samples]
        subprocess.run([*command, *view, *flags], check=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
