#!/bin/bash
# Builds and runs the project of this folder: run.sh HIP|CUDA PREFIX BUILD, with hiprt installed in PREFIX.
#
# HIP: CMake looks for ROCm's files below one root, as /opt/rocm is. Debian has them in several folders, so this makes a
# root of links (CMAKE_HIP_COMPILER_ROCM_ROOT). Exit status: 77 with the reason where the compiler is missing.
set -euo pipefail

language=$1 prefix=$2 build=$3
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
rm -rf "$build"
mkdir -p "$build"
options=()
case $language in
  CUDA)
    nvcc=$(command -v nvcc || true)
    if [[ -z $nvcc && -x /usr/local/cuda/bin/nvcc ]]; then nvcc=/usr/local/cuda/bin/nvcc; fi
    if [[ -z $nvcc ]]; then
      echo "SKIPPED: no nvcc (CUDA toolkit)"
      exit 77
    fi
    options+=(-DHIPRT_GPU=NVIDIA -DCMAKE_CUDA_ARCHITECTURES=90 "-DCMAKE_CUDA_COMPILER=$nvcc")
    ;;
  HIP)
    if ! command -v hipcc >/dev/null; then
      echo "SKIPPED: no hipcc (tools/install-packages gpu)"
      exit 77
    fi
    # hipcc is a script around a clang.
    compiler=$(HIP_PLATFORM=amd hipcc --offload-arch=gfx1030 --cuda-device-only -v -c -x hip /dev/null \
      -o /dev/null 2>&1 | sed -n 's/^ "\(.*\)clang[-0-9]*" -cc1 .*/\1clang++/p' | head -1)
    options+=(-DHIPRT_GPU=AMD -DCMAKE_HIP_ARCHITECTURES=gfx1030 "-DCMAKE_HIP_COMPILER=$compiler")
    if [[ ! -d /opt/rocm/lib/cmake/hip-lang ]]; then
      root=$build/rocm
      mkdir -p "$root/lib/cmake"
      for package in hip hip-lang amd_comgr hsa-runtime64 AMDDeviceLibs; do
        folder=$(find /usr/lib /usr/share -maxdepth 4 -type d -path "*/cmake/$package" | head -1)
        if [[ -z $folder ]]; then
          echo "SKIPPED: no CMake files of $package (tools/install-packages gpu)"
          exit 77
        fi
        ln -s "$folder" "$root/lib/cmake/$package"
      done
      export CMAKE_PREFIX_PATH=$root
      libraries=$("$here/../../../cmake/hip_device_libs.sh" "$build/libraries")
      options+=("-DCMAKE_HIP_COMPILER_ROCM_ROOT=$root"
        "-DCMAKE_HIP_FLAGS=--rocm-path=/usr --rocm-device-lib-path=$libraries")
    fi
    ;;
esac
cmake -S "$here" -B "$build" -G Ninja "-DCMAKE_PREFIX_PATH=$prefix" "-DCONSUMER_LANGUAGE=$language" "${options[@]}"
# hiprt adds no warnings of its own to a user's build.
cmake --build "$build" 2>&1 | tee "$build/log"
if grep -i "warning.*hiprt" "$build/log"; then
  echo "hiprt's headers warn" >&2
  exit 1
fi
"$build/consumer"
