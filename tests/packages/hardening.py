#!/usr/bin/env python3
"""hardening.py FILE...: programs and shared libraries are hardened. Files are ELF files, .deb or .tar.gz packages.

Looked for, with readelf of binutils:
  PIE             a program is position-independent
  RELRO, BIND_NOW the linker's tables are read-only when the program starts
  stack           no executable stack
  protector       functions with arrays check the stack's end (__stack_chk_fail)
  fortify         one of the C library's checking functions is called (__memcpy_chk and so on), in at least one file
                  of a package: a file may have no call that needs one

Exit status: 0, 1 with the faults, 2 without an ELF file.
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

# Libraries of others that the archive carries: their makers chose the flags.
OURS = re.compile(r"^(bvh\w+|libhiprt.*|test_\w+)$")


def readelf(path: Path, *options: str) -> str:
    return subprocess.run(["readelf", "-W", *options, path], capture_output=True, text=True, check=True).stdout


def faults_of(path: Path) -> list[str]:
    header, segments, dynamic = readelf(path, "-h"), readelf(path, "-l"), readelf(path, "-d")
    faults = []
    if "INTERP" in segments and not re.search(r"Type:\s+DYN", header):
        faults.append("no PIE")
    if "GNU_RELRO" not in segments:
        faults.append("no RELRO")
    if not re.search(r"BIND_NOW|FLAGS_1\).*\bNOW\b", dynamic):
        faults.append("no BIND_NOW")
    if re.search(r"GNU_STACK.*\bRWE\b", segments):
        faults.append("an executable stack")
    if "__stack_chk_fail" not in readelf(path, "--dyn-syms"):
        faults.append("no stack protector")
    return faults


def is_fortified(path: Path) -> bool:
    return re.search(r"\b__\w+_chk\b", readelf(path, "--dyn-syms").replace("__stack_chk_fail", "")) is not None


def is_elf(path: Path) -> bool:
    if path.is_symlink() or not path.is_file():
        return False
    with path.open("rb") as file:
        start = file.read(18)
    return start[:4] == b"\x7fELF" and start[16] in (2, 3)  # programs and shared libraries


def unpack(package: Path, folder: Path) -> None:
    command = ["dpkg-deb", "-x", package, folder] if package.suffix == ".deb" else ["tar", "-xf", package, "-C", folder]
    subprocess.run(command, check=True)


def check(name: str, files: list[Path]) -> bool:
    """Prints the faults of a package's files. @return whether there are none."""
    faults = [f"{name}: {file.name}: {fault}" for file in files for fault in faults_of(file)]
    if files and not any(is_fortified(file) for file in files):
        faults.append(f"{name}: no call of a fortified function (_FORTIFY_SOURCE)")
    for fault in faults:
        print(fault, file=sys.stderr)
    return not faults


def elf_files(folder: Path) -> list[Path]:
    return sorted(file for file in folder.rglob("*") if OURS.match(file.name) and is_elf(file))


def main() -> int:
    count, good = 0, True
    for argument in sys.argv[1:]:
        path = Path(argument)
        with tempfile.TemporaryDirectory() as name:
            files = [path]
            if not is_elf(path):
                unpack(path, Path(name))
                files = elf_files(Path(name))
            count += len(files)
            good = check(path.name, files) and good
    if count == 0:
        print("hardening.py: no program and no shared library in these files", file=sys.stderr)
        return 2
    print(f"hardened: {count} programs and libraries" if good else "not hardened")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
