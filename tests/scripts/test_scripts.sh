#!/bin/bash
# test_scripts.sh ROOT: the command lines of tools/quickstart, tools/check and tools/install-packages, up to where they
# would begin to install or to build.
set -uo pipefail

root=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
faults=0

# expect STATUS PATTERN COMMAND...: exit status and some text of the output.
expect() {
  local status=$1 pattern=$2 output actual
  shift 2
  output=$("$@" 2>&1)
  actual=$?
  if [[ $actual -ne $status ]] || ! grep -q -- "$pattern" <<<"$output"; then
    printf 'FAILED: %s\n  exit status %s (wanted %s), output (wanted "%s"):\n%s\n' "$*" "$actual" "$status" "$pattern" \
      "$output"
    faults=$((faults + 1))
  fi
}

for script in quickstart check install-packages; do
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

echo "$faults faults"
exit $((faults != 0))
