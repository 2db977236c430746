"""Arrays of programs as numpy arrays that the compiled part can read in place."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._errors import InputError

INVALID = 0xFFFFFFFF
"""Geometry, primitive or instance of a miss."""

# DLDeviceType of dlpack.h: memory that the CPU reads.
_HOST_DEVICES = (1, 3, 11)  # kDLCPU, kDLCUDAHost, kDLROCMHost

_ON_GPU = ("Of NVIDIA or AMD, cast(), occluded(), count(), closest_point(), occupancy() and signed_distance() read it "
           "there. Other calls work on the CPU: copy it first, with tensor.cpu() in PyTorch")


def is_found(primitive: Any) -> Any:
    """Whether numbers of primitives name one, bool. In tensors of PyTorch uint32 is int32, and INVALID is -1."""
    return primitive != (-1 if str(primitive.dtype).endswith(".int32") else np.uint32(INVALID))


def as_numpy(values: Any, name: str) -> np.ndarray:
    """The array itself, a view of a DLPack tensor, or a new array of a sequence. Refuses memory of a GPU."""
    if isinstance(values, np.ndarray):
        return values
    if hasattr(values, "__dlpack_device__"):
        device = int(values.__dlpack_device__()[0])
        if device not in _HOST_DEVICES:
            raise InputError(f"{name}: the tensor is in the memory of a GPU (DLPack device type {device}). {_ON_GPU}")
        return np.from_dlpack(values)
    if hasattr(values, "__cuda_array_interface__"):
        raise InputError(f"{name}: the array is in the memory of a GPU. {_ON_GPU}")
    return np.asarray(values)


def readable(array: np.ndarray) -> np.ndarray:
    """The array, or a copy if its numbers are not aligned, not at whole distances, or in another byte order."""
    whole = all(stride % array.itemsize == 0 for stride in array.strides)
    if whole and array.flags.aligned and array.dtype.isnative:
        return array
    return np.array(array, dtype=array.dtype.newbyteorder("="))


def as_real(values: Any, name: str) -> np.ndarray:
    """float32 as it is, float16 as float32, all other numbers as float64."""
    array = readable(as_numpy(values, name))
    if array.dtype == np.float16:
        return array.astype(np.float32)
    if array.dtype not in (np.float32, np.float64):
        if array.dtype.kind not in "iufb":
            raise InputError(f"{name}: expected numbers, found an array of {array.dtype}")
        return array.astype(np.float64)
    return array


def as_float32(values: Any, name: str) -> np.ndarray:
    """Each number rounded to the nearest float32. Refuses finite numbers beyond its range."""
    array = as_real(values, name)
    if array.dtype == np.float32:
        return array
    with np.errstate(over="ignore"):
        rounded = array.astype(np.float32)
    lost = np.isinf(rounded) & np.isfinite(array)
    if lost.any():
        where = tuple(int(i) for i in np.argwhere(lost)[0])
        raise InputError(f"{name}{list(where)}: {array[where]} is beyond the range of float32")
    return rounded


def as_uint32(values: Any, name: str) -> np.ndarray:
    """Whole numbers from 0 to 2^32 - 1."""
    array = readable(as_numpy(values, name))
    if array.dtype == np.uint32:
        return array
    if array.dtype.kind not in "iu" and array.size != 0:
        raise InputError(f"{name}: expected whole numbers, found an array of {array.dtype}")
    if array.size != 0 and (int(array.min()) < 0 or int(array.max()) > INVALID):
        outside = np.argwhere((array < 0) | (array > INVALID))[0]
        where = tuple(int(i) for i in outside)
        raise InputError(f"{name}{list(where)}: {array[where]} is not between 0 and 2^32 - 1")
    return array.view(np.uint32) if array.dtype == np.int32 else array.astype(np.uint32)


def as_rows(array: np.ndarray, name: str) -> np.ndarray:
    """n x 3 numbers whose rows have no gaps; rows may have gaps between them."""
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{name}: expected an array of n x 3 numbers, found shape {array.shape}")
    if array.strides[1] == array.itemsize and array.strides[0] >= 3 * array.itemsize:
        return array
    return np.ascontiguousarray(array)
