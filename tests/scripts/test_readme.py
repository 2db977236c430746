#!/usr/bin/env python3
"""test_readme.py ROOT [--update]: README.md and the pages in hiprt_device/docs show what is in the repository.

- A code block after `<!-- file: PATH -->` is that file without its leading comment. --update puts the code there.
  C++ in pages comes from files. Blocks have at most 30 lines. Every file of tests/examples is shown.
- The rows of a table after `<!-- table: PATH -->` are rows of a table in that file. It may leave out columns and rows.
- Links lead to files, and their #anchors to headings.
- Tests that pages quote (`test_x.cpp "begin of a name*"`) exist. So do paths and C++ names in code spans, and
  pages that comments name.
"""

import re
import sys
from pathlib import Path

import pages

BLOCK = re.compile(r"<!-- file: (\S+) -->\n```(\w+)\n(.*?)```\n", re.DOTALL)
TABLE_MARK = "<!-- table: "
TABLE = re.compile(re.escape(TABLE_MARK) + r"(\S+) -->\n((?:\|.*\n)+)")
ANY_TABLE = re.compile(r"(?:^\|.*\n)+", re.MULTILINE)
MOST_LINES = 30
LONGER = {"tests/gpu/programs/trace_file.hip": 45, "tests/examples/refit.cpp": 32}
FOLDERS = ("hiprt_device/", "hiprt_build/", "tools/", "tests/", "benchmarks/", "cmake/")
CASE = re.compile(r'TEST_CASE\w*\(\s*((?:"(?:[^"\\]|\\.)*"\s*)+)')
# Of compilers, of AMD, of Embree and of pbrt.
FOREIGN = {"__builtin_sqrtf", "image_bvh64_intersect_ray", "motion_derivative", "BoundPointMotion"}
QUOTED = re.compile(r'^(?:([\w/]+\.(?:cpp|hip)) )?"(.*)"$', re.DOTALL)


def code_of(path: Path) -> str:
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    while lines and (lines[0].startswith(("//", "#pragma once")) or not lines[0].strip()):
        lines.pop(0)
    return "".join(lines)


def update(root: Path, name: str) -> None:
    page = root / name
    text = page.read_text(encoding="utf-8")
    page.write_text(BLOCK.sub(lambda m: f"<!-- file: {m[1]} -->\n```{m[2]}\n{code_of(root / m[1])}```\n", text),
                    encoding="utf-8")


def block_faults(root: Path, name: str, text: str) -> list[str]:
    faults = []
    blocks = BLOCK.findall(text)
    for path, _, code in blocks:
        if not (root / path).is_file():
            faults.append(f"{name} shows {path}, which is missing")
        elif code != code_of(root / path):
            faults.append(f"{name} shows something else than {path}: run tests/scripts/test_readme.py . --update")
        if code.count("\n") > LONGER.get(path, MOST_LINES):
            faults.append(f"{path} has more than {LONGER.get(path, MOST_LINES)} lines")
    if text.count("```cpp") != sum(language == "cpp" for _, language, _ in blocks):
        faults.append(f"{name} shows C++ that is in no file")
    return faults


def cells(row: str) -> list[str]:
    return [cell.strip() for cell in row.strip().strip("|").split("|")]


def table_faults(root: Path, name: str, text: str) -> list[str]:
    tables = TABLE.findall(text)
    marks = len(re.findall("^" + TABLE_MARK, text, re.MULTILINE))
    faults = [] if marks == len(tables) else [f"{name}: no table follows a '{TABLE_MARK}'"]
    for path, rows in tables:
        if not (root / path).is_file():
            faults.append(f"{name} shows a table of {path}, which is missing")
            continue
        head, _, *shown = [cells(row) for row in rows.splitlines()]
        stored = []
        for table in ANY_TABLE.findall((root / path).read_text(encoding="utf-8")):
            columns, *lines = [cells(row) for row in table.splitlines()]
            if columns[0] == head[0] and set(head) <= set(columns):
                stored += [[line[columns.index(c)] for c in head] for line in lines if len(line) == len(columns)]
        faults += [f"{name}: not in a table '{head[0]}' of {path}: {row}" for row in shown if row not in stored]
    return faults


def link_faults(root: Path, name: str, text: str) -> list[str]:
    faults = []
    for _, link in pages.LINK.findall(pages.without_code(text)):
        if "://" in link:
            continue
        path, _, part = link.partition("#")
        target = ((root / name).parent / path).resolve() if path else root / name
        if not target.exists():
            faults.append(f"{name} links to {link}, which is missing")
        elif part and part not in pages.anchors(target.read_text(encoding="utf-8")):
            faults.append(f"{name} links to {link}, a heading that is missing")
    return faults


def test_file(root: Path, name: str) -> Path:
    """A name alone is that of a file below tests/traversal."""
    here = root / "tests" / name
    return here if here.is_file() else next((root / "tests/traversal").rglob(name), here)


def test_faults(root: Path, name: str, text: str) -> list[str]:
    """Of quotations `FILE "NAME"` and, behind such a one, `"NAME"` of the same file."""
    faults, current = [], ""
    for span in pages.SPAN.findall(pages.without_code(text)):
        span = " ".join(span.split())
        quoted = QUOTED.match(span)
        if re.fullmatch(r"[\w/]+\.(cpp|hip)", span):
            current = span
            if "test_" in span and not test_file(root, span).is_file() and not (root / span).is_file():
                faults.append(f"{name} names {span}, which is missing")
        elif quoted and quoted[1]:
            current = quoted[1]
        if not quoted or not current.rpartition("/")[2].startswith("test_"):
            continue
        file = test_file(root, current)
        known = [re.sub(r'"\s*"', "", case).strip()[1:-1] for case in
                 CASE.findall(file.read_text(encoding="utf-8") if file.is_file() else "")]
        wanted = quoted[2]
        if not any(k.startswith(wanted[:-1]) if wanted.endswith("*") else k == wanted for k in known):
            faults.append(f'{name} quotes {current} "{wanted}", which is missing')
    return faults


def path_faults(root: Path, name: str, text: str) -> list[str]:
    faults = []
    for span in pages.SPAN.findall(pages.without_code(text)):
        path = span.strip("<>").split()[0].rstrip("/")
        if not path.startswith(FOLDERS) or re.search(r"[^\w./*-]", path):
            continue
        if not list(root.glob(path)) and not (root / "tests" / path).is_file():
            faults.append(f"{name} names {path}, which is missing")
    return faults


def name_faults(root: Path, name: str, text: str, known: set[str]) -> list[str]:
    """Names of more than one word (fooBar, foo_bar) in code spans. MIGRATING.md: only of the last column, ours."""
    text = pages.without_code(text)
    if name.endswith("MIGRATING.md"):
        text = "\n".join(cells(row)[-1] for row in text.splitlines() if row.startswith("|"))
    faults = []
    for span in pages.SPAN.findall(text):
        for word in [] if '"' in span else re.findall(r"(?<![\w.*-])[A-Za-z_]\w+(?![\w*])", span):
            if re.search(r"[a-z][A-Z]|\w_\w", word) and word.removeprefix("test_") not in known | FOREIGN:
                faults.append(f"{name} names {word}, which no source has")
    return faults


def comment_faults(root: Path) -> list[str]:
    faults = []
    for name in pages.tracked(root):
        if name.startswith((pages.RESULTS, "tests/scripts/test_checkers")) or not name.endswith(
                (".h", ".cpp", ".hip", ".py", ".txt", ".cmake")):
            continue
        text = (root / name).read_text(encoding="utf-8")
        faults += [f"{name} names docs/{page}, which is missing" for page in re.findall(r"\bdocs/([\w/-]+\.md)", text)
                   if not (root / pages.DOCS / page).is_file()]
    return faults


def main() -> int:
    root = Path([a for a in sys.argv[1:] if a != "--update"][0]).resolve()
    guide = pages.guide(root)
    if "--update" in sys.argv:
        for name in guide:
            update(root, name)
        return 0
    faults, shown, known = [], set(), set()
    for name in pages.tracked(root):
        if not name.endswith(".md") and not name.startswith(pages.RESULTS):
            known |= set(re.findall(r"[A-Za-z_]\w+", (root / name).read_text(encoding="utf-8", errors="replace")))
    known |= {word.removeprefix("test_") for word in known}
    for name in pages.pages(root):
        text = (root / name).read_text(encoding="utf-8")
        faults += link_faults(root, name, text)
        if name in guide:
            shown |= {path for path, _, _ in BLOCK.findall(text)}
            faults += block_faults(root, name, text) + table_faults(root, name, text)
            faults += test_faults(root, name, text) + path_faults(root, name, text)
    examples = [p.relative_to(root).as_posix() for p in sorted((root / "tests/examples").iterdir())
                if p.suffix in (".hip", ".cpp", ".h") and not p.name.startswith("test_")]
    faults += comment_faults(root)
    faults += [f"no page shows {path}" for path in examples if path not in shown]
    print("\n".join(faults) or f"{len(shown)} programs on {len(guide)} pages, all as in their files")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
