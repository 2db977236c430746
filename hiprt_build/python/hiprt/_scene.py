"""Scenes: building, loading, and rays in bulk. _points.py has the points."""

from __future__ import annotations

import os
from typing import Any, Dict, NamedTuple, Optional

import numpy as np

from . import _core, _gpu
from ._arrays import INVALID, as_real, as_uint32, is_found, readable
from ._calls import Progress, checked_threads
from ._errors import InputError
from ._gpu_arrays import device_named
from ._input import Instances, as_meshes, flattened, mesh_entries
from ._points import PointQueries

_Bytes = bytes  # Scene has a property of that name.


class Hits(NamedTuple):
    """The first hits of rays. All arrays have the shape of the batch of rays.

    They are numpy arrays, or tensors of the library whose tensors the rays were. In PyTorch uint32 is int32, and -1 is
    a miss.
    """

    t: np.ndarray
    """Distance in lengths of the direction; inf: a miss. float32, or float64 with precision "double"."""
    u: np.ndarray
    """Weight of the triangle's corner 1."""
    v: np.ndarray
    """Weight of the triangle's corner 2. The point is (1 - u - v) * p0 + u * p1 + v * p2."""
    geometry: np.ndarray
    """Number of the mesh, uint32; 0xffffffff: a miss. With instances: within the object."""
    primitive: np.ndarray
    """Number of the triangle in its mesh, uint32; 0xffffffff: a miss."""
    normal: np.ndarray
    """... x 3: cross(p1 - p0, p2 - p0), not normalised; 0 for a miss."""
    error: np.ndarray
    """Bound of the distance between origin + t * direction and the triangle, per axis, float32."""
    instances: np.ndarray
    """... x levels: numbers of the instances from the scene to the object, uint32; unused entries are 0xffffffff."""

    @property
    def found(self) -> np.ndarray:
        """Whether each ray has a hit, bool."""
        return is_found(self.primitive)

    def points(self, origins: Any, directions: Any) -> np.ndarray:
        """... x 3: origins + t * directions; NaN for a miss."""
        if not isinstance(self.t, np.ndarray):
            return origins + (self.t + 0 * self.t)[..., None] * directions  # 0 * inf is NaN.
        t = np.where(self.found, self.t, np.nan)[..., None]
        return as_real(origins, "origins") + t * as_real(directions, "directions")

    def spawn_origins(self, origins: Any, directions: Any, towards: Any) -> np.ndarray:
        """... x 3: the hit points, moved off their triangles to the side of `towards`, by the hits' own error bounds.

        A ray that starts there with tmin = 0 does not hit the same triangle again. Rows of misses are NaN.
        origins, directions: of the rays. towards: directions of the new rays, ... x 3.
        """
        kind = self.t.dtype
        rays = _batch(origins, directions)[0]
        new = np.ascontiguousarray(np.broadcast_to(as_real(towards, "towards"), (*self.t.shape, 3)), dtype=kind)
        moved = np.empty((*self.t.shape, 3), kind)
        t, normal, error = (np.ascontiguousarray(array) for array in (self.t, self.normal, self.error))
        _core.spawn_origins(rays, t, normal, error, new, moved)
        moved[~self.found] = np.nan
        return moved


class HitList(NamedTuple):
    """All hits of rays, ray by ray, in the order of t. Hits of ray i are offsets[i] to offsets[i + 1] - 1."""

    offsets: np.ndarray
    """n + 1 numbers, int64, for the n rays in C order."""
    t: np.ndarray
    u: np.ndarray
    v: np.ndarray
    geometry: np.ndarray
    primitive: np.ndarray
    instances: np.ndarray
    """m x levels, as in Hits."""

    @property
    def rays(self) -> np.ndarray:
        """The ray of each hit, int64."""
        return np.repeat(np.arange(len(self.offsets) - 1), np.diff(self.offsets))


def _batch(origins: Any, directions: Any, tmin: Any = 0.0, tmax: Any = np.inf, mask: Any = INVALID, time: Any = 0.0,
           precision: Optional[str] = None) -> tuple[_core.Rays, tuple[int, ...], str]:
    """Views of the arrays as one batch, its shape, and its precision. Single vectors and numbers serve all rays."""
    vectors = [as_real(origins, "origins"), as_real(directions, "directions")]
    for name, array in zip(("origins", "directions"), vectors):
        if array.ndim == 0 or array.shape[-1] != 3:
            raise InputError(f"{name}: expected ... x 3 numbers, found shape {array.shape}")
    numbers = [as_real(tmin, "tmin"), as_real(tmax, "tmax"), as_uint32(mask, "mask"),
               as_real(time, "time").astype(np.float32, copy=False)]
    try:
        shape = np.broadcast_shapes(*(v.shape[:-1] for v in vectors), *(n.shape for n in numbers))
    except ValueError as fault:
        raise InputError(f"origins, directions, tmin, tmax, mask and time have different shapes: {fault}") from None
    size = int(np.prod(shape, dtype=np.int64))
    flat = [readable(np.broadcast_to(v, (*shape, 3)).reshape(size, 3)) for v in vectors]
    flat += [readable(np.broadcast_to(n, shape).reshape(size)) for n in numbers]
    if precision is None:
        precision = "watertight" if all(v.dtype == np.float32 for v in vectors) else "double"
    return _core.Rays(*flat), shape, precision


class Scene(PointQueries):
    """A BVH file in memory, ready to trace. hiprt.build() and hiprt.load() make scenes.

    Rays: origins and directions are ... x 3 arrays; their leading shapes are broadcast, and results have that shape.
    numpy arrays and DLPack tensors in the memory of the CPU are read in place, whatever their strides.
    Directions may have any length; t is in units of it. A ray holds the points with tmin <= t <= tmax.
    A ray that is not finite, has no direction, or has tmin > tmax misses.

    precision: "watertight" (no ray passes between neighbours), "reference" (exact decisions), "fast" (may miss at
        edges), "double" (rays and results in float64). None: "watertight" if origins and directions are float32, else
        "double". With the first three, float64 rays are rounded to float32.
    mask: a ray sees geometries and instances with (mask & theirs) != 0.
    time: of the rays, in scenes that move.
    threads: 0: all that the process may use. Results do not depend on it.
    progress: progress(done, total) with the number of rays.
    stream: of tensors on a GPU. None: the current stream of PyTorch or CuPy, the stream of __cuda_array_interface__, or
        one of hiprt's own, which waits for the tensor. Else a stream of PyTorch or CuPy, or its number.

    cast(), occluded(), count(), closest_point(), occupancy() and signed_distance() take tensors of PyTorch, CuPy, JAX
    and others in the memory of a GPU. They enqueue the work in the stream and return tensors of the same library.
    threads and progress have no effect there.

    Queries release the GIL. Ctrl-C ends them with KeyboardInterrupt.
    """

    __slots__ = ("_core", "__weakref__")

    def __init__(self, core: _core.Scene) -> None:
        self._core = core

    # Rays

    def cast(self, origins: Any, directions: Any, tmin: Any = 0.0, tmax: Any = np.inf, *, mask: Any = INVALID,
             time: Any = 0.0, precision: Optional[str] = None, threads: int = 0,
             progress: Optional[Progress] = None, stream: Any = None) -> Hits:
        """The closest hit of each ray. Of hits at the same t the lowest geometry wins, then the lowest primitive."""
        if _gpu.on_gpu(origins, directions, tmin, tmax, mask, time):
            return Hits(*_gpu.cast(self._core, origins, directions, tmin, tmax, mask, time, precision, stream))
        _gpu.refuse_stream(stream)
        rays, shape, precision = _batch(origins, directions, tmin, tmax, mask, time, precision)
        real = np.float64 if precision == "double" else np.float32
        hits = Hits(np.empty(shape, real), np.empty(shape, real), np.empty(shape, real), np.empty(shape, np.uint32),
                    np.empty(shape, np.uint32), np.empty((*shape, 3), real), np.empty(shape, np.float32),
                    np.empty((*shape, self.levels), np.uint32))
        _core.cast(self._core, rays, precision, checked_threads(threads), progress, tuple(hits))
        return hits

    def occluded(self, origins: Any, directions: Any, tmin: Any = 0.0, tmax: Any = np.inf, *, mask: Any = INVALID,
                 time: Any = 0.0, precision: Optional[str] = None, threads: int = 0,
                 progress: Optional[Progress] = None, stream: Any = None) -> np.ndarray:
        """Whether each ray hits anything, bool. Faster than cast()."""
        if _gpu.on_gpu(origins, directions, tmin, tmax, mask, time):
            return _gpu.occluded(self._core, origins, directions, tmin, tmax, mask, time, precision, stream)
        _gpu.refuse_stream(stream)
        rays, shape, precision = _batch(origins, directions, tmin, tmax, mask, time, precision)
        result = np.empty(shape, np.bool_)
        _core.occluded(self._core, rays, precision, checked_threads(threads), progress, result)
        return result

    def count(self, origins: Any, directions: Any, tmin: Any = 0.0, tmax: Any = np.inf, *, mask: Any = INVALID,
              time: Any = 0.0, precision: Optional[str] = None, threads: int = 0,
              progress: Optional[Progress] = None, stream: Any = None) -> np.ndarray:
        """Number of triangles that each ray hits, uint32. With precision "reference" crossings are counted exactly."""
        if _gpu.on_gpu(origins, directions, tmin, tmax, mask, time):
            return _gpu.count(self._core, origins, directions, tmin, tmax, mask, time, precision, stream)
        _gpu.refuse_stream(stream)
        rays, shape, precision = _batch(origins, directions, tmin, tmax, mask, time, precision)
        result = np.empty(shape, np.uint32)
        _core.count_hits(self._core, rays, precision, checked_threads(threads), progress, result)
        return result

    def list(self, origins: Any, directions: Any, tmin: Any = 0.0, tmax: Any = np.inf, *, mask: Any = INVALID,
             time: Any = 0.0, precision: Optional[str] = None, threads: int = 0, progress: Optional[Progress] = None,
             max_hits: Optional[int] = None) -> HitList:
        """All hits of each ray, in the order of t, geometry and primitive.

        max_hits: the first so many of each ray. None: all.
        """
        rays, _, precision = _batch(origins, directions, tmin, tmax, mask, time, precision)
        if max_hits is not None and max_hits < 0:
            raise InputError(f"max_hits: {max_hits} is negative")
        most = (1 << 62) if max_hits is None else int(max_hits)
        return HitList(*_core.list_hits(self._core, rays, precision, checked_threads(threads), progress, most))

    # Files

    def save(self, path: "os.PathLike[str] | str") -> None:
        """Writes the BVH file. Either the old file or the whole new one is there. Raises FileError."""
        self._core.save(os.fspath(path))

    @property
    def bytes(self) -> np.ndarray:
        """The BVH file, a read-only view of uint8. hiprt.from_bytes() opens it."""
        return self._core.bytes

    def __reduce__(self):
        return _unpickled, (self.bytes.tobytes(),)

    def __copy__(self) -> "Scene":
        return from_bytes(self.bytes, validate=False)

    def __deepcopy__(self, _memo: Any) -> "Scene":
        return self.__copy__()

    # Properties

    @property
    def bounds(self) -> np.ndarray:
        """2 x 3, float32: the lower and the upper corner of the scene's box; inf and -inf if it is empty."""
        return self._core.bounds

    @property
    def levels(self) -> int:
        """Number of instances on the longest path to a primitive; 0 in a scene without instances."""
        return self._core.levels

    @property
    def geometries(self) -> int:
        """Number of meshes of the scene's own file; with instances see their objects."""
        return self._core.geometries

    @property
    def primitives(self) -> int:
        """Number of primitives of the scene's own file, with dropped ones; with instances: number of instances."""
        return self._core.primitives

    @property
    def layout(self) -> str:
        """Node layout: "planes", "float", "half" or "quantized"."""
        return self._core.layout

    @property
    def instance_ids(self) -> np.ndarray:
        """Your own numbers of the scene's instances, uint32: ids of Instances."""
        return self._core.instance_ids

    def statistics(self) -> Dict[str, Any]:
        """Figures of the tree (nodes, leaves, depth, sah_cost, bytes, ...), and of the build if this process did it."""
        return self._core.statistics()

    def validate(self, threads: int = 0) -> Dict[str, int]:
        """Checks the whole file. Returns what it counted. Raises InputError with the fault and its byte."""
        return self._core.validate(checked_threads(threads))

    def copy_to(self, device: Any) -> "Scene":
        """Copies the scene to a GPU now. Without it the first query there makes the copy. Returns the scene.

        device: "cuda", "cuda:1", "rocm", ..., or a torch.device. "cpu" changes nothing.
        Raises GpuError without a driver or the device, and OutOfMemoryError.
        """
        where = device_named(device)
        if where is not None:
            _core.gpu_copy_scene(self._core, *where)
        return self

    def refit(self, meshes: Any, *, threads: int = 0, progress: Optional[Progress] = None) -> Dict[str, Any]:
        """Gives the triangles new positions and keeps the tree. Hits are those of a fresh build.

        meshes: as for hiprt.build(), with the same triangles. Queries that run go on with the old positions.
        Returns figures. "rebuild_advised": a new build would save a good part of a ray's work.
        Raises InputError, for example if a triangle was dropped and is good now. Then the scene stays as it was.
        """
        return _core.refit(self._core, mesh_entries(as_meshes(meshes)), checked_threads(threads), progress)

    def _repr_png_(self) -> _Bytes:
        from . import render
        return render.png(render.normals(self, width=320, height=240))

    def __repr__(self) -> str:
        low, high = self.bounds
        return (f"hiprt.Scene({self.primitives} primitives, {self.levels} levels, {self.bytes.nbytes} bytes, "
                f"bounds {low.tolist()} to {high.tolist()})")


def build(what: Any, quality: Optional[str] = None, *, builder: Optional[str] = None, layout: Optional[str] = None,
          threads: int = 0, split_budget: Optional[float] = None, presplit_budget: Optional[float] = None,
          reinsertion_rounds: Optional[int] = None, max_leaf_triangles: Optional[int] = None,
          ploc_radius: Optional[int] = None, pair_triangles: Optional[bool] = None,
          progress: Optional[Progress] = None, device: Any = "cpu") -> Scene:
    """Builds a scene. The CPU builds.

    what: a Mesh, an object with vertices and faces, a list of these (mesh i becomes geometry i), or Instances.
    quality: "fast" (the fastest build), "balanced" (the default), "high" (the fastest rays).
    builder: by name, in place of that of the quality: "sah", "lbvh", "ploc", "hploc", "sbvh", "hq", ...
    layout: of nodes: "planes" (the default), "float", "half", "quantized". Rays are fastest in "planes". Instances
        have the layout of their objects.
    threads: 0: all that the process may use. The scene does not depend on it.
    split_budget, presplit_budget, reinsertion_rounds, max_leaf_triangles, ploc_radius, pair_triangles: see BUILDERS.md.
    progress: progress(done, total) with the number of triangles or instances.
    device: "cpu", or a GPU that gets a copy at once: see Scene.copy_to().

    Raises InputError with the mesh, the triangle and the limit.
    Releases the GIL. Ctrl-C ends it with KeyboardInterrupt.
    """
    device_named(device)  # Before the work.
    options = {"quality": quality, "builder": builder, "layout": layout, "threads": threads,
               "split_budget": split_budget, "presplit_budget": presplit_budget,
               "reinsertion_rounds": reinsertion_rounds, "max_leaf_triangles": max_leaf_triangles,
               "ploc_radius": ploc_radius, "pair_triangles": pair_triangles}
    if isinstance(what, Instances):
        scenes, groups = flattened(what)
        built = _core.build_instances([scene._core for scene in scenes], groups, options, progress)
    else:
        built = _core.build(mesh_entries(as_meshes(what)), options, progress)
    return Scene(built).copy_to(device)


def load(path: "os.PathLike[str] | str", *, validate: bool = True, threads: int = 0) -> Scene:
    """Maps a BVH file. It must not change while the scene lives.

    validate: checks the whole file, so that rays through a file of unknown origin are safe. False: trusts its content.
    Raises FileError, or InputError with the fault and its byte.
    """
    return Scene(_core.load(os.fspath(path), validate, checked_threads(threads)))


def from_bytes(data: Any, *, validate: bool = True, threads: int = 0) -> Scene:
    """Opens a copy of a BVH file in memory: bytes, or an array of uint8. See load()."""
    array = data if isinstance(data, np.ndarray) else np.frombuffer(data, np.uint8)
    return Scene(_core.from_bytes(np.ascontiguousarray(array), validate, checked_threads(threads)))


def _unpickled(data: bytes) -> Scene:
    return from_bytes(data)
