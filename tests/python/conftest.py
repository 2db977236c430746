"""Fixtures of the tests of the Python module. Random input has a fixed seed, which pytest prints first."""

import os

import numpy as np
import pytest

SEED = int(os.environ.get("HIPRT_TEST_SEED", "20261127"))


def pytest_report_header():
    import hiprt
    return f"hiprt {hiprt.__version__} ({hiprt.__file__}), numpy {np.__version__}, HIPRT_TEST_SEED={SEED}"


@pytest.fixture
def rng():
    return np.random.default_rng(SEED)
