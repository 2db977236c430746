#!/bin/bash
# Compiles hiprt for another processor or system and runs it in an emulator. For tools/cross, in a chroot: it installs
# packages. usage: check.sh aarch64|mingw|refused
set -euo pipefail

target=$1
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
build=$root/build/cross-$target
jobs=${HIPRT_JOBS:-$(nproc)}
log=$build.log
mkdir -p "$root/build"

# quietly COMMAND...: prints the end of the log when the command fails.
quietly() {
  if ! "$@" >"$log" 2>&1; then
    tail -60 "$log" >&2
    echo "tools/cross: failed: ${*:1:5}" >&2
    exit 1
  fi
}
install() {
  quietly apt-get update
  quietly apt-get install -y --no-install-recommends "$@"
}

check_aarch64() {
  dpkg --add-architecture arm64
  install cmake ninja-build crossbuild-essential-arm64 qemu-user libglm-dev libcli11-dev nlohmann-json3-dev \
    libexpected-dev fonts-dejavu-core python3 git \
    libtbb-dev:arm64 libopenexr-dev:arm64 libxxhash-dev:arm64 libzstd-dev:arm64 \
    libtinygltf-dev:arm64 libpng-dev:arm64 libfreetype-dev:arm64 libgmp-dev:arm64 catch2 libembree-dev:arm64
  quietly cmake -S "$root/tests/cross" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCROSS_TESTS=ON \
    "-DCMAKE_TOOLCHAIN_FILE=$root/cmake/toolchains/aarch64.cmake" \
    "-DCMAKE_CXX_FLAGS_RELEASE=-O2 -DNDEBUG -DHIPRT_CHECKS_SLOW=1" \
    -DHIPRT_GPU=OFF -DHIPRT_FORCE_INLINING=OFF -DHIPRT_OPTIMIZE_COLD_CODE=OFF \
    -DHIPRT_TEST_SET=quick -DHIPRT_WARNINGS_AS_ERRORS=ON
  quietly cmake --build "$build" -j "$jobs"
  echo "aarch64: the library, the tools and the tests compile"
  ctest --test-dir "$build" -R '^smoke$' --output-on-failure | tail -3
  qemu-aarch64 "$build/hiprt/tools/bvhinfo" --version
  # The numeric tests. Others are left out: some start compilers or hiprt's programs, and for programs the kernel would
  # have to know the emulator. Some limit memory, which qemu does not. Some build large meshes and take longer.
  ctest --test-dir "$build" -j "$jobs" --timeout 600 --output-on-failure \
    -L unit -LE threads -E '^(examples|.*_v3|build_quality|tools_.*|render_.*|farm_.*|fault_.*)$' | tail -70
}

check_mingw() {
  local include=$build/headers
  install cmake ninja-build g++-mingw-w64-x86-64-posix wine64 libglm-dev nlohmann-json3-dev libexpected-dev \
    libxxhash-dev
  # Headers without code. /usr/include itself has Linux's headers.
  rm -rf "$include"
  mkdir -p "$include/include" "$include/share/cmake"
  for name in glm tl nlohmann xxhash.h; do ln -s "/usr/include/$name" "$include/include/$name"; done
  for name in glm tl-expected nlohmann_json; do
    cp -rL "$(find /usr/share/cmake /usr/lib -type d -path "*cmake/$name" | head -1)" "$include/share/cmake/"
  done
  quietly cmake -S "$root/tests/cross" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    "-DCMAKE_TOOLCHAIN_FILE=$root/cmake/toolchains/mingw.cmake" "-DCMAKE_PREFIX_PATH=$include" \
    "-DHIPRT_XXHASH_INCLUDE_DIR=$include/include" -DHIPRT_THREADS=std -DHIPRT_EMBREE=OFF -DHIPRT_GPU=OFF \
    -DHIPRT_FORCE_INLINING=OFF -DHIPRT_WARNINGS_AS_ERRORS=ON
  quietly cmake --build "$build" -j "$jobs"
  echo "mingw: hiprt::device, hiprt::format and hiprt::build compile"
  if x86_64-w64-mingw32-g++-posix -std=c++20 "-I$root" "-I$include/include" -fsyntax-only \
    "$root/tests/cross/smoke.cpp" >"$log" 2>&1 || ! grep -q "compile with -mfma" "$log"; then
    echo "tools/cross: the headers compile without -mfma, whose fma() is not exact" >&2
    exit 1
  fi
  export WINEPREFIX=$build/wine WINEDEBUG=-all
  ctest --test-dir "$build" -R '^smoke$' --output-on-failure | tail -3
}

check_refused() {
  install cmake ninja-build clang g++-s390x-linux-gnu g++-arm-linux-gnueabihf g++-i686-linux-gnu
  "$root/tests/cross/refused.sh" "$root"
}

"check_$target"
echo "tools/cross: $target works"
