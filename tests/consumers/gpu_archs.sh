#!/bin/bash
# gpu_archs.sh CMAKE ROOT: CMake takes the architectures of GPU code in the ways that users write them, and refuses
# others by name. Exit status: 0, or 1 (a fault, which is printed).
set -uo pipefail
cmake=$1
root=$2
faults=0

# configure VARIABLE VALUE: as the first lines of a configuration, without a compiler.
configure() { "$cmake" "-D$1=$2" -DHIPRT_GPU=OFF -P "$root/cmake/HiprtGpu.cmake" 2>&1; }

takes() {
  local output
  if ! output=$(configure "$1" "$2"); then
    printf 'FAILED: %s=%s is refused:\n%s\n' "$1" "$2" "$output"
    faults=$((faults + 1))
  fi
}
refuses() {
  local output
  if output=$(configure "$1" "$2") || [[ $(tr -s ' \n' ' ' <<<"$output") != *"$1: '$3' is no architecture."* ]]; then
    printf "FAILED: %s=%s does not name '%s':\n%s\n" "$1" "$2" "$3" "$output"
    faults=$((faults + 1))
  fi
}

for good in 80 90a 120f sm_90 "80;sm_90;120" ""; do takes HIPRT_NVIDIA_ARCHS "$good"; done
for good in gfx90a "gfx942:sramecc+:xnack-" "gfx1030;gfx1100" ""; do takes HIPRT_AMD_ARCHS "$good"; done
refuses HIPRT_NVIDIA_ARCHS 9.0 9.0
refuses HIPRT_NVIDIA_ARCHS "80;compute_90" compute_90
refuses HIPRT_NVIDIA_ARCHS "80 90" "80 90"
refuses HIPRT_NVIDIA_ARCHS native native
refuses HIPRT_AMD_ARCHS 1030 1030
refuses HIPRT_AMD_ARCHS "gfx1030,gfx1100" "gfx1030,gfx1100"
[[ $faults -eq 0 ]]
