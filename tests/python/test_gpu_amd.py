"""AMD's code of the queries, executed on the CPU by amdrun: kernels of hipRTC, the HIP driver's calls, DLPack."""

import ctypes.util
import glob
import os
import subprocess
import sys
from pathlib import Path

import pytest


def runtime_with_compiler():
    """AMD's runtime of Debian 12, which has hipRTC, or None. amdrun's runtime takes its name, and has none."""
    for path in glob.glob("/usr/lib/*/libamdhip64.so.5"):
        return path
    return None


def test_queries_have_the_bits_of_the_cpu(tmp_path):
    amdrun = os.environ.get("HIPRT_AMDRUN", "")
    if not os.access(amdrun, os.X_OK):
        pytest.skip(f"no amdrun (HIPRT_AMDRUN='{amdrun}')")
    if ctypes.util.find_library("hiprtc") is None:
        runtime = runtime_with_compiler()
        if runtime is None:
            pytest.skip("no hipRTC (Debian: libamdhip64-5)")
        (tmp_path / "libhiprtc.so").symlink_to(runtime)
    here = Path(__file__).resolve().parent
    path = [os.fspath(tmp_path), *filter(None, [os.environ.get("LD_LIBRARY_PATH")])]
    size = ["quick"] if os.environ.get("HIPRT_TEST_SET") == "quick" else []
    program = [sys.executable, "-B", here / "emulated_gpu.py", "64", *size]
    done = subprocess.run([amdrun, "--arch", "gfx1030", "--", *program],
                          env={**os.environ, "LD_LIBRARY_PATH": ":".join(path)}, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("the same bits") == (4 if size else 7)
