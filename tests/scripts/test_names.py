#!/usr/bin/env python3
"""test_names.py ROOT: no two files of hiprt_build and tools define types of one name in one namespace.

The linker keeps one copy of the inline functions of such types, without a word, and calls it for both (the one
definition rule of C++). Unnamed namespaces and specializations of templates are not meant.
"""

import re
import sys
from collections import defaultdict
from pathlib import Path

TYPE = re.compile(r"^(?:struct|class|union|enum(?: class)?) (?:alignas\(\w+\) )?(\w+)(?: final)?(?: :[^;]*)? ?\{")
OPENED = re.compile(r"^(?:inline )?namespace ?([\w:]*) \{$")
CLOSED = re.compile(r"^\}  // (?:inline )?namespace")
# What is linked together.
TOGETHER = ("tools", "hiprt_build")


def types_of(text: str) -> list[str]:
    """The qualified names of the types that a file defines at the beginning of a line, outside unnamed namespaces."""
    found, spaces = [], []
    for line in text.splitlines():
        if opened := OPENED.match(line):
            spaces.append(opened[1])
        elif CLOSED.match(line) and spaces:
            spaces.pop()
        elif (defined := TYPE.match(line)) and "" not in spaces:
            found.append("::".join([*spaces, defined[1]]))
    return found


def faults_of(files: dict[str, str]) -> list[str]:
    """@param files text by name."""
    places = defaultdict(list)
    for name, text in files.items():
        for full in types_of(text):
            places[full].append(name)
    return [f"{full} is defined in {' and '.join(names)}" for full, names in sorted(places.items()) if len(names) > 1]


def main() -> int:
    two = "namespace {\nstruct Two {\n};\n}  // namespace\n"
    good = {"a.h": "namespace a {\nstruct One {\n};\n" + two + "}  // namespace a\n",
            "b.cpp": "namespace a {\nnamespace {\nstruct One {};\n}  // namespace\nstruct Two {};\nclass Three;\n}\n"}
    bad = {**good, "c.h": "namespace a {\nclass One final {\n};\n}  // namespace a\n"}
    if faults_of(good) or faults_of(bad) != ["a::One is defined in a.h and c.h"]:
        sys.exit(f"test_names.py does not see what it should: {faults_of(good)}, {faults_of(bad)}")
    root = Path(sys.argv[1]).resolve()
    files = {str(path.relative_to(root)): path.read_text(encoding="utf-8")
             for folder in TOGETHER for path in sorted((root / folder).rglob("*")) if path.suffix in (".h", ".cpp")}
    faults = faults_of(files)
    count = sum(len(types_of(text)) for text in files.values())
    if count < 300:
        faults.append(f"only {count} types were found; test_names.py has to follow")
    print("\n".join(faults) or f"{count} types in {len(files)} files, no name twice")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
