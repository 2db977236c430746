#!/bin/bash
# run_gpu_test.sh MODE ARCH AMDRUN PROGRAM [ARGUMENT...]: runs a GPU program on a GPU of that architecture, or on the
# CPU of a machine without one.
#
# MODE: amd       on an AMD GPU of architecture ARCH (gfx1030, ...) if there is one, else through AMDRUN
#       amd-asan  through AMDRUN with its check of out-of-bounds accesses
#       nvidia    on an NVIDIA GPU of architecture ARCH (sm_90, ...)
#       none      directly, on a machine without any GPU
#       prepare   (no PROGRAM) lets AMDRUN build its runtime
# AMDRUN may be empty. Through AMDRUN the program gets HIPRT_EMULATED_CASES as one more argument. Its value none: other
# tests run the cases. left: the quick set (tools/check without --all) leaves the test out.
# The program finds ARCH in HIPRT_TEST_GPU_ARCH. Exit status: the program's, or 77 with the reason when it cannot run.
set -euo pipefail

if [[ $# -lt 3 ]]; then
  echo "usage: run_gpu_test.sh amd|amd-asan|nvidia|none|prepare ARCH AMDRUN PROGRAM [ARGUMENT...]" >&2
  exit 2
fi
mode=$1 arch=$2 amdrun=$3
shift 3
export HIPRT_TEST_GPU_ARCH=$arch

skip() {
  echo "SKIPPED: $*"
  exit 77
}

# skip_left_out WHY: skips a test without emulated cases.
skip_left_out() {
  case ${HIPRT_EMULATED_CASES:-} in
    none) skip "$1" ;;
    left) skip "not in the quick set (tools/check --all emulates it)" ;;
  esac
}

# The architectures of this machine's AMD GPUs, from numbers like 90010 (gfx90a) and 100300 (gfx1030).
amd_gpus() {
  local version
  [[ -e /dev/kfd ]] || return 0
  for version in $(sed -n 's/^gfx_target_version //p' /sys/class/kfd/kfd/topology/nodes/*/properties 2>/dev/null); do
    if ((version > 0)); then printf 'gfx%d%x%x\n' $((version / 10000)) $((version / 100 % 100)) $((version % 100)); fi
  done
}

# Compute capabilities as sm_90; empty if nobody can say.
nvidia_gpus() {
  nvidia-smi --query-gpu=compute_cap --format=csv,noheader 2>/dev/null | sed 's/^/sm_/; s/\.//' || true
}

case $mode in
  prepare)
    if [[ -x $amdrun ]]; then exec "$amdrun" --arch gfx1030 -- true; fi
    echo "amdrun is not here; nothing to prepare"
    ;;
  amd)
    if grep -qx "$arch" <<<"$(amd_gpus)"; then exec "$@"; fi
    [[ -x $amdrun ]] || skip "no AMD $arch GPU here and no amdrun (HIPRT_AMDRUN='$amdrun')"
    skip_left_out "no AMD $arch GPU here; amdrun runs it for another architecture"
    exec "$amdrun" --arch "$arch" -- "$@" ${HIPRT_EMULATED_CASES:+"$HIPRT_EMULATED_CASES"}
    ;;
  amd-asan)
    [[ -x $amdrun ]] || skip "no amdrun (HIPRT_AMDRUN='$amdrun'), which checks for out-of-bounds accesses"
    skip_left_out "amdrun checks for out-of-bounds accesses in other tests"
    exec "$amdrun" --arch "$arch" --asan -- "$@" ${HIPRT_EMULATED_CASES:+"$HIPRT_EMULATED_CASES"}
    ;;
  nvidia)
    [[ -e /dev/nvidiactl ]] || skip "no NVIDIA GPU here"
    gpus=$(nvidia_gpus)
    if [[ -n $gpus ]] && ! grep -qx "$arch" <<<"$gpus"; then skip "no NVIDIA $arch GPU here, but $gpus"; fi
    exec "$@"
    ;;
  none)
    [[ ! -e /dev/kfd && ! -e /dev/nvidiactl ]] || skip "there is a GPU here"
    exec "$@"
    ;;
  *)
    echo "run_gpu_test.sh: unknown mode '$mode'" >&2
    exit 2
    ;;
esac
