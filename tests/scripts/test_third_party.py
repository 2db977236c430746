#!/usr/bin/env python3
"""test_third_party.py ROOT: the table of libraries in SECURITY.md names every package that the tools link, with the
versions that this machine has installed. On other releases than Debian 12 only the names are compared."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

ROW = re.compile(r"^\| ([^|]+) \| [^|]+ \| ([\d.]+) \| `([^`]+)` \|$", re.MULTILINE)
# find_package() names of tools/CMakeLists.txt and the libraries of the table.
LIBRARIES = {"CLI11": "CLI11", "Freetype": "FreeType", "nlohmann_json": "JSON for Modern C++", "OpenEXR": "OpenEXR",
             "PNG": "libpng", "TinyGLTF": "tinygltf", "zstd": "Zstandard", "draco": "Draco",
             "meshoptimizer": "meshoptimizer"}


def version_of(package: str) -> str:
    """The upstream version: without epoch, Debian's revision, and what Debian says of its sources."""
    result = subprocess.run(["dpkg-query", "-W", "-f", "${Version}", package], capture_output=True, text=True,
                            check=False)
    return re.sub(r"~git.*$|[+~.]dfsg.*$|\+ds.*$|-[^-]*$", "", result.stdout.split(":")[-1])


def is_debian_12() -> bool:
    release = Path("/etc/os-release")
    return release.exists() and "VERSION_CODENAME=bookworm" in release.read_text(encoding="utf-8")


def main() -> int:
    root = Path(sys.argv[1])
    rows = ROW.findall((root / "hiprt_device/docs/SECURITY.md").read_text(encoding="utf-8"))
    linked = re.findall(r"^find_package\((\w+)", (root / "tools/CMakeLists.txt").read_text(encoding="utf-8"),
                        re.MULTILINE)
    names = [name for name, _, _ in rows]
    faults = [f"SECURITY.md does not name {package}, which tools/CMakeLists.txt finds" for package in linked
              if LIBRARIES.get(package) not in names]
    if len(linked) < len(LIBRARIES):
        faults.append(f"tools/CMakeLists.txt finds {len(linked)} packages, the test knows {len(LIBRARIES)}")
    compared = 0
    if shutil.which("dpkg-query") and is_debian_12():
        for name, version, package in rows:
            installed = version_of(package)
            compared += installed != ""
            if installed not in ("", version):
                faults.append(f"SECURITY.md: {name} {version}, but {package} is {installed}")
    for fault in faults:
        print(fault, file=sys.stderr)
    print(f"{len(rows)} libraries, {compared} versions compared")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
