#!/usr/bin/env python3
"""test_read_bvh.py BVHINFO: FORMAT.md is enough to read BVH files.

read_bvh.py, which was written from the pages of the format alone, reads the files of all versions beside this script.
Every node, leaf, triangle, custom primitive and instance must be what bvhinfo --dump says, bit for bit; so must those
of the objects in scenes. Exits with 77 without numpy.
"""

import collections
import json
import subprocess
import sys
import tempfile
from pathlib import Path

try:
    import numpy as np
except ImportError:
    print("SKIPPED: no numpy (Debian: python3-numpy)")
    sys.exit(77)

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent.parent / "examples"))
import read_bvh  # noqa: E402

LAYOUTS = {"float": 1, "planes": 2, "half": 3, "quantized": 4}
FEATURES = ["triangles", "masks", "split references", "custom primitives", "instances", "motion", "moving boxes",
            "widened boxes"]
compared = collections.Counter()


def check(found, expected, what):
    """Equal numbers and shapes; floats of JSON have the digits of doubles."""
    found, expected = np.asarray(found), np.asarray(expected)
    same = found.shape == expected.shape and np.array_equal(found, expected.astype(found.dtype))
    assert same, f"{what}: read_bvh.py has\n{found}\nbvhinfo has\n{expected}"


def check_node(bvh, record, what):
    node = record["node"]
    present = [slot for slot in range(4) if bvh.child[node][slot] != read_bvh.NONE]
    check(bvh.child[node][present], [child["ref"] for child in record["children"]], what)
    check(bvh.box[node][present], [[child["min"], child["max"]] for child in record["children"]], what)
    start = {4: "kNodes", 5: "kNodes", 0: "kLeaves", 7: "kLeaves"}
    for child in record["children"]:
        # A reference is an offset in the file, and a type.
        name = start[child["ref"] & 7]
        array = bvh.sections[name]
        offset = (child["ref"] >> 3) * 64 - bvh.offset_of[name]
        index = offset // array.itemsize
        if name == "kNodes" and bvh.has_gaps:
            index = offset // (64 * 128 + 64) * 64 + offset % (64 * 128 + 64) // 128
        check(index, child["node" if name == "kNodes" else "leaf"], what)
    compared["nodes"] += 1


def check_leaf(bvh, record, triangles, customs, what):
    leaf = record["leaf"]
    check(bvh.geometry[leaf], record["geometry"], what)
    check(bvh.last_in_run[leaf], record["last"], what)
    for triangle in record.get("triangles", []):
        geometry, primitive, corners = next(triangles)
        check((geometry, primitive), (record["geometry"], triangle["primitive"]), what)
        check(corners, triangle["corners"], what)
        compared["triangles"] += 1
    if "triangles" not in record:
        number, primitives, boxes = next(customs)
        check(number, leaf, what)
        for i, custom in enumerate(record.get("customs", [])):
            check(primitives[i], custom["primitive"], what)
            check(boxes[i], [custom["min"], custom["max"]], what)
            compared["custom primitives"] += 1
        if "instance" in record:
            check(primitives, [record["instance"], record["enters"]], what)
            states = [record] if "min" in record else [record["begin"], record["end"]]
            check(boxes[: len(states)], [[state["min"], state["max"]] for state in states], what)
    compared["leaves"] += 1


def check_instance(bvh, record, what):
    found = bvh.sections["kInstances"][record["record"]]
    for name in ("linear", "translation", "object", "mask", "id", "flags"):
        check(found[name], record[name], f"{what}: {name}")
    compared["instances"] += 1


def check_header(bvh, info, what):
    check(bvh.header["version"], info["version"], what)
    check(bvh.layout, LAYOUTS[info["layout"]], what)
    check([name for bit, name in enumerate(FEATURES) if int(bvh.header["features"]) >> bit & 1], info["features"], what)
    check(bvh.header["stack_bound"], info["stack_bound"], what)
    if info["bounds"]:
        check(bvh.header["bounds"], [info["bounds"]["min"], info["bounds"]["max"]], what)
    check([len(s) for s in bvh.sections.values()], [s["count"] for s in info["sections"]], what)
    for geometry, record in zip(info["geometries"], bvh.sections["kGeometries"]):
        check([record["first_primitive"], record["dropped_count"], record["mask"]],
              [geometry["first_primitive"], geometry["dropped"], geometry["mask"]], what)
        check(record["flags"] >> 8, geometry.get("type", record["flags"] >> 8), what)
    if bvh.sections["kProvenance"].size:
        assert json.loads(bvh.sections["kProvenance"].tobytes()) == info["provenance"], what


def check_file(bvhinfo, path, what):
    bvh = read_bvh.Bvh(path.read_bytes())
    run = lambda *options: subprocess.run([bvhinfo, path, "--json", *options], check=True, capture_output=True).stdout
    info = json.loads(run())
    check_header(bvh, info, what)
    names = {1: "kNodes", 2: "kLeaves"}
    bvh.has_gaps = any(s["kind"] == 1 and s["stride"] != bvh.sections["kNodes"].itemsize for s in info["sections"])
    bvh.offset_of = {names[s["kind"]]: s["offset"] for s in info["sections"] if s["kind"] in names}
    records = [json.loads(line) for line in run("--dump").splitlines()]
    triangles, customs = bvh.triangles(), bvh.customs()
    before = compared.copy()
    for record in records:
        if "record" in record:
            check_instance(bvh, record, what)
        elif "node" in record:
            check_node(bvh, record, what)
        else:
            check_leaf(bvh, record, triangles, customs, what)
    assert next(triangles, None) is None and next(customs, None) is None, f"{what}: more than bvhinfo has"
    assert compared["nodes"] - before["nodes"] == len(bvh.child), what
    assert compared["leaves"] - before["leaves"] == len(bvh.leaves), what
    assert compared["instances"] - before["instances"] == len(bvh.sections.get("kInstances", [])), what
    return bvh


def check_values(bvh, what):
    """Sections that bvhinfo does not print have the numbers of golden_input.h and write_files.cpp."""
    if "kMotionSegments" in bvh.sections:
        segments, motions = bvh.sections["kMotionSegments"], bvh.sections["kMotions"]
        check(motions["kind"][:4], [1, 2, 3, 0], what)
        check(segments["time"][:3], [[0, 1]] * 3, what)
        check(segments["translation"][:3], [[[0, y, 0], [16, y, 0]] for y in (0, 40, 80)], what)
        assert abs(segments["turning"][0][8] - np.pi / 4) < 1e-6, what  # Half of the turn: quaternions.
        assert np.allclose(segments["turning"][2][:9], np.eye(3).ravel()), what
    if "kShapes" in bvh.sections and bvh.sections["kShapes"]["kind"][0] == 3:
        check(bvh.sections["kShapes"]["keys"], [3], what)
        check(bvh.sections["kShapePoints"]["position"][[0, 6, 11]], [[0, 50, 0], [9, 51, 0], [16, 51, 4]], what)
        check(bvh.sections["kCurveSegments"], [0, 1, 2, 0, 2, 3], what)
    elif "kShapes" in bvh.sections:
        check(bvh.sections["kShapes"]["kind"], [1, 2], what)
        check(bvh.sections["kShapePoints"]["position"],
              [[0, 30, 0], [3, 30, 0], [6, 30, 0], [0, 35, 0], [2, 35, 0], [4, 35, 0]], what)
        check(bvh.sections["kShapePoints"]["radius"], [0.5] * 3 + [0.25] * 3, what)
        check(bvh.sections["kCurveSegments"], [0, 1], what)


def main():
    bvhinfo = sys.argv[1]
    files = sorted(HERE.glob("1.*/*.bvh"))
    assert files, "no files beside the script"
    with tempfile.TemporaryDirectory() as folder:
        for path in files:
            what = str(path.relative_to(HERE))
            bvh = check_file(bvhinfo, path, what)
            check_values(bvh, what)
            for number, inner in enumerate(bvh.objects()):
                extracted = Path(folder) / "object.bvh"
                extracted.write_bytes(inner.data)
                if "kInstances" in inner.sections:
                    continue  # A group's instances name objects of the scene: alone it is no whole file.
                check_values(check_file(bvhinfo, extracted, f"{what}, object {number}"), what)
    print(f"{len(files)} files: " + ", ".join(f"{count} {name}" for name, count in compared.items()))
    assert min(compared[name] for name in ("nodes", "triangles", "custom primitives", "instances")) > 0


if __name__ == "__main__":
    main()
