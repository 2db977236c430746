#!/bin/bash
# Compares the ABI of the shared library with the stored one. See --help.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)

usage() {
  cat <<TEXT
usage: tests/abi/check_abi.sh [--update] [--stored FILE] [--dump FILE] LIBRARY

Compares libhiprt_build.so, compiled with -g, with the ABI of its SONAME:
  cmake/packages/symbols        the exported names, a file of the Debian package
  tests/abi/hiprt_build-*.abi.xz  functions and types, as abidw of libabigail writes them (or --stored FILE)
--dump keeps what abidw writes about the library in a file, or takes it from there.
A program that was linked with an older library of the same SONAME must work with this one. So nothing may vanish and no
type may change its layout. New functions are written to the list of names by --update.

After an incompatible change raise HIPRT_ABI (hiprt_build/CMakeLists.txt) and run this with --update: it stores both
files for the new SONAME.

Exit status: 0 when programs stay compatible, 1 when not, 2 for a wrong argument, 77 without abidw.
TEXT
}

update=false
library=""
stored=""
dump=""
while [[ $# -gt 0 ]]; do
  case $1 in
    -h | --help)
      usage
      exit 0
      ;;
    --update) update=true ;;
    --stored)
      stored=${2:-}
      shift
      ;;
    --dump)
      dump=${2:-}
      shift
      ;;
    -*)
      echo "check_abi.sh: unknown option '$1' (see --help)" >&2
      exit 2
      ;;
    *) library=$1 ;;
  esac
  shift
done
if [[ ! -f $library ]]; then
  echo "check_abi.sh: no library '$library' (see --help)" >&2
  exit 2
fi
for program in abidw abidiff xz objdump; do
  if ! command -v "$program" >/dev/null; then
    echo "SKIPPED: no $program (tools/install-packages test)"
    exit 77
  fi
done

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
soname=$(objdump -p "$library" | awk '$1 == "SONAME" { print $2 }')
abi=${soname##*.so.}
stored=${stored:-$here/hiprt_build-$abi.abi.xz}
# Compilers describe equal types in different ways.
stored_by="GCC 12"
compiler=$(readelf -p .comment "$library" | sed -n 's/.*GCC: ([^)]*) \([0-9]*\).*/GCC \1/p' | head -1)
symbols=$root/cmake/packages/symbols
header="$soname libhiprt-build$abi #MINVER#"
version=$(sed -n 's/#define HIPRT_LIBRARY_[MP][A-Z]* \([0-9]*\)/\1/p' "$root/hiprt_device/version.h" | paste -sd.)

# Each name with the version that introduced it.
names=$(LC_ALL=C nm -D --defined-only "$library" | awk '{ print $3 }' | LC_ALL=C sort)
declare -A since=()
if [[ -s $symbols && $(head -1 "$symbols") == "$header" ]]; then
  while read -r name introduced; do since[${name%@Base}]=$introduced; done < <(tail -n +2 "$symbols")
fi
{
  echo "$header"
  for name in $names; do echo " $name@Base ${since[$name]:-$version}"; done
} >"$work/symbols"

dump=${dump:-$work/new.abi}
if [[ ! -s $dump ]]; then
  abidw --exported-interfaces-only --no-show-locs --no-comp-dir-path --no-corpus-path --drop-private-types \
    --headers-dir "$root/hiprt_build" --type-id-style hash "$library" |
    sed "s#path='[^']*/\(hiprt_build\|hiprt_device\)/#path='\1/#" >"$dump"
fi
if $update; then
  cp "$work/symbols" "$symbols"
  if [[ ! -e $stored ]]; then
    rm -f "$here"/hiprt_build-*.abi.xz
    xz -9ec "$dump" >"$stored"
  fi
  exit 0
fi

if [[ ! -e $stored ]]; then
  echo "check_abi.sh: $stored is missing: run tests/abi/check_abi.sh --update $library" >&2
  exit 1
fi
failed=0
if ! diff -u "$symbols" "$work/symbols"; then
  echo "check_abi.sh: $soname exports other names than cmake/packages/symbols lists (see --help)" >&2
  failed=1
fi
xz -dc "$stored" >"$work/old.abi"
if [[ $compiler != "$stored_by" ]]; then
  echo "SKIPPED: types: the stored ABI is $stored_by's, and ${compiler:-another compiler} made this library"
elif ! abidiff --suppressions "$here/suppressions.ini" --no-added-syms "$work/old.abi" "$dump"; then
  echo "check_abi.sh: programs that were linked with $soname would not work with this library (see --help)" >&2
  failed=1
fi
exit $failed
