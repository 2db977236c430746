#!/usr/bin/env python3
"""What safety costs.

flags    speed of rays on one thread, without and with the flags that harden packages (cmake/packages/make.sh). The
         scene is 60,000 random triangles. Two programs run in turn, six times each. The table has the best run of
         each, and in parentheses the worst one as a measure of the noise
reading  seconds to read a file of 1 GiB in the page cache, and to map it and touch its pages; the best of three
"""

import argparse
import random
import re
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
RUNS = 6
TRIANGLES = 60_000


def flags(name: str) -> list[str]:
    text = (ROOT / "cmake/packages/make.sh").read_text(encoding="utf-8")
    match = re.search(rf'^{name}="(.*)"$', text, re.MULTILINE)
    if not match:
        sys.exit(f"compare.py: cmake/packages/make.sh has no line {name}=\"...\"")
    return match[1].split()


def compile_program(build: Path, source: str, options: list[str], program: Path) -> None:
    subprocess.run(["g++", "-std=c++20", "-O3", "-DNDEBUG", "-march=x86-64-v3", "-ffp-contract=off",
                    "-DHIPRT_BUILD_STATIC", f"-I{ROOT}", ROOT / "benchmarks/safety" / source,
                    build / "hiprt_build/format/libhiprt_format.a", *options, "-pthread", "-o", program], check=True)


def make_scene(build: Path, folder: Path) -> Path:
    values = random.Random(34)
    positions = []
    for _ in range(TRIANGLES):
        corner = [100 * values.random() for _ in range(3)]
        positions += [c + 2 * values.random() for _ in range(3) for c in corner]
    mesh, scene = folder / "a.mesh", folder / "a.bvh"
    mesh.write_bytes(struct.pack("<II", 3 * TRIANGLES, TRIANGLES) + struct.pack(f"<{len(positions)}f", *positions) +
                     struct.pack(f"<{3 * TRIANGLES}I", *range(3 * TRIANGLES)))
    subprocess.run([build / "tools/bvhbuild", mesh, "-o", scene], capture_output=True, check=True)
    return scene


def compare_flags(build: Path, folder: Path) -> None:
    scene = make_scene(build, folder)
    programs = {"plain": folder / "plain", "hardened": folder / "hardened"}
    compile_program(build, "rays.cpp", ["-fno-pie", "-no-pie"], programs["plain"])
    hardening = ["-fPIE", "-pie", *flags("hardening"), *flags("hardening_link")]
    compile_program(build, "rays.cpp", hardening, programs["hardened"])
    results: dict[str, list[list[float]]] = {kind: [] for kind in programs}
    for _ in range(RUNS):
        for kind, program in programs.items():
            run = subprocess.run([program, scene], capture_output=True, text=True, check=True)
            results[kind].append([float(word) for word in run.stdout.split()])
    if results["plain"][0][2] != results["hardened"][0][2]:
        sys.exit("compare.py: the programs found different hits")
    print(f"{'million rays/s':16}{'closest hit':>20}{'any hit':>20}")
    for kind, runs in results.items():
        cells = [f"{max(column):.3f} ({min(column):.3f})" for column in list(zip(*runs))[:2]]
        print(f"{kind:16}{cells[0]:>20}{cells[1]:>20}")


def compare_reading(build: Path, folder: Path) -> None:
    program, file = folder / "reading", folder / "file"
    compile_program(build, "reading.cpp", [], program)
    block = random.Random(34).randbytes(1 << 20)
    with file.open("wb") as out:
        for _ in range(1024):
            out.write(block)
    subprocess.run([program, file], check=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["flags", "reading"])
    parser.add_argument("build", type=Path, metavar="BUILD", help="build folder with bvhbuild and hiprt_format")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        {"flags": compare_flags, "reading": compare_reading}[arguments.what](arguments.build, Path(name))
    return 0


if __name__ == "__main__":
    sys.exit(main())
