#!/bin/bash
# Compiles and packs, for tools/package.
# usage: make.sh [--repeat] [--gpu PLATFORM] --output FOLDER KIND...
#   KIND      deb or archive
#   --repeat  compiles all a second time, in another folder, and compares the bytes; deb: runs lintian
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
jobs=${HIPRT_JOBS:-$(nproc)}
repeat=false
gpu=AUTO
output=""
kinds=()
while [[ $# -gt 0 ]]; do
  case $1 in
    --repeat) repeat=true ;;
    --gpu)
      gpu=$2
      shift
      ;;
    --output)
      output=$2
      shift
      ;;
    *) kinds+=("$1") ;;
  esac
  shift
done

# The day of the release in CHANGELOG.md, or of 2026: equal sources have equal times.
day=$(sed -n 's/^## [0-9.]* - \([0-9-]*\)$/\1/p' "$root/CHANGELOG.md" | head -1)
SOURCE_DATE_EPOCH=$(date -u -d "${day:-2026-01-01}" +%s)
export SOURCE_DATE_EPOCH

# quietly LOG COMMAND...: prints the output only when the command fails.
quietly() {
  local log=$1
  shift
  if ! "$@" >"$log" 2>&1; then
    tail -40 "$log" >&2
    echo "tools/package: failed: ${*:1:4} (log: $log)" >&2
    exit 1
  fi
}

# Archives have no GPU code.
platform_of() {
  if [[ $1 == archive ]]; then echo OFF; else echo "$gpu"; fi
}

# Programs and libraries stop where memory was overwritten. tests/packages/hardening.py checks these in the packages;
# benchmarks/safety/compare.py measures what they cost rays.
# Not -fstack-clash-protection: it would touch every page of the tools' traversal stacks (64 KiB) for every ray.
# C libraries before glibc 2.35 take level 3 for 2. Some distributions' compilers define a level themselves.
hardening="-fstack-protector-strong -U_FORTIFY_SOURCE -D_FORTIFY_SOURCE=3"
hardening_link="-Wl,-z,relro,-z,now"

# make KIND SOURCE BUILD: packages in BUILD/packages. Kinds of the same platform share a build folder.
make() {
  local kind=$1 source=$2 build=$3 generator=DEB map
  # The folder of the sources is in no file.
  map="-ffile-prefix-map=$source=/usr/src/hiprt"
  if [[ $kind == archive ]]; then generator=TGZ; fi
  rm -rf "$build/packages"
  mkdir -p "$build"
  quietly "$build/configure.log" cmake -S "$source" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_INSTALL_PREFIX=/usr "-DCMAKE_CXX_FLAGS=$map $hardening" -DCMAKE_POSITION_INDEPENDENT_CODE=ON \
    "-DCMAKE_EXE_LINKER_FLAGS=-pie $hardening_link" "-DCMAKE_SHARED_LINKER_FLAGS=$hardening_link" \
    "-DHIPRT_GPU_FLAGS=$map" -DHIPRT_GPU="$(platform_of "$kind")" -DHIPRT_MPI=OFF \
    -DHIPRT_BUILD_TESTS=OFF -DHIPRT_BUILD_BENCHMARKS=OFF -DCMAKE_INSTALL_LIBDIR="$(library_folder "$kind")"
  quietly "$build/build.log" cmake --build "$build" -j "$jobs"
  (cd "$build" && quietly "$build/cpack.log" cpack -G "$generator")
}

# Debian's multi-arch folder; other systems' archives have lib.
library_folder() {
  if [[ $1 == deb ]]; then echo "lib/$(dpkg-architecture -q DEB_HOST_MULTIARCH)"; else echo lib; fi
}

packages() {
  find "$1/packages" -maxdepth 1 \( -name '*.deb' -o -name '*.tar.gz' \) | sort
}

other=$(mktemp -d)
trap 'rm -rf "$other"' EXIT
if $repeat; then
  mkdir "$other/source"
  (cd "$root" && find . -mindepth 1 -maxdepth 1 ! -name build ! -name .git -print0 | tar -c --null -T - -f -) |
    tar -x -C "$other/source" -f -
fi
for kind in "${kinds[@]}"; do
  build=$root/build/package/$(platform_of "$kind")
  echo "tools/package: compiles and packs ($kind)"
  make "$kind" "$root" "$build"
  mapfile -t made < <(packages "$build")
  if [[ ${#made[@]} -eq 0 ]]; then
    echo "tools/package: cpack made no packages (log: $build/cpack.log)" >&2
    exit 1
  fi
  python3 -B "$root/tests/packages/hardening.py" "${made[@]}"
  if $repeat; then
    if [[ $kind == deb ]]; then
      echo "tools/package: lintian"
      quietly "$build/lintian.log" lintian --allow-root --fail-on error "${made[@]}"
    fi
    echo "tools/package: the same again in another folder ($kind)"
    again=$other/build/$(platform_of "$kind")
    make "$kind" "$other/source" "$again"
    for package in "${made[@]}"; do
      if ! cmp "$package" "$again/packages/${package##*/}"; then
        cp "$again/packages/${package##*/}" "$build/packages/${package##*/}.second"
        echo "tools/package: two builds of ${package##*/} differ (the second: $package.second)" >&2
        exit 1
      fi
    done
  fi
  cp "${made[@]}" "$output"
done
