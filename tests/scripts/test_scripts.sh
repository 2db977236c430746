#!/bin/bash
# test_scripts.sh ROOT: the command lines of tools/quickstart, check, fuzz, chroot, package and install-packages, up to
# where they would begin to install or to build.
set -uo pipefail

# shellcheck source=tests/scripts/expect.sh
source "$(dirname "${BASH_SOURCE[0]}")/expect.sh"

root=$1

expect 0 "^usage: tools/chroot" "$root/tools/chroot" --help
expect 2 "SUITE and COMMAND are missing" "$root/tools/chroot" trixie
expect 2 "'../x' is not a name of a release" "$root/tools/chroot" ../x true
expect 2 "needs the name of a release" "$root/tools/check" --suite
expect 2 "needs a positive number" "$root/tools/fuzz" --seconds 0
expect 2 "needs a positive number" "$root/tools/fuzz" --together
expect 2 "name aarch64, mingw or refused" "$root/tools/cross"
expect 2 "must be AMD, NVIDIA or OFF" "$root/tools/package" --gpu INTEL
for script in cross package quickstart check fuzz install-packages; do
  expect 0 "^usage: tools/$script" "$root/tools/$script" --help
  expect 2 "unknown .*'--bad'" "$root/tools/$script" --bad
done
expect 2 "unknown argument 'nogroup'" "$root/tools/install-packages" nogroup
expect 1 "no such file: $work/none.obj" "$root/tools/quickstart" --no-install "$work/none.obj"
expect 1 "not a file: $work" "$root/tools/quickstart" --no-install "$work"
expect 2 "one model at a time" "$root/tools/quickstart" a.obj b.obj
if [[ $(id -u) -ne 0 ]]; then
  touch "$work/secret.obj"
  chmod 0 "$work/secret.obj"
  expect 1 "cannot be read" "$root/tools/quickstart" --no-install "$work/secret.obj"
fi
# Outside Debian the packages are named.
mkdir "$work/bin"
ln -s "$(command -v bash)" "$work/bin/bash"
expect 1 "build: g++" env PATH="$work/bin" "$root/tools/install-packages" build

end
