"""Points and boxes in bulk: what is closest, what is within a distance, what is inside, what overlaps."""

from __future__ import annotations

import enum
import operator
from typing import Any, NamedTuple, Optional

import numpy as np

from . import _core, _gpu
from ._arrays import INVALID, as_float32, as_real, as_uint32, is_found, readable
from ._calls import Progress, checked_threads
from ._core import Points as CorePoints
from ._core import Scene as CoreScene
from ._errors import InputError

MOST_NEAREST = 1024


class Feature(enum.IntEnum):
    """The part of a triangle on which a point lies. Edge k leads from corner k to corner k + 1; edge 2 to corner 0."""

    FACE = 0
    EDGE0 = 1
    EDGE1 = 2
    EDGE2 = 3
    VERTEX0 = 4
    VERTEX1 = 5
    VERTEX2 = 6


class ClosestPoints(NamedTuple):
    """Closest points of triangles. All arrays have the shape of the batch; nearest() adds a last axis of length k."""

    distance: np.ndarray
    """inf: nothing was found. float32, or float64 with precision "double"."""
    point: np.ndarray
    """... x 3: on the triangle; NaN if nothing was found."""
    u: np.ndarray
    """Weight of the triangle's corner 1."""
    v: np.ndarray
    """Weight of the triangle's corner 2."""
    geometry: np.ndarray
    """Number of the mesh, uint32; 0xffffffff: nothing was found. With instances: within the object."""
    primitive: np.ndarray
    """Number of the triangle in its mesh, uint32; 0xffffffff: nothing was found."""
    feature: np.ndarray
    """Feature: the part of the triangle on which the point lies, uint8."""
    instances: np.ndarray
    """... x levels: numbers of the instances from the scene to the object, uint32; unused entries are 0xffffffff."""

    @property
    def found(self) -> np.ndarray:
        """Whether there is a triangle within max_distance, bool."""
        return is_found(self.primitive)


class PointList(NamedTuple):
    """Closest points of all triangles within a distance, the nearest first.

    Those of query point i are offsets[i] to offsets[i + 1] - 1.
    """

    offsets: np.ndarray
    """n + 1 numbers, int64, for the n points in C order."""
    distance: np.ndarray
    point: np.ndarray
    """m x 3: on the triangles."""
    u: np.ndarray
    v: np.ndarray
    geometry: np.ndarray
    primitive: np.ndarray
    feature: np.ndarray
    instances: np.ndarray
    """m x levels, as in ClosestPoints."""

    @property
    def queries(self) -> np.ndarray:
        """The query point of each result, int64."""
        return np.repeat(np.arange(len(self.offsets) - 1), np.diff(self.offsets))


class OverlapList(NamedTuple):
    """Triangles that touch boxes, in the order of instances, geometry and primitive.

    Those of box i are offsets[i] to offsets[i + 1] - 1.
    """

    offsets: np.ndarray
    """n + 1 numbers, int64, for the n boxes in C order."""
    geometry: np.ndarray
    """m, uint32. With instances: within the object."""
    primitive: np.ndarray
    """m, uint32."""
    instances: np.ndarray
    """m x levels, uint32."""

    @property
    def boxes(self) -> np.ndarray:
        """The box of each triangle, int64."""
        return np.repeat(np.arange(len(self.offsets) - 1), np.diff(self.offsets))


def _vectors(values: Any, name: str) -> np.ndarray:
    array = as_real(values, name)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise InputError(f"{name}: expected ... x 3 numbers, found shape {array.shape}")
    return array


def _flat(vectors: list[np.ndarray], numbers: list[np.ndarray],
          names: str) -> tuple[list[np.ndarray], list[np.ndarray], tuple[int, ...]]:
    """n x 3 and n arrays of one batch, and its shape."""
    try:
        shape = np.broadcast_shapes(*(v.shape[:-1] for v in vectors), *(n.shape for n in numbers))
    except ValueError as fault:
        raise InputError(f"{names} have different shapes: {fault}") from None
    size = int(np.prod(shape, dtype=np.int64))
    return ([readable(np.broadcast_to(v, (*shape, 3)).reshape(size, 3)) for v in vectors],
            [readable(np.broadcast_to(n, shape).reshape(size)) for n in numbers], shape)


def _seen(mask: Any, time: Any) -> list[np.ndarray]:
    return [as_uint32(mask, "mask"), as_real(time, "time").astype(np.float32, copy=False)]


def _batch(points: Any, reach: Any, reach_name: str, mask: Any, time: Any,
           precision: Optional[str]) -> tuple[CorePoints, tuple[int, ...], bool]:
    """Views of the arrays as one batch, its shape, and whether results are in float64."""
    array = _vectors(points, "points")
    if precision not in (None, "float", "double"):
        raise InputError(f"precision: '{precision}' is none of float, double")
    flat, numbers, shape = _flat([array], [as_real(reach, reach_name), *_seen(mask, time)],
                                 f"points, {reach_name}, mask and time")
    is_double = array.dtype == np.float64 if precision is None else precision == "double"
    return _core.Points(flat[0], *numbers), shape, is_double


def _boxes(boxes: Any, mask: Any, time: Any) -> tuple[CorePoints, CorePoints, tuple[int, ...]]:
    """Views of the lower and of the upper corners, and the shape of the batch."""
    array = as_float32(boxes, "boxes")
    if array.ndim < 2 or array.shape[-2:] != (2, 3):
        raise InputError(f"boxes: expected ... x 2 x 3 numbers, found shape {array.shape}")
    finite = np.isfinite(array)
    if not finite.all():
        where = tuple(int(i) for i in np.argwhere(~finite)[0])
        raise InputError(f"boxes{list(where)}: {array[where]} is not finite")
    (low, high), (mask, time), shape = _flat([array[..., 0, :], array[..., 1, :]], _seen(mask, time),
                                             "boxes, mask and time")
    no_reach = np.broadcast_to(np.float32(0), len(low))
    return _core.Points(low, no_reach, mask, time), _core.Points(high, no_reach, mask, time), shape


def _part_of(progress: Optional[Progress], part: int, parts: int) -> Optional[Progress]:
    """Progress of the whole during one of its equal parts."""
    if progress is None:
        return None
    return lambda done, total: progress((part * total + done) // parts, total)


class PointQueries:
    """The queries of points and boxes. Scene has them."""

    __slots__ = ()
    _core: CoreScene

    def _nearest(self, batch: CorePoints, shape: tuple[int, ...], is_double: bool, most: int, threads: int,
                 progress: Optional[Progress]) -> ClosestPoints:
        real = np.float64 if is_double else np.float32
        found = ClosestPoints(np.empty(shape, real), np.empty((*shape, 3), real), np.empty(shape, real),
                              np.empty(shape, real), np.empty(shape, np.uint32), np.empty(shape, np.uint32),
                              np.empty(shape, np.uint8), np.empty((*shape, self._core.levels), np.uint32))
        _core.nearest(self._core, batch, is_double, most, checked_threads(threads), progress, tuple(found))
        return found

    def closest_point(self, points: Any, max_distance: Any = np.inf, *, mask: Any = INVALID, time: Any = 0.0,
                      precision: Optional[str] = None, threads: int = 0,
                      progress: Optional[Progress] = None, stream: Any = None) -> ClosestPoints:
        """The closest point of the scene's triangles to each point.

        points: ... x 3. max_distance, mask, time: ..., broadcast with the points. Triangles at max_distance count.
        precision: "float" or "double", of points and results. None: "float" if the points are float32, else "double".
            With "float" float64 points are rounded. Distances are computed in double in both.
        Of triangles at the same distance the lowest path of instances wins, then the lowest geometry, then the lowest
        primitive. A point that is not finite finds nothing.
        mask, threads, progress, stream: as for rays. Raises InputError if the scene has spheres or curves.
        """
        if _gpu.on_gpu(points, max_distance, mask, time):
            return ClosestPoints(*_gpu.closest_point(self._core, points, max_distance, mask, time, precision, stream))
        _gpu.refuse_stream(stream)
        batch, shape, is_double = _batch(points, max_distance, "max_distance", mask, time, precision)
        return self._nearest(batch, shape, is_double, 1, threads, progress)

    def nearest(self, points: Any, k: int, max_distance: Any = np.inf, *, mask: Any = INVALID, time: Any = 0.0,
                precision: Optional[str] = None, threads: int = 0,
                progress: Optional[Progress] = None) -> ClosestPoints:
        """The k nearest triangles of each point, the nearest first: arrays of ... x k.

        k: 1 to 1024; fastest up to about 64. Entries behind the last triangle have distance inf and primitive INVALID.
        Other arguments: as for closest_point().
        """
        k = operator.index(k)
        if not 1 <= k <= MOST_NEAREST:
            raise InputError(f"k: {k} is not between 1 and {MOST_NEAREST}; within() has no limit")
        batch, shape, is_double = _batch(points, max_distance, "max_distance", mask, time, precision)
        return self._nearest(batch, (*shape, k), is_double, k, threads, progress)

    def within(self, points: Any, radius: Any, *, mask: Any = INVALID, time: Any = 0.0,
               precision: Optional[str] = None, threads: int = 0, progress: Optional[Progress] = None) -> PointList:
        """All triangles within a radius of each point, in the order of distance, instances, geometry and primitive.

        radius: ..., broadcast with the points. Triangles at this distance count. Other arguments: as for
        closest_point().
        """
        batch, _, is_double = _batch(points, radius, "radius", mask, time, precision)
        return PointList(*_core.within(self._core, batch, is_double, checked_threads(threads), progress))

    def occupancy(self, points: Any, *, mask: Any = INVALID, time: Any = 0.0, threads: int = 0,
                  progress: Optional[Progress] = None, stream: Any = None) -> np.ndarray:
        """Whether each point is inside closed meshes, bool.

        A ray from the point crosses their surface an odd number of times, and each crossing is decided exactly. So for
        closed meshes the result is right for each point that is not on the surface, as rounded to float32. Overlapping
        meshes count as one inside the other. For open meshes the result depends on where the holes are.
        points: ... x 3. A point that is not finite is outside. mask, time, threads, progress, stream: as for rays.
        """
        if _gpu.on_gpu(points, mask, time):
            _core.check_findable(self._core)
            up = np.array([0, 0, 1], np.float32)
            return _gpu.count(self._core, points, up, 0.0, np.inf, mask, time, "reference", stream) % 2 == 1
        _gpu.refuse_stream(stream)
        flat, numbers, shape = _flat([_vectors(points, "points")], _seen(mask, time), "points, mask and time")
        _core.check_findable(self._core)
        size = len(flat[0])
        up = np.broadcast_to(np.array([0, 0, 1], np.float32), (size, 3))
        tmin, tmax = (np.broadcast_to(np.float32(end), size) for end in (0, np.inf))
        counts = np.empty(shape, np.uint32)
        _core.count_hits(self._core, _core.Rays(flat[0], up, tmin, tmax, *numbers), "reference",
                         checked_threads(threads), progress, counts)
        return counts % 2 == 1

    def signed_distance(self, points: Any, max_distance: Any = np.inf, *, mask: Any = INVALID, time: Any = 0.0,
                        precision: Optional[str] = None, threads: int = 0,
                        progress: Optional[Progress] = None, stream: Any = None) -> np.ndarray:
        """The distance of each point to the surface, negative inside closed meshes (see occupancy()).

        inf or -inf: nothing is within max_distance. Arguments: as for closest_point().
        """
        near = self.closest_point(points, max_distance, mask=mask, time=time, precision=precision, threads=threads,
                                  progress=_part_of(progress, 0, 2), stream=stream)
        inside = self.occupancy(points, mask=mask, time=time, threads=threads, progress=_part_of(progress, 1, 2),
                                stream=stream)
        return _gpu.where(inside, -near.distance, near.distance)

    def overlap(self, boxes: Any, *, mask: Any = INVALID, time: Any = 0.0, threads: int = 0,
                progress: Optional[Progress] = None) -> OverlapList:
        """The triangles that touch or overlap each box.

        boxes: ... x 2 x 3: lower and upper corners, as Scene.bounds; rounded to float32. A box whose lower corner is
            above its upper one overlaps nothing.
        The decision is exact in scenes without instances. With instances no triangle is missed; one that is nearer
        than rounding may be reported.
        mask, time, threads, progress: as for rays. Raises InputError if a number is not finite, or if the scene has
        spheres or curves.
        """
        low, high, _ = _boxes(boxes, mask, time)
        return OverlapList(*_core.overlap(self._core, low, high, checked_threads(threads), progress))

    def count_overlaps(self, boxes: Any, *, mask: Any = INVALID, time: Any = 0.0, threads: int = 0,
                       progress: Optional[Progress] = None) -> np.ndarray:
        """The number of triangles that touch each box, uint32. Takes less memory than overlap()."""
        low, high, shape = _boxes(boxes, mask, time)
        result = np.empty(shape, np.uint32)
        _core.count_overlaps(self._core, low, high, checked_threads(threads), progress, result)
        return result
