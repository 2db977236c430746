#!/bin/bash
# install.sh CMAKE BUILD PREFIX: installs the build into an empty prefix and looks at what arrived.
set -euo pipefail

cmake=$1 build=$2 prefix=$3
rm -rf "$prefix"
"$cmake" --install "$build" --prefix "$prefix" >/dev/null
cd "$prefix"

status=0
expect() {
  if ! compgen -G "$1" >/dev/null; then
    echo "not installed: $1"
    status=1
  fi
}
for tool in bvhbuild bvhinfo bvhquery bvhtrace bvhrender; do expect "bin/$tool"; done
expect 'include/hiprt_device/hiprt_device.h'
expect 'include/hiprt_device/format/node.h'
expect 'include/hiprt_build/build.h'
if [[ -z $(find . -name hiprtConfigVersion.cmake) ]]; then
  echo "not installed: hiprtConfigVersion.cmake"
  status=1
fi
if stray=$(find include -type f ! -name '*.h' | grep .); then
  printf 'installed among the headers by mistake:\n%s\n' "$stray"
  status=1
fi
# Every public header finds what it includes in the installed tree.
while IFS=: read -r header name; do
  if [[ ! -f include/$name ]]; then
    echo "$header includes $name, which is not installed"
    status=1
  fi
done < <(grep -rEo '^ *# *include <hiprt_[a-z]+/[^>]*' include | sed 's/: *# *include </:/')
"bin/bvhinfo" --version || status=1
exit $status
