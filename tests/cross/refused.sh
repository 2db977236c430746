#!/bin/bash
# refused.sh ROOT: big-endian and 32-bit machines are refused with one message that says why.
#
# clang++ compiles the headers for such a machine without its libraries: the message comes before the first of them.
# Where Debian's cross compiler (g++-s390x-linux-gnu and the like) is installed, it compiles them too, and CMake refuses
# it. Exit status: 0, 1 (a fault, which is printed) or 77 (no compiler here).
set -uo pipefail

if [[ $# -ne 1 ]]; then
  echo "usage: refused.sh ROOT" >&2
  exit 2
fi
root=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
tried=0
faults=0
missing=()

# refuses MESSAGE COMMAND...: the command fails, and MESSAGE is its first error, which CMake breaks into lines.
refuses() {
  local message=$1 output
  shift
  tried=$((tried + 1))
  if output=$("$@" 2>&1); then
    echo "FAILED: nothing is refused by: $*"
    faults=$((faults + 1))
  elif ! awk '/[Ee]rror/ && !left { left = 5 } left > 1 { printf "%s", $0; left-- }' <<<"$output" | tr -s ' ' |
    grep -q -- "$message"; then
    printf 'FAILED: the first error is not "%s":\n%s\n' "$message" "$output"
    faults=$((faults + 1))
  fi
}

# check TARGET MESSAGE NUMBERS: NUMBERS is what CMake says of the machine.
check() {
  local target=$1 message=$2 numbers=$3 header compilers=()
  if command -v clang++ >/dev/null; then compilers+=("clang++ --target=$target"); fi
  if command -v "$target-g++" >/dev/null; then compilers+=("$target-g++"); else missing+=("$target-g++"); fi
  for compiler in "${compilers[@]}"; do
    for header in hiprt_device.h format/standard.h format/buffer.h; do
      echo "#include <hiprt_device/$header>" >"$work/use.cpp"
      # shellcheck disable=SC2086
      refuses "$message" $compiler -std=c++20 "-I$root" -fsyntax-only "$work/use.cpp"
    done
  done
  if command -v "$target-g++" >/dev/null && command -v cmake >/dev/null && command -v ninja >/dev/null; then
    rm -rf "$work/build"
    refuses "hiprt needs a 64-bit little-endian machine" cmake -S "$root" -B "$work/build" -G Ninja \
      -DCMAKE_SYSTEM_NAME=Linux "-DCMAKE_SYSTEM_PROCESSOR=${target%%-*}" "-DCMAKE_CXX_COMPILER=$target-g++"
    refuses "$numbers" cmake -S "$root" -B "$work/build"
  fi
}

check s390x-linux-gnu "this machine is big-endian" "64 bits, BIG_ENDIAN"
check arm-linux-gnueabihf "this machine has 32-bit pointers" "32 bits, LITTLE_ENDIAN"
check i686-linux-gnu "this machine has 32-bit pointers" "32 bits, LITTLE_ENDIAN"
check powerpc-linux-gnu "this machine is big-endian" "32 bits, BIG_ENDIAN"
if [[ $tried -eq 0 ]]; then
  echo "SKIPPED: no clang++, and none of ${missing[*]}"
  exit 77
fi
echo "$tried refusals, $faults faults; not installed here: ${missing[*]:-none}"
[[ $faults -eq 0 ]]
