#!/usr/bin/env python3
"""test_readme.py ROOT: the programs that README.md shows are files that the tests compile.

A code block after `<!-- file: PATH -->` must stand in that file, line for line; --write puts the file's code there
(without its leading comment). Links to files of the repository must lead somewhere.
"""

import re
import sys
from pathlib import Path

BLOCK = re.compile(r"<!-- file: (\S+) -->\n```(\w+)\n(.*?)```\n", re.DOTALL)
LINK = re.compile(r"\]\(([^)#]+)\)")


def code_of(path: Path) -> str:
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    while lines and (lines[0].startswith("//") or not lines[0].strip()):
        lines.pop(0)
    return "".join(lines)


def main() -> int:
    write = "--write" in sys.argv
    root = Path([a for a in sys.argv[1:] if a != "--write"][0])
    readme = root / "README.md"
    text = readme.read_text(encoding="utf-8")
    if write:
        readme.write_text(
            BLOCK.sub(lambda m: f"<!-- file: {m[1]} -->\n```{m[2]}\n{code_of(root / m[1])}```\n", text), encoding="utf-8")
        return 0
    blocks = BLOCK.findall(text)
    faults = [f"README.md shows something else than {path}" for path, _, code in blocks if code != code_of(root / path)]
    faults += [f"README.md links to {link}, which is missing" for link in LINK.findall(text)
               if "://" not in link and not (root / link).exists()]
    if len(blocks) < 2:
        faults.append("README.md shows no programs")
    print("\n".join(faults) or f"{len(blocks)} programs, all as in their files")
    return 1 if faults else 0


sys.exit(main())
