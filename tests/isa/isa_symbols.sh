#!/bin/bash
# isa_symbols.sh ISA OBJECT...: fails when an object that was compiled for ISA (for example x86_64_v3) holds code that
# could run on a machine without it.
#
# Two ways lead there. The linker keeps one copy of a function that several objects define under one name, and may keep this
# one: so every function that is visible outside its object must have ISA in its name (hiprt's inline namespace does that).
# And constructors of globals run on every machine before main() can choose: so there must be none.
set -euo pipefail

if [[ $# -lt 2 ]]; then
  echo "usage: isa_symbols.sh ISA OBJECT..." >&2
  exit 2
fi
isa=$1
shift
faults=0
functions=0
for object in "$@"; do
  while read -r type name; do
    functions=$((functions + 1))
    if [[ $name != *"$isa"* ]]; then
      echo "$(basename "$object"): $type $(c++filt "$name"): visible outside the object without $isa in its name"
      faults=$((faults + 1))
    fi
  done < <(nm --defined-only --extern-only "$object" | awk '$2 ~ /^[TWi]$/ { print $2, $3 }')
  if nm "$object" | grep -q ' t _GLOBAL__sub_I_'; then
    echo "$(basename "$object"): constructs globals (includes <iostream>?) before the CPU is known"
    faults=$((faults + 1))
  fi
done
echo "$isa: $functions visible functions in $# objects, $faults faults"
if [[ $functions -eq 0 ]]; then
  echo "no function found: nothing was checked"
  exit 1
fi
[[ $faults -eq 0 ]]
