#!/usr/bin/env python3
"""test_hardening.py ROOT COMPILER: with the flags of cmake/packages/make.sh hardening.py is content; it misses each
flag that is left out."""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(sys.argv[1])
COMPILER = sys.argv[2]
SOURCE = """
#include <cstdio>
#include <cstring>
int main(int count, char** arguments) {
  char text[16];
  std::strcpy(text, arguments[count - 1]);
  std::puts(text);
}
"""


def flags(name: str) -> list[str]:
    match = re.search(rf'^{name}="(.*)"$', (ROOT / "cmake/packages/make.sh").read_text(encoding="utf-8"), re.MULTILINE)
    return match[1].split()


def verdict(folder: Path, options: list[str]) -> str:
    program = folder / "test_program"
    source = folder / "a.cpp"
    source.write_text(SOURCE)
    subprocess.run([COMPILER, "-O2", "-w", *options, source, "-o", program], check=True)
    result = subprocess.run([sys.executable, "-B", ROOT / "tests/packages/hardening.py", program],
                            capture_output=True, text=True, check=False)
    return f"{result.returncode}: {result.stdout}{result.stderr}"


def main() -> int:
    good = [*flags("hardening"), *flags("hardening_link"), "-fPIE", "-pie"]
    expected = [
        (good, "0: hardened: 1"),
        ([*good, "-no-pie", "-fno-pie"], "no PIE"),
        ([*good, "-Wl,-z,norelro"], "no RELRO"),
        ([*good, "-Wl,-z,lazy"], "no BIND_NOW"),
        ([*good, "-Wl,-z,execstack"], "an executable stack"),
        ([*good, "-fno-stack-protector"], "no stack protector"),
        ([*good, "-U_FORTIFY_SOURCE"], "no call of a fortified function"),
    ]
    failed = 0
    with tempfile.TemporaryDirectory() as name:
        for options, words in expected:
            found = verdict(Path(name), options)
            if words not in found or (words[0] != "0" and not found.startswith("1: ")):
                print(f"{' '.join(options)}: expected '{words}', found '{found}'", file=sys.stderr)
                failed += 1
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
