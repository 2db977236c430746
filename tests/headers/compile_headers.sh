#!/bin/bash
# compile_headers.sh COMPILER ARCH ROOT WORK [KERNEL...]: compiles every header of hiprt_device alone (twice in one
# source file, so that include guards are seen too), and for GPU compilers also those of hiprt_build/gpu, and each
# KERNEL.
#
# With HIPRT_HEADERS_TOGETHER=1 a GPU compiler compiles no header alone (tools/check without --all: g++ and clang++ do),
# and inlining is not forced: hipcc then needs a third of the time. Kernels of other tests have forced inlining.
#
# Only for the last architecture each header is compiled alone, headers of hiprt_device as device code only (the other
# compilers see them as host code). A source with all headers, and the KERNELs, are compiled completely for all
# architectures.
#
# COMPILER is g++, clang++, hipcc or nvcc; ARCH is x86-64, x86-64-v3, sm_90, ..., for hipcc one or more, gfx90a,gfx1030.
# ROOT is the repository, WORK a folder for the generated sources, KERNEL a source file. Exit status: 0, 1 (a file
# failed; its messages are printed) or 77 (no such compiler here).
set -euo pipefail

if [[ $# -lt 4 ]]; then
  echo "usage: compile_headers.sh COMPILER ARCH ROOT WORK [KERNEL...]" >&2
  exit 2
fi
compiler=$1 arch=$2 root=$(realpath "$3") work=$4
shift 4

skip() {
  echo "SKIPPED: $*"
  exit 77
}

device_headers=()
runtime_headers=()
whole=()
includes=("-I$root" "-I$root/hiprt_device/compat")
strict=(-std=c++20 -Wall -Wextra -Werror "${includes[@]}")
case $compiler in
  g++ | clang++)
    command -v "$compiler" >/dev/null || skip "$compiler not found"
    suffix=cpp
    command=("$compiler" "${strict[@]}" -Wconversion -Wshadow "-march=$arch" -fsyntax-only)
    ;;
  hipcc)
    command -v hipcc >/dev/null || skip "hipcc not found (Debian package hipcc): no check of AMD $arch"
    libraries=$(bash "$root/cmake/hip_device_libs.sh" "$work/device-libs") || skip "$libraries"
    # hipcc would turn to CUDA by itself where it finds nvcc.
    export HIP_PLATFORM=amd
    suffix=hip
    command=(hipcc "${strict[@]}" -Wno-unused-command-line-argument "--rocm-device-lib-path=$libraries" -O0)
    # Some errors of device code (a builtin that the GPU lacks) come with code generation only, which headers are not
    # enough for.
    device_headers=("--offload-arch=${arch##*,}" --cuda-device-only -fsyntax-only)
    runtime_headers=("${device_headers[@]}")
    whole=("--offload-arch=$arch" -c -o /dev/null)
    ;;
  nvcc)
    nvcc=$(command -v nvcc || true)
    if [[ -z $nvcc && -x /usr/local/cuda/bin/nvcc ]]; then nvcc=/usr/local/cuda/bin/nvcc; fi
    [[ -n $nvcc ]] || skip "nvcc not found (CUDA toolkit): no check of NVIDIA $arch"
    suffix=cu
    # std::bit_cast, std::numeric_limits and the like are constexpr, which this flag lets device code call;
    # hiprt::device asks for it too. The host compiler sees text that cudafe++ wrote, with parentheses of its own.
    command=("$nvcc" -x cu -std=c++20 "-arch=$arch" --expt-relaxed-constexpr -Werror all-warnings
      -Xcompiler=-Wall,-Wextra,-Werror,-Wno-parentheses "${includes[@]}" "-I$root/cmake/hip_nvidia" -o /dev/null)
    device_headers=(-ptx)
    runtime_headers=(-c)
    whole=(-c)
    ;;
  *)
    echo "compile_headers.sh: unknown compiler '$compiler'" >&2
    exit 2
    ;;
esac

rm -rf "$work"/{device,runtime,whole}
mkdir -p "$work"/{device,runtime,whole}
count=0
# add_headers KIND FOLDER
add_headers() {
  local header name found=$count
  while IFS= read -r header; do
    name=${header#"$root"/}
    printf '#include <%s>\n#include <%s>\n' "$name" "$name" >"$work/$1/${name//\//__}.$suffix"
    # hiprtew.h takes the place of hiprt.h: a source has one of them.
    if [[ ${#whole[@]} -gt 0 && $name != */hiprtew.h ]]; then
      printf '#include <%s>\n' "$name" >>"$work/whole/all_headers.$suffix"
    fi
    count=$((count + 1))
  done < <(find "$2" -name '*.h' | sort)
  if [[ $count -eq $found ]]; then
    echo "no header found under $2" >&2
    exit 1
  fi
}
add_headers device "$root/hiprt_device"
if [[ $suffix != cpp ]]; then add_headers runtime "$root/hiprt_build/gpu"; fi
for kernel in "$@"; do
  printf '#include "%s"\n' "$kernel" >"$work/whole/$(basename "$kernel" .hip).$suffix"
  count=$((count + 1))
done

# Two at a time; each failure prints its command's output in one piece.
check_one() {
  source=$1
  shift
  if ! messages=$("$@" "$source" 2>&1); then
    printf 'FAILED: %s\n%s\n' "$(basename "$source")" "$messages"
    return 1
  fi
}
export -f check_one
# compile_all KIND OPTION...
compile_all() {
  find "$work/$1" -type f | sort | xargs -r -P2 -I{} bash -c 'check_one "$@"' check_one {} "${command[@]}" "${@:2}"
}
if [[ ${HIPRT_HEADERS_TOGETHER:-0} == 1 && $suffix != cpp ]]; then
  rm "$work"/{device,runtime}/*
  whole+=(-DHIPRT_LEAVE_INLINING)
fi
if ! { compile_all device "${device_headers[@]}" && compile_all runtime "${runtime_headers[@]}" &&
  compile_all whole "${whole[@]}"; }; then
  echo "$compiler $arch: not every header compiles"
  exit 1
fi
echo "$compiler $arch: $count files compile"
