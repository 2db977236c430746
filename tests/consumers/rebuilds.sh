#!/bin/bash
# After a change of one of hiprt's headers the code for the GPU and for the host is compiled again.
# usage: rebuilds.sh BUILD PREFIX DESCRIPTION...: a build folder of Ninja, the installed hiprt that it uses, and what
# Ninja prints for each compilation that must run again.
set -euo pipefail

build=$1 prefix=$2
shift 2
header=$prefix/include/hiprt_device/math/arithmetic.h

# Another test may have changed a header since the folder was built.
ninja -C "$build" >/dev/null
if [[ $(ninja -C "$build" -n) != *"no work to do"* ]]; then
  echo "rebuilds.sh: $build is not up to date after a build" >&2
  exit 1
fi
touch "$header"
plan=$(ninja -C "$build" -n)
for description in "$@"; do
  if [[ $plan != *"$description"* ]]; then
    printf 'rebuilds.sh: %s changed, and Ninja does not run "%s", but:\n%s\n' "$header" "$description" "$plan" >&2
    exit 1
  fi
done
echo "a changed header compiles again: $*"
