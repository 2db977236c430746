"""Streams, contexts and lifetimes with a driver that counts them (fake_cuda.c). It needs NVRTC, and no GPU."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent


def run(mode, **more):
    done = subprocess.run([sys.executable, "-B", HERE / "fake_driver.py", mode], env={**os.environ, **more},
                          capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


def test_streams_and_lifetimes(tmp_path):
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        pytest.skip("no C compiler")
    cache = {"XDG_CACHE_HOME": os.fspath(tmp_path / "cache")}
    # NVRTC asks a driver that is loaded for more than the fake one has. So it compiles before.
    status, text = run("compile", **cache)
    if "cannot load NVRTC" in text:
        pytest.skip("no NVRTC")
    assert status == 0, text
    subprocess.run([compiler, "-shared", "-fPIC", "-O1", "-o", tmp_path / "libcuda.so.1", HERE / "fake_cuda.c"],
                   check=True)
    status, text = run("run", LD_LIBRARY_PATH=os.fspath(tmp_path), **cache)
    assert status == 0 and "lifetimes: right" in text, text
