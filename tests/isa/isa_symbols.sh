#!/bin/bash
# isa_symbols.sh ISA OBJECT... [-- ISA OBJECT...]...: fails when an object that was compiled for ISA (for example
# x86_64_v3) holds code that could run on a machine without it.
#
# Two ways lead there. The linker keeps one copy of a function that several objects define under one name, and may keep
# this one: so every function that is visible outside its object must have in its name ISA, or the tag of hiprt's inline
# namespace (isa_1111100; portability.h), which must be one tag per ISA and another for each. And constructors of
# globals run on every machine before main() can choose: so there must be none.
set -euo pipefail

if [[ $# -lt 2 ]]; then
  echo "usage: isa_symbols.sh ISA OBJECT... [-- ISA OBJECT...]..." >&2
  exit 2
fi
faults=0
fault() {
  echo "$1"
  faults=$((faults + 1))
}

declare -A isa_of_tag=()
# check_object ISA OBJECT: counts in functions.
check_object() {
  local isa=$1 object=$2 type name tag
  while read -r type name; do
    # More would say the same.
    if [[ $faults -ge 20 ]]; then continue; fi
    functions=$((functions + 1))
    if [[ $name =~ isa_[01]{7}(_fast_math)? ]]; then
      tag=${BASH_REMATCH[0]}
      if [[ ${isa_of_tag[$tag]:=$isa} != "$isa" ]]; then
        fault "$(basename "$object"): $type $(c++filt "$name"): $tag is also the tag of ${isa_of_tag[$tag]}"
      fi
    elif [[ $name != *"$isa"* ]]; then
      fault "$(basename "$object"): $type $(c++filt "$name"): visible outside the object, no $isa or tag in its name"
    fi
  done < <(nm --defined-only --extern-only "$object" | awk '$2 ~ /^[TWi]$/ { print $2, $3 }')
  if grep -q ' t _GLOBAL__sub_I_' <<<"$(nm "$object")"; then
    fault "$(basename "$object"): constructs globals (includes <iostream>?) before the CPU is known"
  fi
}

while [[ $# -gt 0 ]]; do
  isa=$1
  shift
  functions=0
  while [[ $# -gt 0 && $1 != -- ]]; do
    check_object "$isa" "$1"
    shift
  done
  [[ $# -eq 0 ]] || shift
  echo "$isa: $functions visible functions, $faults faults so far"
  if [[ $functions -eq 0 ]]; then fault "$isa: no function found: nothing was checked"; fi
done
[[ $faults -eq 0 ]]
