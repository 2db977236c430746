#!/bin/bash
# Installs packages on a fresh machine and uses them as a user would. For tools/package --check, in a clean chroot.
# usage: use.sh deb|archive: the packages are in /hiprt/files. Changes the system.
set -euo pipefail

kind=$1
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
consumers=$here/../consumers
work=$(mktemp -d)
cd "$work"

fail() {
  echo "tests/packages/use.sh: $*" >&2
  exit 1
}
apt() {
  apt-get -qq -o Dpkg::Use-Pty=0 "$@" >apt.log 2>&1 || {
    cat apt.log >&2
    fail "apt-get $*"
  }
}

apt update
prefix=/usr
if [[ $kind == deb ]]; then
  apt install -y --no-install-recommends /hiprt/files/hiprt-tools_*.deb
else
  mkdir unpacked
  tar -xf /hiprt/files/hiprt-*.tar.gz -C unpacked
  prefix=$(echo "$work"/unpacked/*)
  export PATH=$prefix/bin:$PATH
fi

echo "the tools"
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n' >corner.obj
bvhbuild corner.obj -o corner.bvh
bvhinfo --validate corner.bvh >info.txt
# One ray from (0.25, 0.25, 1) down: it hits the triangle 0 at t = 1.
zero='\0\0\0\0' one='\0\0\x80\x3f' quarter='\0\0\x80\x3e'
printf "\x01\0\0\0\0\0\0\0$quarter$quarter$one$zero$zero$zero\0\0\x80\xbf\0\0\x80\x7f" >ray.bin
bvhtrace corner.bvh --rays ray.bin --hits hit.bin >trace.txt
printf "$one$zero" | cmp - hit.bin || fail "bvhtrace found another hit"
printf "\x01\0\0\0\x03\0\0\0$quarter$quarter$one" >point.bin
bvhquery corner.bvh --points point.bin -o near.bin >query.txt
bvhrender corner.bvh -o corner.png --size 64x48 --spp 1
[[ -s corner.png ]] || fail "no picture"
for tool in bvhbuild bvhinfo bvhquery bvhrender bvhtrace; do
  "$tool" --version | grep -q "^$tool " || fail "$tool --version"
done

echo "manual pages and completions"
for tool in bvhbuild bvhinfo bvhquery bvhrender bvhtrace; do
  zcat "$(find "$prefix/share/man" -name "$tool.1.gz")" | grep -q "^.SH EXAMPLES" || fail "no manual page of $tool"
  bash -n "$prefix/share/bash-completion/completions/$tool" || fail "no completion of $tool"
done

echo "projects that use the library"
apt install -y --no-install-recommends g++ cmake ninja-build pkg-config libglm-dev libexpected-dev libtbb-dev
if [[ $kind == deb ]]; then
  apt install -y --no-install-recommends /hiprt/files/libhiprt-build2_*.deb /hiprt/files/libhiprt-dev_*.deb
fi
# project FOLDER PROGRAM OPTION...
project() {
  local build=$work/${1##*/}-$2
  cmake -S "$1" -B "$build" -G Ninja "-DCMAKE_PREFIX_PATH=$prefix" "${@:3}" >"$build.log" 2>&1 &&
    cmake --build "$build" --target "$2" >>"$build.log" 2>&1 && "$build/$2" || {
    cat "$build.log" >&2
    fail "$1: $2"
  }
}
project "$consumers/find_package" consumer
if [[ $kind == deb ]]; then project "$consumers/find_package" consumer_static; fi
project "$consumers/device_only" consumer
project "$consumers/tools" consumer

echo "pkg-config"
PKG_CONFIG_PATH=$(find "$prefix" -name pkgconfig -type d | paste -sd:)
export PKG_CONFIG_PATH
g++ -std=c++20 "$consumers/one_triangle.cpp" $(pkg-config --cflags --libs hiprt-build) -o one_triangle
LD_LIBRARY_PATH=$prefix/lib ./one_triangle
g++ -std=c++20 "$consumers/device_only/device_only.cpp" $(pkg-config --cflags --libs hiprt-format) -o device_only
./device_only
# Packages without GPU code do not have it.
library=$(find /hiprt/files -name 'libhiprt0300164_*.deb')
if [[ -n $library ]]; then
  echo "the library for programs of HIPRT"
  apt install -y --no-install-recommends "$library"
  g++ -std=c++17 -I "$prefix/include/hiprt_compat" "$consumers/hiprt_library.cpp" -l:libhiprt0300164.so -o hiprt_library
  ./hiprt_library
fi
echo "All of the $kind works."
