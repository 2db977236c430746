#!/usr/bin/env python3
"""test_device_functions.py ROOT: no text that nvcc compiles for devices calls functions that it compiles wrongly there.

nvcc 13 takes std::countr_zero() of libstdc++ as the constant 32 in device code: the builtin behind it is a host
function, and the call is dropped without a word. lowest_bit() of hiprt_device/math/arithmetic.h is right everywhere.
"""

import re
import sys
from pathlib import Path

FOR_DEVICES = re.compile(r"\bHIPRT_HD\b|__device__|__global__")
WRONG = re.compile(r"\bstd::(?:countr_zero|countr_one|countl_one)\b|\b__builtin_(?:ctz|ffs)")
# In its branch for hosts.
HAS_IT = "hiprt_device/math/arithmetic.h"


def faults_of(files: dict[str, str]) -> list[str]:
    """@param files text by name."""
    found = []
    for name, text in files.items():
        if not FOR_DEVICES.search(text) or name == HAS_IT:
            continue
        for number, line in enumerate(text.splitlines(), 1):
            if wrong := WRONG.search(line.split("//")[0]):
                found.append(f"{name}:{number}: {wrong[0]} is wrong in device code by nvcc: call lowest_bit()")
    return found


def main() -> int:
    files = {"host.h": "int a = std::countr_zero(b);\n",
             "both.h": "HIPRT_HD int f() {\n  return std::countr_zero(1u);\n}\n"}
    if [fault.split(": ")[0] for fault in faults_of(files)] != ["both.h:2"]:
        sys.exit(f"test_device_functions.py does not see what it should: {faults_of(files)}")
    root = Path(sys.argv[1]).resolve()
    files = {str(path.relative_to(root)): path.read_text(encoding="utf-8")
             for folder in ("hiprt_device", "hiprt_build", "benchmarks", "tests", "tools")
             for path in sorted((root / folder).rglob("*")) if path.suffix in (".h", ".hip", ".cpp")}
    faults = faults_of(files)
    if HAS_IT not in files or "lowest_bit" not in files[HAS_IT]:
        faults.append(f"{HAS_IT} has no lowest_bit(); test_device_functions.py has to follow")
    count = sum(1 for text in files.values() if FOR_DEVICES.search(text))
    print("\n".join(faults) or f"{count} files for devices, no function that nvcc compiles wrongly")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
