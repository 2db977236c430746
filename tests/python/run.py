#!/usr/bin/env python3
"""run.py SOURCE FOLDER [CMAKE_DEFINITION...]: builds the wheel of the Python module, installs it, and runs its tests.

FOLDER keeps the virtual environment and the build between runs. Exit status 77, with the reason, where the wheel cannot
be built: no venv, no Python headers, no packages from the index.
"""

import os
import subprocess
import sys
import sysconfig
from pathlib import Path

NEEDED = ["scikit-build-core>=0.10", "nanobind>=2.2", "ninja", "numpy", "pytest"]
# Judges. Open3D is too large to fetch; it is used where the environment has it.
JUDGES = ["trimesh", "scipy", "rtree", "embreex", "mypy"]


def skip(reason: str) -> None:
    print(f"SKIPPED: {reason}")
    sys.exit(77)


def output_of(command: list) -> "tuple[int, str]":
    done = subprocess.run([str(part) for part in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return done.returncode, done.stdout


def last_line(text: str) -> str:
    lines = [line for line in text.splitlines() if line.strip() and "[notice]" not in line]
    return lines[-1] if lines else "no message"


def environment(folder: Path) -> Path:
    """The Python of a virtual environment with the packages that the build and the tests need."""
    python = folder / "venv" / ("Scripts" if os.name == "nt" else "bin") / "python"
    if not python.exists():
        status, text = output_of([sys.executable, "-m", "venv", folder / "venv"])
        if status != 0:
            skip(f"{sys.executable} -m venv: {last_line(text)}")
    pip = [python, "-m", "pip", "--disable-pip-version-check", "install", "--quiet", "--retries", "1"]
    status, text = output_of([*pip, *NEEDED])
    if status != 0:
        skip(f"pip cannot install {' '.join(NEEDED)}: {last_line(text)}")
    for package in JUDGES:
        output_of([*pip, package])
    return python


def isa_faults(source: Path, build: Path) -> int:
    """Whether functions for a newer instruction set could run on an older machine (tests/isa)."""
    groups = []
    for folder in sorted((build / "CMakeFiles").glob("hiprt_python_x86*.dir")):
        groups += ["--"] * bool(groups) + [folder.name[len("hiprt_python_"):-len(".dir")], *folder.rglob("*.o")]
    if not groups:  # Another processor, or one instruction set.
        return 0
    return subprocess.run(["bash", source / "tests" / "isa" / "isa_symbols.sh", *groups]).returncode


def main() -> int:
    source, folder, definitions = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:]
    headers = Path(sysconfig.get_path("include")) / "Python.h"
    if not headers.exists():
        skip(f"{headers} is not there (Debian: python3-dev)")
    if sysconfig.get_config_var("Py_GIL_DISABLED"):
        skip("this Python is free-threaded, which the module refuses")
    folder.mkdir(parents=True, exist_ok=True)
    python = environment(folder)
    os.environ.setdefault("CMAKE_BUILD_PARALLEL_LEVEL", str(os.cpu_count() or 1))
    settings = [f"--config-settings=cmake.define.{definition}" for definition in definitions]
    # Without isolation the environment's paths stay, so that a second run compiles only what has changed.
    status, text = output_of([python, "-m", "pip", "--disable-pip-version-check", "install", "--no-build-isolation",
                              "--no-deps", "--force-reinstall", f"--config-settings=build-dir={folder / 'build'}",
                              *settings, source / "hiprt_build" / "python"])
    if status != 0:
        print(text)
        return 1
    if isa_faults(source, folder / "build") != 0:
        return 1
    return subprocess.run([python, "-B", "-m", "pytest", "-q", "-rs", "-p", "no:cacheprovider",
                           source / "tests" / "python"], cwd=folder).returncode


if __name__ == "__main__":
    sys.exit(main())
