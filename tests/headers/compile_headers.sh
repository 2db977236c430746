#!/bin/bash
# compile_headers.sh COMPILER ARCH ROOT WORK [KERNEL...]: compiles every header of hiprt_device alone (twice in one source
# file, so that include guards are seen too), and for GPU compilers also those of hiprt_build/gpu, and each KERNEL.
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

headers_only=()
kernels_only=()
strict=(-std=c++20 -Wall -Wextra -Werror "-I$root")
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
    command=(hipcc "${strict[@]}" -Wno-unused-command-line-argument "--offload-arch=$arch"
      "--rocm-device-lib-path=$libraries" -O0)
    # Some errors of device code (a builtin that the GPU lacks) come with code generation only, which headers are not
    # enough for.
    headers_only=(--cuda-device-only -fsyntax-only)
    kernels_only=(-c -o /dev/null)
    ;;
  nvcc)
    nvcc=$(command -v nvcc || true)
    if [[ -z $nvcc && -x /usr/local/cuda/bin/nvcc ]]; then nvcc=/usr/local/cuda/bin/nvcc; fi
    [[ -n $nvcc ]] || skip "nvcc not found (CUDA toolkit): no check of NVIDIA $arch"
    suffix=cu
    # std::bit_cast, std::numeric_limits and the like are constexpr, which this flag lets device code call; hiprt::device
    # asks for it too. The host compiler sees text that cudafe++ wrote, with parentheses of its own.
    command=("$nvcc" -x cu -std=c++20 "-arch=$arch" --expt-relaxed-constexpr -Werror all-warnings
      -Xcompiler=-Wall,-Wextra,-Werror,-Wno-parentheses "-I$root" "-I$root/cmake/hip_nvidia" -c -o /dev/null)
    ;;
  *)
    echo "compile_headers.sh: unknown compiler '$compiler'" >&2
    exit 2
    ;;
esac

folders=("$root/hiprt_device")
if [[ $suffix != cpp ]]; then folders+=("$root/hiprt_build/gpu"); fi
rm -rf "$work/headers" "$work/kernels"
mkdir -p "$work/headers" "$work/kernels"
count=0
while IFS= read -r header; do
  name=${header#"$root"/}
  printf '#include <%s>\n#include <%s>\n' "$name" "$name" >"$work/headers/${name//\//__}.$suffix"
  count=$((count + 1))
done < <(find "${folders[@]}" -name '*.h' | sort)
if [[ $count -eq 0 ]]; then
  echo "no header found under ${folders[*]}" >&2
  exit 1
fi
for kernel in "$@"; do
  printf '#include "%s"\n' "$kernel" >"$work/kernels/$(basename "$kernel" .hip).$suffix"
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
# compile_all FOLDER OPTION...
compile_all() {
  find "$1" -type f | sort | xargs -P2 -I{} bash -c 'check_one "$@"' check_one {} "${command[@]}" "${@:2}"
}
if ! { compile_all "$work/headers" "${headers_only[@]}" && compile_all "$work/kernels" "${kernels_only[@]}"; }; then
  echo "$compiler $arch: not every header compiles alone"
  exit 1
fi
echo "$compiler $arch: $count files compile alone"
