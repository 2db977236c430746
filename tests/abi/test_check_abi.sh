#!/bin/bash
# check_abi.sh finds changes that break programs, and lets others pass. Usage: test_check_abi.sh LIBRARY
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
library=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
xz -dc "$here"/hiprt_build-*.abi.xz >"$work/stored.abi"

# check NAME WANTED SED: the exit status of the check when the older library differed as SED says.
check() {
  local status=0
  sed "$3" "$work/stored.abi" >"$work/$1.abi"
  if [[ $1 != same ]] && cmp -s "$work/stored.abi" "$work/$1.abi"; then
    echo "test_check_abi.sh: $1 changed nothing" >&2
    exit 1
  fi
  xz -0c "$work/$1.abi" >"$work/$1.abi.xz"
  "$here/check_abi.sh" --dump "$work/dump" --stored "$work/$1.abi.xz" "$library" >"$work/$1.log" 2>&1 || status=$?
  if [[ $status -eq 77 ]]; then
    cat "$work/$1.log"
    exit 77
  fi
  if [[ $status -ne $2 ]]; then
    echo "test_check_abi.sh: $1: exit status $status instead of $2" >&2
    cat "$work/$1.log" >&2
    exit 1
  fi
}

if grep -q "SKIPPED: types" <("$here/check_abi.sh" --dump "$work/dump" "$library"); then
  echo "SKIPPED: this compiler's types cannot be compared with the stored ABI"
  exit 77
fi
check same 0 ''
check a_new_function 0 '/_ZN5hiprt5build14embree_versionEv/d'
check a_function_that_vanished 1 's/_ZN5hiprt5build14embree_versionEv/_ZN5hiprt5build14embree_versionEi/'
check a_type_of_another_size 1 "s/\\(<class-decl name='BuildOptions' size-in-bits='\\)[0-9]*'/\\18'/"
check a_returned_type 1 "s/\\(<class-decl name='MergedLevels' size-in-bits='\\)[0-9]*'/\\18'/"
echo "check_abi.sh found each change"
