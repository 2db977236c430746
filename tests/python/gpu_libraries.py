"""The libraries of tensors that the GPU tests use, behind four functions each."""

import importlib
import os

import numpy as np
import pytest


class TorchLibrary:
    def __init__(self):
        self.torch = importlib.import_module("torch")
        if not self.torch.cuda.is_available():
            pytest.skip("PyTorch finds no GPU")

    def to_gpu(self, array):
        if array.dtype == np.uint32:
            array = array.view(np.int32)
        return self.torch.from_numpy(np.array(array)).cuda()

    def to_numpy(self, tensor):
        array = tensor.cpu().numpy()
        return array.view(np.uint32) if array.dtype == np.int32 else array

    def is_own(self, tensor):
        return isinstance(tensor, self.torch.Tensor) and tensor.is_cuda

    def strided(self, tensor):
        """The same numbers with gaps between them."""
        wide = self.torch.zeros((*tensor.shape[:-1], 2 * tensor.shape[-1]), dtype=tensor.dtype, device=tensor.device)
        wide[..., ::2] = tensor
        return wide[..., ::2]


class CupyLibrary:
    def __init__(self):
        self.cupy = importlib.import_module("cupy")
        if self.cupy.cuda.runtime.getDeviceCount() == 0:
            pytest.skip("CuPy finds no GPU")

    def to_gpu(self, array):
        return self.cupy.asarray(array)

    def to_numpy(self, array):
        return self.cupy.asnumpy(array)

    def is_own(self, array):
        return isinstance(array, self.cupy.ndarray)

    def strided(self, array):
        wide = self.cupy.zeros((*array.shape[:-1], 2 * array.shape[-1]), array.dtype)
        wide[..., ::2] = array
        return wide[..., ::2]


class JaxLibrary:
    def __init__(self):
        os.environ.setdefault("XLA_PYTHON_CLIENT_PREALLOCATE", "false")  # The other libraries need memory too.
        self.jax = importlib.import_module("jax")
        self.jax.config.update("jax_enable_x64", True)
        if all(device.platform == "cpu" for device in self.jax.devices()):
            pytest.skip("JAX finds no GPU")

    def to_gpu(self, array):
        return self.jax.device_put(array, self.jax.devices()[0])

    def to_numpy(self, array):
        return np.asarray(array)

    def is_own(self, array):
        return isinstance(array, self.jax.Array) and array.device.platform != "cpu"

    def strided(self, array):
        return array  # JAX has no views.


LIBRARIES = {"torch": TorchLibrary, "cupy": CupyLibrary, "jax": JaxLibrary}


def make_library(name):
    try:
        return LIBRARIES[name]()
    except ImportError as fault:
        pytest.skip(f"{name}: {fault}")
    except Exception as fault:  # CuPy and JAX have exceptions of their own for drivers that are missing.
        pytest.skip(f"{name} finds no GPU: {fault}")
