#!/bin/bash
# compile_fail.sh COMPILER ROOT SOURCE...: each source fails to compile with -DHIPRT_FAULT=1. The first error that the
# compiler prints matches the regular expression of the source's first line (// expect: ...). g++ shows that it compiles
# with -DHIPRT_FAULT=0.
#
# COMPILER is g++, clang++, hipcc or nvcc. Exit status: 0, 1 (a fault, which is printed) or 77 (no such compiler here).
set -uo pipefail

if [[ $# -lt 3 ]]; then
  echo "usage: compile_fail.sh COMPILER ROOT SOURCE..." >&2
  exit 2
fi
compiler=$1 root=$2
shift 2
# first_error MESSAGES. awk reads to the end: a reader that stops early kills its writer, which pipefail reports.
first_error() {
  awk '/error/ && !seen { print; seen = 1 }' <<<"$1"
}

if [[ $compiler == nvcc && -z $(command -v nvcc) && -x /usr/local/cuda/bin/nvcc ]]; then
  PATH=$PATH:/usr/local/cuda/bin
fi
if ! command -v "$compiler" >/dev/null; then
  echo "SKIPPED: $compiler not found"
  exit 77
fi
command=("$compiler" -std=c++20 -Wall -Wextra -Werror "-I$root" -fsyntax-only)
case $compiler in
  hipcc)
    export HIP_PLATFORM=amd
    command+=(-x hip --cuda-host-only --offload-arch=gfx1030 -Wno-unused-command-line-argument)
    ;;
  nvcc)
    # Device code only: what nvcc's host compiler would say is g++'s.
    command=(nvcc -x cu -std=c++20 --expt-relaxed-constexpr -arch=sm_90 "-I$root" "-I$root/cmake/hip_nvidia" -ptx
      -o /dev/null)
    ;;
esac

faults=0
for source in "$@"; do
  name=$(basename "$source")
  expected=$(sed -n '1s|^// expect: ||p' "$source")
  if [[ -z $expected ]]; then
    echo "FAILED: $name does not say what to expect"
    faults=$((faults + 1))
    continue
  fi
  if [[ $compiler == g++ ]] && ! messages=$("${command[@]}" -DHIPRT_FAULT=0 "$source" 2>&1); then
    printf 'FAILED: %s does not compile without its fault:\n%s\n' "$name" "$messages"
    faults=$((faults + 1))
  fi
  # "// with: ..." on the second line: options of the fault.
  read -r -a with < <(sed -n '2s|^// with: ||p' "$source") || true
  if messages=$("${command[@]}" "${with[@]}" -DHIPRT_FAULT=1 "$source" 2>&1); then
    echo "FAILED: $name compiles with its fault"
    faults=$((faults + 1))
  elif ! grep -Eq -- "$expected" <<<"$(first_error "$messages")"; then
    printf 'FAILED: %s: the first error is not "%s":\n%s\n' "$name" "$expected" "$messages"
    faults=$((faults + 1))
  fi
done
echo "$compiler: $# sources, $faults faults"
[[ $faults -eq 0 ]]
