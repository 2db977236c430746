#!/usr/bin/env python3
"""test_docstrings.py ROOT: what hiprt_device.h and the public headers of hiprt_build offer is documented.

Of every header that hiprt_device.h reaches, and of the public headers: types, concepts, constants and functions at
namespace scope have a /// comment before them or a ///< behind them. Declarations without an empty line between them
share a comment, and overloads in a file do. Exempt: *_detail namespaces, namespace std and specialisations.
"""

import re
import sys
from pathlib import Path

INCLUDE = re.compile(r"#include <(hiprt_device/[^>]+)>")
TYPE = re.compile(r"^(?:class|struct|enum class|concept)\s+(?:alignas\(\w+\)\s+)?(\w+)(\s*<)?")
FUNCTION = re.compile(r"^(?:HIPRT_\w+ |inline |constexpr |static |friend |auto |decltype\(auto\) )*"
                      r"(?:[\w:]+(?:<[^()]*>)?(?: const)?[&*]? )+[&*]?(\w+)\(")
CONSTANT = re.compile(r"^inline constexpr [\w:]+ (k\w+)")
ALIAS = re.compile(r"^using (\w+) =")
TEMPLATE = re.compile(r"^template\s*<")


def headers(root: Path, name: str, found: dict[str, None]) -> dict[str, None]:
    if name not in found:
        found[name] = None
        for other in INCLUDE.findall((root / name).read_text(encoding="utf-8")):
            headers(root, other, found)
    return found


def statements(text: str):
    """(line number, code of a declaration at namespace scope, documented)"""
    namespaces: list[str] = []
    depth, documented, code, first = 0, False, "", 0
    for number, line in enumerate(text.split("\n"), 1):
        bare = re.sub(r"//.*", "", line).strip()
        if line.strip().startswith("#") or line.endswith("\\"):
            continue
        if depth == 0 and re.match(r"(inline )?namespace", bare):
            namespaces.append(bare)
            code = ""
            continue
        if depth == 0 and bare == "}" and not code:
            namespaces.pop()
            continue
        if depth == 0 and not code:
            if line.strip().startswith("//"):
                documented = documented or line.strip().startswith("///")
                continue
            if not bare:
                documented = False
                continue
            first = number
        code += " " + bare
        documented = documented or "///<" in line
        depth += bare.count("{") - bare.count("}")
        if depth == 0 and (bare.endswith((";", "}")) or bare.endswith("};")):
            if not any("_detail" in n or re.match(r"(?:inline )?namespace (?:hiprt::)?std\b", n) for n in namespaces):
                yield first, code.strip(), documented
            code = ""


def without_template(code: str) -> str:
    while TEMPLATE.match(code):
        depth = 0
        for i, character in enumerate(code):
            depth += (character == "<") - (character == ">" and code[i - 1] != "-")
            if character == ">" and depth == 0:
                code = code[i + 1:].strip()
                break
        else:
            return code
    return re.sub(r"^requires\s*\([^()]*(?:\([^()]*\)[^()]*)*\)\s*|^requires \S+<[^>]*> ", "", code)


def check(path: Path, name: str) -> tuple[int, list[str]]:
    known: dict[str, tuple[int, bool]] = {}
    for number, code, documented in statements(path.read_text(encoding="utf-8")):
        code = without_template(code)
        match = TYPE.match(code) or CONSTANT.match(code) or ALIAS.match(code) or FUNCTION.match(code)
        # Not of specialisations, and not of declarations ahead of a definition.
        if not match or (TYPE.match(code) and (match[2] or re.fullmatch(r"(?:class|struct) \w+;", code))):
            continue
        line, was_documented = known.get(match[1], (number, False))
        known[match[1]] = line, was_documented or documented
    faults = [f"{name}:{line}: {what} has no /// comment" for what, (line, documented) in known.items()
              if not documented]
    return len(known), faults


def main() -> int:
    root = Path(sys.argv[1])
    count, faults = 0, []
    names = headers(root, "hiprt_device/hiprt_device.h", {})
    for folder in ("hiprt_build", "hiprt_build/gpu"):
        names |= {path.relative_to(root).as_posix(): None for path in sorted((root / folder).glob("*.h"))}
    for name in names:
        seen, wrong = check(root / name, name)
        count += seen
        faults += wrong
    if count < 100:
        faults.append(f"only {count} declarations were seen")
    print("\n".join(faults) or f"{count} declarations, all documented")
    return 1 if faults else 0


sys.exit(main())
