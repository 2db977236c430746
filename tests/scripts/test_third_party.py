#!/usr/bin/env python3
"""test_third_party.py ROOT: the table of libraries in SECURITY.md names every package that the tools link, with the
versions that this machine has installed. On other systems than Debian 12 and 13 only the names are compared."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

ROW = re.compile(r"^\| ([^|]+) \| [^|]+ \| ([\d.]+) \| ([\d.]+) \| `([^`]+)` \|$", re.MULTILINE)
RELEASES = ["bookworm", "trixie"]  # the order of the table's columns
# Names that tools/CMakeLists.txt gives find_package() and find_library(), and the libraries of the table.
LIBRARIES = {"CLI11": "CLI11", "Freetype": "FreeType", "nlohmann_json": "JSON for Modern C++", "OpenEXR": "OpenEXR",
             "PNG": "libpng", "TinyGLTF": "tinygltf", "zstd": "Zstandard", "draco": "Draco",
             "meshoptimizer": "meshoptimizer", "MPI": "Open MPI",
             "HIPRT_ASSIMP_LIBRARY": "assimp"}
# Debian's versions and their makers'.
EXAMPLES = {"2.7.0+dfsg-2": "2.7.0", "1:1.2.13.dfsg-1": "1.2.13", "1:1.3.dfsg+really1.3.1-1+deb13u1": "1.3.1",
            "1.5.4+dfsg2-5": "1.5.4", "5.2.5~ds0-1+b1": "5.2.5", "2.4.1+ds-2": "2.4.1",
            "0.0~git20220908.8b5f1f3+ds-1": "0.0", "1.6.39-2+deb12u4": "1.6.39",
            "3.11.3-2.1": "3.11.3", "3.1.12-1+b3": "3.1.12"}


def upstream(version: str) -> str:
    """Without epoch, Debian's revision, and what Debian says of its sources."""
    version = re.sub(r"-[^-]*$", "", version.split(":")[-1])
    return re.sub(r"^.*\+really|~git.*$|[+.]dfsg\d*$|[+~]ds\d*$", "", version)


def installed_version(package: str) -> str:
    """Of the package, or of its successor with 64-bit times; empty if neither is installed."""
    for name in (package, package + "t64"):
        result = subprocess.run(["dpkg-query", "-W", "-f", "${Version}", name], capture_output=True, text=True,
                                check=False)
        if result.stdout:
            return upstream(result.stdout)
    return ""


def release() -> str:
    """The code name of this Debian, or nothing."""
    file = Path("/etc/os-release")
    if not file.exists() or not shutil.which("dpkg-query"):
        return ""
    match = re.search(r"^VERSION_CODENAME=(\w+)$", file.read_text(encoding="utf-8"), re.MULTILINE)
    return match[1] if match else ""


def name_faults(root: Path, names: list[str]) -> list[str]:
    text = (root / "tools/CMakeLists.txt").read_text(encoding="utf-8")
    linked = re.findall(r"^\s*find_(?:package|library)\((\w+)", text, re.MULTILINE)
    faults = [f"SECURITY.md does not name {package}, which tools/CMakeLists.txt finds" for package in linked
              if LIBRARIES.get(package) not in names]
    if sorted(linked) != sorted(LIBRARIES):
        faults.append(f"tools/CMakeLists.txt finds {sorted(linked)}, the test knows {sorted(LIBRARIES)}")
    return faults


def main() -> int:
    root = Path(sys.argv[1])
    rows = ROW.findall((root / "hiprt_device/docs/SECURITY.md").read_text(encoding="utf-8"))
    faults = [f"upstream({version!r}) is {upstream(version)!r}, expected {expected!r}"
              for version, expected in EXAMPLES.items() if upstream(version) != expected]
    faults += name_faults(root, [row[0] for row in rows])
    compared = 0
    if (here := release()) in RELEASES:
        for name, *versions, package in rows:
            stated, installed = versions[RELEASES.index(here)], installed_version(package)
            compared += installed != ""
            if installed not in ("", stated):
                faults.append(f"SECURITY.md: {name} {stated} on {here}, but {package} is {installed}")
        if compared < len(LIBRARIES):
            faults.append(f"only {compared} packages of the table are installed (tools/install-packages build)")
    for fault in faults:
        print(fault, file=sys.stderr)
    print(f"{len(rows)} libraries, {compared} versions compared")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
