#!/usr/bin/env python3
"""test_readme.py ROOT: the programs that README.md and API.md show are files that the tests compile, and measured tables are
those of the results.

A code block after `<!-- file: PATH -->` must stand in that file, line for line; --write puts the file's code there
(without its leading comment). The rows of a table after `<!-- table: PATH -->` are rows of the table with that head in that
file. Links to files of the repository must lead somewhere. The kernels of API.md have at most 30
lines each, and none of tests/examples is left out.
"""

import re
import sys
from pathlib import Path

BLOCK = re.compile(r"<!-- file: (\S+) -->\n```(\w+)\n(.*?)```\n", re.DOTALL)
ANY_BLOCK = re.compile(r"^```.*?^```\n", re.DOTALL | re.MULTILINE)
TABLE_MARK = "<!-- table: "
TABLE = re.compile(re.escape(TABLE_MARK) + r"(\S+) -->\n((?:\|.*\n)+)")
ANY_TABLE = re.compile(r"(?:^\|.*\n)+", re.MULTILINE)
LINK = re.compile(r"\]\(([^)#]+)\)")
API = "hiprt_device/docs/API.md"
MOST_LINES = 30


def code_of(path: Path) -> str:
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    while lines and (lines[0].startswith(("//", "#pragma once")) or not lines[0].strip()):
        lines.pop(0)
    return "".join(lines)


def write(root: Path, page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    page.write_text(BLOCK.sub(lambda m: f"<!-- file: {m[1]} -->\n```{m[2]}\n{code_of(root / m[1])}```\n", text),
                    encoding="utf-8")


def table_faults(root: Path, name: str) -> list[str]:
    text = (root / name).read_text(encoding="utf-8")
    tables = TABLE.findall(text)
    faults = [] if text.count(TABLE_MARK) == len(tables) else [f"{name}: no table follows a '{TABLE_MARK}'"]
    for path, rows in tables:
        if not (root / path).is_file():
            faults.append(f"{name} shows a table of {path}, which is missing")
            continue
        head, line, *shown = rows.splitlines()
        there = [table.splitlines() for table in ANY_TABLE.findall((root / path).read_text(encoding="utf-8"))]
        there = [row for table in there if table[:2] == [head, line] for row in table[2:]]
        faults += [f"{name}: not in the table '{head}' of {path}: {row}" for row in shown if row not in there]
    return faults


def faults_of(root: Path, name: str, blocks: list[tuple[str, str, str]]) -> list[str]:
    text = (root / name).read_text(encoding="utf-8")
    faults = [f"{name} shows something else than {path}" for path, _, code in blocks if code != code_of(root / path)]
    faults += [f"{name} links to {link}, which is missing" for link in LINK.findall(ANY_BLOCK.sub("", text))
               if "://" not in link and not ((root / name).parent / link).exists()]
    if name == API and text.count("```cpp") != len(blocks):
        faults.append(f"{name} shows code that is in no file")
    if len(blocks) < 2:
        faults.append(f"{name} shows no programs")
    return faults


def main() -> int:
    root = Path([a for a in sys.argv[1:] if a != "--write"][0])
    names = ["README.md", API]
    if "--write" in sys.argv:
        for name in names:
            write(root, root / name)
        return 0
    blocks = {name: BLOCK.findall((root / name).read_text(encoding="utf-8")) for name in names}
    faults = [fault for name in names for fault in faults_of(root, name, blocks[name]) + table_faults(root, name)]
    faults += [f"{path} has more than {MOST_LINES} lines" for path, _, code in blocks[API]
               if code.count("\n") > MOST_LINES]
    shown = {path for path, _, _ in blocks[API]}
    faults += [f"{API} does not show {path}" for path in
               (p.relative_to(root).as_posix() for p in sorted((root / "tests/examples").glob("*.hip")))
               if path not in shown]
    print("\n".join(faults) or f"{sum(map(len, blocks.values()))} programs, all as in their files")
    return 1 if faults else 0


sys.exit(main())
