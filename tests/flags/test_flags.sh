#!/bin/bash
# test_flags.sh ROOT WORK "LINK..." COMPILER,FLAG,... ...: guarantees.cpp, with the headers beside it compiled with each
# of the settings, keeps what is promised and prints the same. LINK: what is behind the object on the command line.
# Settings whose compiler is not here are left out. Exit status: 0, 1, or 77 where less than two are left.
set -uo pipefail

if [[ $# -lt 5 ]]; then
  echo "usage: test_flags.sh ROOT WORK LINK COMPILER,FLAG,... COMPILER,FLAG,..." >&2
  exit 2
fi
root=$1 work=$2
read -ra link <<<"$3"
shift 3
mkdir -p "$work"

# try_one NUMBER SETTINGS: leaves what the program prints in $work/NUMBER.out, or what is wrong in $work/NUMBER.err.
#
# With -Ofast compilers link what makes the processor flush subnormal numbers, also behind -fno-fast-math: no setting of
# the code, but a state of the process in which hits that have such numbers are others. So the program whose output is
# compared is linked without the settings; where it is linked with -Ofast all checks have to hold, too.
try_one() {
  local program=$work/$1 words
  IFS=, read -ra words <<<"$2"
  "${words[0]}" -std=c++20 -DHIPRT_BUILD_STATIC -Wall -Wextra -Werror "-I$root" "${words[@]:1}" \
    -c "$root/tests/flags/guarantees.cpp" -o "$program.o" 2>"$program.err" || return
  if [[ ,$2, == *,-Ofast,* ]]; then
    echo "linked with -Ofast:" >>"$program.err"
    "${words[0]}" -Ofast "$program.o" "${link[@]}" -o "$program" 2>>"$program.err" || return
    "$program" >/dev/null 2>>"$program.err" || return
    echo "linked without:" >>"$program.err"
  fi
  "${words[0]}" "$program.o" "${link[@]}" -o "$program" 2>>"$program.err" || return
  "$program" >"$program.out" 2>>"$program.err"
}

faults=0 number=0 count=0 first=""
for settings in "$@"; do
  number=$((number + 1))
  if ! command -v "${settings%%,*}" >/dev/null; then
    echo "left out: ${settings%%,*} is not here"
    continue
  fi
  if ! try_one "$number" "$settings"; then
    echo "FAILED: $settings:"
    cat "$work/$number.err"
    faults=$((faults + 1))
    continue
  fi
  count=$((count + 1))
  first=${first:-$number}
  if ! diff "$work/$first.out" "$work/$number.out" >"$work/$number.diff"; then
    echo "FAILED: $settings has other hits:"
    cat "$work/$number.diff"
    faults=$((faults + 1))
  fi
done
echo "$count settings, $faults faults"
if [[ $faults -ne 0 ]]; then exit 1; fi
if [[ $count -lt 2 ]]; then
  echo "SKIPPED: no two compilers' settings to compare"
  exit 77
fi
