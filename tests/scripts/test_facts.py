#!/usr/bin/env python3
"""test_facts.py ROOT: what pages say of the code in numbers and lists is what the code says.

- `<!-- fact: NAME -->VALUE<!-- /fact -->` in a page has the value that facts() finds.
- The tables of stacks, builders, layouts and sections name all that there are, and nothing else.
- The table of registers in GPUS.md is what tests/gpu/resources.json says.
- A build folder that a page installs from is that of a preset with an install target and all of its files.
- The charts in hiprt_device/docs/images are what make_charts.py draws.
"""

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import pages

FACT = re.compile(r"<!--\s+fact:\s+(\S+)\s+-->(.*?)<!--\s+/fact\s+-->", re.DOTALL)


def read(root: Path, name: str) -> str:
    return (root / name).read_text(encoding="utf-8")


def find(root: Path, name: str, pattern: str) -> str:
    match = re.search(pattern, read(root, name))
    if not match:
        sys.exit(f"{name}: nothing is like {pattern}; test_facts.py has to follow")
    return match[1]


def facts(root: Path) -> dict[str, str]:
    header = "hiprt_device/format/buffer.h"
    return {
        "format": find(root, header, r"kVersionMajor = (\d+);") + "." + find(root, header, r"kVersionMinor = (\d+);"),
        "levels": find(root, "tools/render/scene/trace_limits.h", r"kTraceLevels = (\d+);"),
    }


def first_column(root: Path, page: str, head: str) -> list[str]:
    """The `names` in the first cells of the table that begins with this head."""
    text = read(root, page)
    start = text.index("\n" + head)
    rows = re.match(r"(?:\|.*\n)+", text[start + 1:])[0].splitlines()[2:]
    return [re.match(r"\| `([\w-]+)", row)[1] for row in rows]


def stacks(root: Path) -> list[str]:
    text = "".join(p.read_text(encoding="utf-8") for p in (root / "hiprt_device/traverse/stacks").glob("*.h"))
    found = re.findall(r"^(?:template <[^<>]*> )?struct (\w+Stack) \{", text, re.MULTILINE)
    return [name for name in found if name != "LevelStack"]


def builders(root: Path) -> list[str]:
    found = re.findall(r'case Builder::\w+:\s*return "([\w-]+)";', read(root, "hiprt_build/input/names.cpp"))
    return [name for name in found if name != "imported"]


def layouts(root: Path) -> list[str]:
    return re.findall(r"^struct (\w+)Layout\b", read(root, "hiprt_device/format/layout.h"), re.MULTILINE)


def differences(what: str, said: list[str], there: list[str]) -> list[str]:
    if len(there) < 2:
        return [f"{what}: only {there} were found in the code; test_facts.py has to follow"]
    return ([f"{what}: {name} is in the code only" for name in there if name not in said] +
            [f"{what}: {name} is in the page only" for name in said if name not in there])


def list_faults(root: Path) -> list[str]:
    docs = pages.DOCS
    policies = re.search(r"^\| `Layout` \| (.*) \|$", read(root, docs + "POLICIES.md"), re.MULTILINE)[1]
    lower = [name.lower() for name in layouts(root)]
    return (differences("STACKS.md", first_column(root, docs + "STACKS.md", "| stack |"), stacks(root)) +
            differences("BUILDERS.md", first_column(root, docs + "BUILDERS.md", "| name | method"), builders(root)) +
            differences("BUILDERS.md", first_column(root, docs + "BUILDERS.md", "| layout |"), lower) +
            differences("POLICIES.md", re.findall(r"`(\w+)Layout`", policies), layouts(root)))


def install_faults(root: Path) -> list[str]:
    """`cmake --install build/PRESET` of pages: the preset builds and installs everything."""
    presets = json.loads(read(root, "CMakePresets.json"))
    variables, parents = ({p["name"]: p.get(key, other) for p in presets["configurePresets"]}
                          for key, other in (("cacheVariables", {}), ("inherits", None)))
    partial = {p["configurePreset"] for p in presets["buildPresets"] if "targets" in p}
    faults, count = [], 0
    for page in pages.guide(root):
        for name in re.findall(r"cmake --install build/(\w+)", read(root, page)):
            count += 1
            chain, switch = name if name in variables else None, None
            while chain and switch is None:
                chain, switch = parents[chain], variables[chain].get("HIPRT_INSTALL")
            if name not in variables or switch == "OFF" or name in partial:
                faults.append(f"{page}: the preset '{name}' cannot be installed: it is unknown, has HIPRT_INSTALL=OFF, "
                              "or builds some targets only")
    return faults if count else ["no page says 'cmake --install build/PRESET'; test_facts.py has to follow"]


def waves(architecture: str, registers: int) -> int:
    """Most waves of a SIMD unit, by the registers of a kernel: AMD's tables of each family."""
    step, of_unit, most = {"gfx90a": (8, 512, 8), "gfx1030": (8, 1024, 16), "gfx1100": (24, 1536, 16)}[architecture]
    return min(most, of_unit // (-(-max(registers, 1) // step) * step))


def register_faults(root: Path) -> list[str]:
    """The rows `| architecture | more, fewer, + worst | ... | lost of each compiler |` for the traversal kernels."""
    sources = json.loads(read(root, "tests/gpu/resources.json"))["sources"]
    kernels = sources["tests/gpu/resource_traversal.hip"]["kernels"].values()
    faults = []
    for architecture in ("gfx90a", "gfx1030", "gfx1100"):
        cells, lost = [], []
        for compiler in ("clang17", "clang21"):
            pairs = [(k[architecture]["registers"], k[f"{architecture}.{compiler}"]["registers"]) for k in kernels]
            more = [after - before for before, after in pairs if after > before]
            cells.append(f"{len(more)}, {sum(after < before for before, after in pairs)}, + {max(more, default=0)}")
            lost.append(sum(waves(architecture, after) < waves(architecture, before) for before, after in pairs))
        row = f"| {architecture} | {cells[0]} | {cells[1]} | {lost[0]} and {lost[1]} kernels |"
        if row not in read(root, pages.DOCS + "GPUS.md"):
            faults.append(f"GPUS.md: registers by compiler: expected the row '{row}'")
    return faults


def chart_faults(root: Path) -> list[str]:
    images = root / pages.DOCS / "images"
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.executable, "-B", images / "make_charts.py", folder], check=True)
        made = sorted(Path(folder).iterdir())
        return [f"{p.name} is not what make_charts.py draws" for p in made
                if not (images / p.name).is_file() or (images / p.name).read_bytes() != p.read_bytes()]


def main() -> int:
    root = Path(sys.argv[1]).resolve()
    known, faults, count = facts(root), [], 0
    for name in pages.guide(root):
        for fact, value in FACT.findall(pages.SPAN.sub("", pages.without_code(read(root, name)))):
            count += 1
            if known.get(fact) != value:
                faults.append(f"{name}: {fact} is {known.get(fact, 'no fact')}, the page says {value}")
    faults += list_faults(root) + register_faults(root) + install_faults(root) + chart_faults(root)
    print("\n".join(faults) or f"{count} facts and the lists of the pages are the code's")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
