"""Queries of tensors in the memory of a GPU, where they are, in the order of a stream."""

from __future__ import annotations

import atexit
import glob
import math
import os
import sys
import threading
from contextlib import suppress
from typing import Any, Optional, Sequence

import numpy as np

from . import _core
from ._arrays import as_numpy, as_real, as_uint32
from ._errors import GpuError, InputError
from ._gpu_arrays import (Device, Library, View, device_of, handle_of, is_on_gpu, kind_of, library_of, mask_view,
                          real_view, view_of)

# kMostDimensions of gpu/device/batch.h.
_MOST_DIMENSIONS = 4

_lock = threading.Lock()
_streams: dict[Device, int] = {}
_kept: list[tuple[Any, Any]] = []
_is_ready = False


def on_gpu(*values: Any) -> bool:
    """Whether any of the arguments is in the memory of a GPU."""
    return any(map(is_on_gpu, values))


def refuse_stream(stream: Any) -> None:
    """For calls whose arrays are in the memory of the CPU."""
    if stream is not None:
        raise InputError("stream: none of the arrays is in the memory of a GPU")


def _find_compiler() -> None:
    """Names the copies of NVRTC that the packages of NVIDIA and CUDA's folder have, for where the loader finds none."""
    global _is_ready
    if _is_ready:
        return
    folders = [os.path.join(path, "nvidia", "*", "lib") for path in sys.path if path]
    folders += [os.path.join(os.environ[name], "lib64") for name in ("CUDA_PATH", "CUDA_HOME") if name in os.environ]
    folders.append("/usr/local/cuda/lib64")
    paths = [path for folder in folders for path in glob.glob(os.path.join(folder, "libnvrtc.so.[0-9]*"))]
    _core.gpu_set_compiler_paths([path for path in paths if "alt" not in path])
    _is_ready = True


def _own_stream(device: Device) -> int:
    with _lock:
        if device not in _streams:
            _streams[device] = _core.gpu_stream(*device)
        return _streams[device]


def _keep(point: Any, owners: Any) -> None:
    """Keeps tensors alive until the point is reached, and lets those go whose point was reached."""
    with _lock:
        done = [entry for entry in _kept if entry[0].is_done]
        _kept[:] = [entry for entry in _kept if all(entry is not other for other in done)]
        _kept.append((point, owners))
    # Here, without the lock, the tensors of `done` die.


@atexit.register
def _let_go() -> None:
    for point, _ in _kept:
        with suppress(GpuError):  # Programs have seen it.
            point.synchronize()
    _kept.clear()


def _merged(shape: tuple[int, ...], columns: Sequence[Sequence[int]]) -> tuple[list[int], list[list[int]]]:
    """The shape and the strides with as few dimensions as the strides allow."""
    lengths: list[int] = []
    strides: list[list[int]] = [[] for _ in columns]
    for axis, length in enumerate(shape):
        if length == 1:
            continue
        if lengths and all(merged[-1] == length * column[axis] for merged, column in zip(strides, columns)):
            lengths[-1] *= length
            for merged, column in zip(strides, columns):
                merged[-1] = column[axis]
            continue
        lengths.append(length)
        for merged, column in zip(strides, columns):
            merged.append(column[axis])
    if not lengths:
        return [1], [[0] for _ in columns]
    return lengths, strides


class Batch:
    """The arguments of a query: tensors of one device, and numbers that serve all queries."""

    def __init__(self, vectors: dict[str, Any], numbers: dict[str, Any], stream: Any) -> None:
        """In the order of gpu/queries.cpp. The number called mask is a whole one."""
        values = {**vectors, **numbers}
        leader = next(name for name, value in values.items() if is_on_gpu(value))
        self.library: Library = library_of(values[leader])
        self.device: Device = device_of(values[leader], leader)
        for name, value in values.items():
            self._check_place(name, value, leader, 3 if name in vectors else 1)
        _core.gpu_check_driver(self.device.is_hip)
        _find_compiler()
        self._asked = stream
        self.stream = self._find_stream()
        self._views: list[View] = []
        self.is_double = False
        parts = [self._vector(name, value) for name, value in vectors.items()]
        parts += [self._number(name, value) for name, value in numbers.items()]
        self._arrange(parts, len(vectors), list(values))

    def _check_place(self, name: str, value: Any, leader: str, size: int) -> None:
        if is_on_gpu(value):
            device = device_of(value, name)
            if device != self.device:
                raise InputError(f"{name} is on {device}, and {leader} is on {self.device}: copy it there")
            return
        array = as_numpy(value, name)
        if array.size > size or array.ndim > 1:
            raise InputError(f"{name} is in the memory of the CPU, and {leader} is on {self.device}: copy it there. "
                             f"Only {'single vectors' if size == 3 else 'single numbers'} may be on the CPU")

    def _find_stream(self) -> int:
        if self._asked is not None:
            return handle_of(self._asked)
        current = self.library.current_stream(self.device)
        if current is not None:
            return current
        return _own_stream(self.device) if hasattr(self.library.like, "__dlpack__") else 0

    def _view(self, name: str, value: Any) -> View:
        is_current = self._asked is None and self.library.orders_memory and \
            library_of(value).name == self.library.name
        view = view_of(value, name, self.device, self.stream, is_current)
        self._views.append(view)
        return view

    def _vector(self, name: str, value: Any) -> Any:
        """A view, or a list of three numbers."""
        if not is_on_gpu(value):
            array = as_real(value, name)
            if array.shape != (3,):
                raise InputError(f"{name}: expected ... x 3 numbers, found shape {array.shape}")
            self.is_double |= array.dtype == np.float64
            return [float(number) for number in array]
        view = real_view(self._view(name, value), name)
        if not view.shape or view.shape[-1] != 3:
            raise InputError(f"{name}: expected ... x 3 numbers, found shape {view.shape}")
        self.is_double |= view.type == "float64"
        return view

    def _number(self, name: str, value: Any) -> Any:
        """A view, or a list of one number."""
        if is_on_gpu(value):
            return (mask_view if name == "mask" else real_view)(self._view(name, value), name)
        array = (as_uint32 if name == "mask" else as_real)(value, name)
        if array.size != 1:
            raise InputError(f"{name}: expected a number, found shape {array.shape}")
        return [float(array.reshape(()))]

    def _arrange(self, parts: list[Any], vectors: int, names: list[str]) -> None:
        """Finds the shape of the batch, and describes the columns as gpu/queries.cpp takes them."""
        views = [(i, part) for i, part in enumerate(parts) if isinstance(part, View)]
        leading = [part.shape[:-1] if i < vectors else part.shape for i, part in views]
        try:
            self.shape: tuple[int, ...] = np.broadcast_shapes(*leading)
        except ValueError as fault:
            raise InputError(f"{', '.join(names[:-1])} and {names[-1]} have different shapes: {fault}") from None
        strides = []
        for (_, part), shape in zip(views, leading):
            missing = len(self.shape) - len(shape)
            strides.append([0] * missing + [stride if length != 1 else 0
                                            for length, stride in zip(shape, part.strides)])
        self.lengths, merged = _merged(self.shape, strides)
        if len(self.lengths) > _MOST_DIMENSIONS:
            raise InputError(f"the arrays have {len(self.lengths)} dimensions with strides of their own, and a GPU "
                             f"reads up to {_MOST_DIMENSIONS}: make contiguous copies")
        columns = list(parts)
        for (i, part), steps in zip(views, merged):
            columns[i] = (part.address, steps, part.strides[-1] if i < vectors else 0, kind_of(part))
        self.columns = tuple(columns)

    def run(self, query: Any, scene: Any, policy: Any, results: Sequence[tuple[tuple[int, ...], str]]) -> list[Any]:
        """Enqueues a query, and returns its results: arrays of these shapes, behind that of the batch, and types."""
        parts = [((*self.shape, *rest), kind) for rest, kind in results]
        arrays, addresses = self.library.empty(parts, self.device, self._asked)
        if math.prod(self.shape) != 0:
            query(scene, *self.device, self.stream, policy, self.lengths, self.columns, addresses)
        if self._asked is None and self.library.orders_memory:
            return arrays
        point = _core.GpuPoint(*self.device, self.stream)
        _keep(point, self._views)
        return self.library.finished(arrays, self.device, point)


def ray_batch(origins: Any, directions: Any, tmin: Any, tmax: Any, mask: Any, time: Any, precision: Optional[str],
              stream: Any) -> tuple[Batch, str]:
    """Rays, and their precision."""
    batch = Batch({"origins": origins, "directions": directions},
                  {"tmin": tmin, "tmax": tmax, "mask": mask, "time": time}, stream)
    if precision is None:
        precision = "double" if batch.is_double else "watertight"
    return batch, precision


def cast(scene: Any, *rays: Any) -> list[Any]:
    """The arrays of Hits. rays: the arguments of ray_batch()."""
    batch, precision = ray_batch(*rays)
    real = "float64" if precision == "double" else "float32"
    return batch.run(_core.gpu_cast, scene, precision,
                     [((), real), ((), real), ((), real), ((), "uint32"), ((), "uint32"), ((3,), real),
                      ((), "float32"), ((scene.levels,), "uint32")])


def occluded(scene: Any, *rays: Any) -> Any:
    batch, precision = ray_batch(*rays)
    return batch.run(_core.gpu_occluded, scene, precision, [((), "bool")])[0]


def count(scene: Any, *rays: Any) -> Any:
    batch, precision = ray_batch(*rays)
    return batch.run(_core.gpu_count, scene, precision, [((), "uint32")])[0]


def closest_point(scene: Any, points: Any, max_distance: Any, mask: Any, time: Any, precision: Optional[str],
                  stream: Any) -> list[Any]:
    """The arrays of ClosestPoints."""
    if precision not in (None, "float", "double"):
        raise InputError(f"precision: '{precision}' is none of float, double")
    batch = Batch({"points": points}, {"max_distance": max_distance, "mask": mask, "time": time}, stream)
    is_double = batch.is_double if precision is None else precision == "double"
    real = "float64" if is_double else "float32"
    return batch.run(_core.gpu_closest_point, scene, is_double,
                     [((), real), ((3,), real), ((), real), ((), real), ((), "uint32"), ((), "uint32"),
                      ((), "uint8"), ((scene.levels,), "uint32")])


def where(condition: Any, yes: Any, no: Any) -> Any:
    """numpy.where() of any library's arrays."""
    if isinstance(condition, np.ndarray):
        return np.where(condition, yes, no)
    return library_of(condition).where(condition, yes, no)
