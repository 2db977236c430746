#!/bin/bash
# test_flags.sh ROOT WORK "LINK..." COMPILER,FLAG,... ...: guarantees.cpp, compiled with each of the settings, keeps what is
# promised and prints the same. LINK: what is behind the source on the command line. Settings whose compiler is not here
# are left out. Exit status: 0, 1, or 77 where less than two are left.
set -uo pipefail

if [[ $# -lt 5 ]]; then
  echo "usage: test_flags.sh ROOT WORK LINK COMPILER,FLAG,... COMPILER,FLAG,..." >&2
  exit 2
fi
root=$1 work=$2
read -ra link <<<"$3"
shift 3
mkdir -p "$work"

# check_one NUMBER SETTINGS: leaves what the program prints in $work/NUMBER.out, or says what is wrong.
check_one() {
  local number=$1 words
  IFS=, read -ra words <<<"$2"
  if ! "${words[0]}" -std=c++20 -DHIPRT_BUILD_STATIC -Wall -Wextra -Werror "-I$root" "${words[@]:1}" \
    "$root/tests/flags/guarantees.cpp" "${link[@]}" -o "$work/$number" 2>"$work/$number.err" ||
    ! "$work/$number" >"$work/$number.out" 2>>"$work/$number.err"; then
    echo "FAILED: ${words[*]}:"
    cat "$work/$number.err"
    return 1
  fi
}

faults=0 number=0 count=0 first=""
for settings in "$@"; do
  number=$((number + 1))
  if ! command -v "${settings%%,*}" >/dev/null; then
    echo "left out: ${settings%%,*} is not here"
    continue
  fi
  check_one "$number" "$settings" || { faults=$((faults + 1)) && continue; }
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
