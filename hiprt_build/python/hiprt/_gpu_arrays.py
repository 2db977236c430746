"""Tensors of PyTorch, CuPy, JAX and other libraries in the memory of a GPU: views of them, and new ones."""

from __future__ import annotations

import math
import sys
from contextlib import nullcontext
from importlib import import_module
from typing import Any, ContextManager, NamedTuple, Optional

import numpy as np

from . import _core
from ._errors import GpuError, InputError

# DLDeviceType of dlpack.h.
_CUDA_DEVICES = (2, 13)  # kDLCUDA, kDLCUDAManaged
_HIP_DEVICE = 10  # kDLROCM
_BYTES = {"float32": 4, "float64": 8, "uint32": 4, "int32": 4, "uint8": 1, "bool": 1}
# NumberKind of gpu/device/batch.h.
_KINDS = {"float32": 0, "float64": 1, "uint32": 2, "int32": 2}
_REALS = ("float32", "float64")


class Device(NamedTuple):
    """A device of a driver."""

    is_hip: bool
    number: int

    def __str__(self) -> str:
        return f"{'rocm' if self.is_hip else 'cuda'}:{self.number}"


class View(NamedTuple):
    """A tensor's memory. Strides are in bytes."""

    address: int
    shape: tuple[int, ...]
    strides: tuple[int, ...]
    type: str
    owner: Any
    """Keeps the memory alive."""


class GpuArray:
    """A new array in the memory of a GPU, for libraries that hiprt does not know. It has DLPack's methods and
    __cuda_array_interface__."""

    __slots__ = ("_memory", "_address", "_point", "_device", "shape", "dtype")

    def __init__(self, memory: Any, address: int, point: Any, device: Device, shape: tuple[int, ...],
                 kind: str) -> None:
        self._memory, self._address, self._point, self._device = memory, address, point, device
        self.shape = shape
        self.dtype = np.dtype(kind)

    def __dlpack_device__(self) -> tuple[int, int]:
        return (_HIP_DEVICE if self._device.is_hip else _CUDA_DEVICES[0]), self._device.number

    def __dlpack__(self, *, stream: Optional[int] = None, **_: Any) -> Any:
        """A capsule. The stream waits for the results; None: the legacy default stream; -1: nothing waits."""
        if stream != -1:
            self._point.let_wait(stream or 0)
        return _core.gpu_tensor(self._memory, self._address, list(self.shape), str(self.dtype))

    @property
    def __cuda_array_interface__(self) -> dict[str, Any]:
        self._point.synchronize()
        return {"shape": self.shape, "typestr": self.dtype.str, "data": (self._address, False), "strides": None,
                "version": 3, "stream": None}

    def __repr__(self) -> str:
        return f"hiprt.GpuArray(shape={self.shape}, dtype={self.dtype}, device={self._device})"


def is_on_gpu(values: Any) -> bool:
    """Whether a tensor is in the memory of a GPU of NVIDIA or AMD. It asks no driver."""
    if values is None or type(values) in (float, int, np.ndarray, list, tuple):
        return False
    if hasattr(values, "__dlpack_device__"):
        try:
            return int(values.__dlpack_device__()[0]) in (*_CUDA_DEVICES, _HIP_DEVICE)
        except BufferError as fault:  # For example a JAX array on several devices.
            raise InputError(f"a tensor cannot be shared by DLPack: {fault}") from fault
    return hasattr(values, "__cuda_array_interface__")


def device_named(name: Any) -> Optional[Device]:
    """The device of "cuda", "cuda:1", "rocm:0", or an object with such a text (torch.device); None: the CPU."""
    kind, colon, number = str(name).partition(":")
    if kind == "cpu" and not colon:
        return None
    if kind not in ("cuda", "rocm") or colon and not (number.isascii() and number.isdigit()):
        raise InputError(f"device: expected 'cpu', 'cuda', 'cuda:N', 'rocm' or 'rocm:N', found {str(name)!r}")
    return Device(kind == "rocm", int(number or 0))


def device_of(values: Any, name: str) -> Device:
    """The device of a tensor. Raises GpuError without a driver, if only the driver knows."""
    if hasattr(values, "__dlpack_device__"):
        kind, number = values.__dlpack_device__()
        return Device(int(kind) == _HIP_DEVICE, int(number))
    address = _interface_of(values, name).address
    try:
        return Device(False, _core.gpu_device_of(False, address) if address else 0)
    except GpuError as no_cuda:
        try:
            return Device(True, _core.gpu_device_of(True, address) if address else 0)
        except GpuError:
            raise no_cuda from None


def _interface_of(values: Any, name: str) -> View:
    """The view of an object with __cuda_array_interface__."""
    entries = values.__cuda_array_interface__
    if entries.get("mask") is not None:
        raise InputError(f"{name}: __cuda_array_interface__ has a mask, and masked arrays are not supported")
    dtype, shape = np.dtype(entries["typestr"]), tuple(int(length) for length in entries["shape"])
    strides = entries.get("strides")
    if strides is None:
        steps = [dtype.itemsize * math.prod(shape[d + 1:]) for d in range(len(shape))]
    else:
        steps = [int(stride) for stride in strides]
    kind = dtype.name if dtype.isnative else f"{dtype.name} in another byte order"
    return View(int(entries["data"][0]), shape, tuple(steps), kind, values)


def _dlpack_view(values: Any, name: str, handover: int) -> View:
    try:
        capsule = values.__dlpack__(stream=handover)
    except (AssertionError, BufferError, RuntimeError, TypeError, ValueError) as fault:
        raise InputError(f"{name}: the tensor cannot be shared by DLPack: {fault}") from fault
    view = _core.GpuView(capsule)
    size = _BYTES.get(view.type, 1)
    return View(view.address, tuple(view.shape), tuple(stride * size for stride in view.strides), view.type, view)


def view_of(values: Any, name: str, device: Device, stream: int, is_current: bool) -> View:
    """The memory of a tensor. Later work of the stream waits for what fills it.

    is_current: the stream is the current one of the tensor's library, so nothing has to wait.
    """
    if hasattr(values, "__dlpack__"):
        # DLPack names CUDA's default stream 1, and AMD's 0.
        with library_of(values).on(device):
            view = _dlpack_view(values, name, -1 if is_current else stream or int(not device.is_hip))
    else:
        view = _interface_of(values, name)
        filled = values.__cuda_array_interface__.get("stream")
        if filled is not None and int(filled) != stream:
            _core.GpuPoint(*device, int(filled)).let_wait(stream)
    size = _BYTES.get(view.type, 1)
    if view.address % size or any(stride % size for stride in view.strides):
        raise InputError(f"{name}: the numbers are not aligned to {size} bytes: make a contiguous copy of the tensor")
    return view


def real_view(view: View, name: str) -> View:
    if view.type not in _REALS:
        raise InputError(f"{name}: on a GPU numbers must be float32 or float64, found {view.type}")
    return view


def mask_view(view: View, name: str) -> View:
    if view.type not in ("uint32", "int32"):
        raise InputError(f"{name}: on a GPU masks must be uint32 or int32, found {view.type}")
    return view


def kind_of(view: View) -> int:
    return _KINDS[view.type]


class Library:
    """What results are made with. This one is for libraries that hiprt does not know."""

    name = ""
    orders_memory = False
    """Whether it has a current stream, and reuses memory in the order of that stream."""

    def __init__(self, like: Any) -> None:
        self.like = like

    def on(self, device: Device) -> ContextManager[Any]:
        """Makes the device the library's current one, which it asks of those who share its tensors."""
        del device
        return nullcontext()

    def current_stream(self, device: Device) -> Optional[int]:
        """The stream in which the library works now; None: it has none that others may use."""
        if hasattr(self.like, "__dlpack__"):
            return None
        stream = self.like.__cuda_array_interface__.get("stream")
        return None if stream is None else int(stream)

    def empty(self, parts: list[tuple[tuple[int, ...], str]], device: Device,
              stream: Any) -> tuple[list[Any], list[int]]:
        """New arrays of shapes and types, and their addresses."""
        del stream
        offsets, end = [], 0
        for shape, kind in parts:
            offsets.append(end)
            end += -(-math.prod(shape) * _BYTES[kind] // 256) * 256
        memory = _core.GpuMemory(*device, max(end, 256))
        addresses = [memory.address + (offset if offset < end else 0) for offset in offsets]
        return [(memory, address, shape, kind) for address, (shape, kind) in zip(addresses, parts)], addresses

    def finished(self, arrays: list[Any], device: Device, point: Any) -> list[Any]:
        """The results. The point is behind the work that fills them."""
        return [self.converted(GpuArray(memory, address, point, device, shape, kind))
                for memory, address, shape, kind in arrays]

    def converted(self, array: GpuArray) -> Any:
        return array

    def where(self, condition: Any, yes: Any, no: Any) -> Any:
        raise InputError(f"{type(self.like).__name__}: hiprt does not know its library, so it cannot calculate with "
                         "its arrays: pass tensors of PyTorch, CuPy or JAX")


class Jax(Library):
    name = "jax"

    def converted(self, array: GpuArray) -> Any:
        jax = import_module("jax")
        if 0 in array.shape:
            return jax.numpy.zeros(array.shape, array.dtype, device=self.like.device)
        return jax.dlpack.from_dlpack(array)

    def where(self, condition: Any, yes: Any, no: Any) -> Any:
        jax = import_module("jax")
        return jax.numpy.where(condition, yes, no)


class Ordered(Library):
    """A library that allocates the results, and reuses memory in the order of its current stream."""

    orders_memory = True

    def finished(self, arrays: list[Any], device: Device, point: Any) -> list[Any]:
        return arrays

    def where(self, condition: Any, yes: Any, no: Any) -> Any:
        return sys.modules[self.name].where(condition, yes, no)


class Torch(Ordered):
    """PyTorch. uint32 is int32, as PyTorch has few operations for uint32."""

    name = "torch"

    def on(self, device: Device) -> ContextManager[Any]:
        return sys.modules["torch"].cuda.device(device.number)

    def current_stream(self, device: Device) -> Optional[int]:
        return int(sys.modules["torch"].cuda.current_stream(device.number).cuda_stream)

    def empty(self, parts: list[tuple[tuple[int, ...], str]], device: Device,
              stream: Any) -> tuple[list[Any], list[int]]:
        torch = sys.modules["torch"]
        if stream is not None and not isinstance(stream, torch.cuda.Stream):
            handle = handle_of(stream)
            stream = (torch.cuda.ExternalStream(handle, device=device.number) if handle > 2
                      else torch.cuda.default_stream(device.number))
        with torch.cuda.stream(stream):
            arrays = [torch.empty(shape, dtype=getattr(torch, kind.replace("uint32", "int32")),
                                  device=f"cuda:{device.number}") for shape, kind in parts]
        return arrays, [array.data_ptr() for array in arrays]


class _Stream:
    """The driver's number of a stream, as NVIDIA's protocol for streams shows it."""

    def __init__(self, handle: int) -> None:
        self.handle = handle

    def __cuda_stream__(self) -> tuple[int, int]:
        return 0, self.handle


class Cupy(Ordered):
    name = "cupy"

    def on(self, device: Device) -> ContextManager[Any]:
        return sys.modules["cupy"].cuda.Device(device.number)

    def current_stream(self, device: Device) -> Optional[int]:
        return int(sys.modules["cupy"].cuda.get_current_stream(device.number).ptr)

    def empty(self, parts: list[tuple[tuple[int, ...], str]], device: Device,
              stream: Any) -> tuple[list[Any], list[int]]:
        cupy = sys.modules["cupy"]
        with self.on(device):
            current = cupy.cuda.get_current_stream()
            if stream is not None and not isinstance(stream, type(current)):
                stream = self._external(handle_of(stream), device)
            with current if stream is None else stream:
                arrays = [cupy.empty(shape, kind) for shape, kind in parts]
        return arrays, [array.data.ptr for array in arrays]

    @staticmethod
    def _external(handle: int, device: Device) -> Any:
        """A stream of another library. From version 14 on CuPy takes objects with __cuda_stream__."""
        cuda = sys.modules["cupy"].cuda
        if hasattr(cuda.Stream, "from_external"):
            return cuda.Stream.from_external(_Stream(handle))
        return cuda.ExternalStream(handle, device.number)

_LIBRARIES = {"torch": Torch, "cupy": Cupy, "jax": Jax, "jaxlib": Jax}


def library_of(values: Any) -> Library:
    for kind in type(values).__mro__:
        library = _LIBRARIES.get(kind.__module__.partition(".")[0])
        if library is not None:
            return library(values)
    return Library(values)


def handle_of(stream: Any) -> int:
    """The driver's number of a stream: of PyTorch or CuPy, with __cuda_stream__, or the number itself."""
    if isinstance(stream, int):
        return stream
    for member in ("cuda_stream", "ptr"):
        if isinstance(getattr(stream, member, None), int):
            return int(getattr(stream, member))
    if hasattr(stream, "__cuda_stream__"):
        return int(stream.__cuda_stream__()[1])
    raise InputError(f"stream: expected a stream of PyTorch or CuPy, or the number of one, found {type(stream)}")
