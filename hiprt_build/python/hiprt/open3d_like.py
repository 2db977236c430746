"""Open3D's RaycastingScene: the same methods, argument and result shapes, and dtypes, traced by hiprt.

    from hiprt.open3d_like import RaycastingScene   # in place of o3d.t.geometry.RaycastingScene

Arguments are Open3D tensors, numpy arrays, or whatever numpy makes an array of. Results are Open3D tensors if the rays
or points are one, else arrays that have numpy() too. Open3D is not needed.
"""

from __future__ import annotations

import math
from typing import Any, Dict, Optional

import numpy as np

from ._arrays import INVALID, as_float32, as_numpy, as_uint32
from ._errors import InputError
from ._input import Mesh
from ._points import ClosestPoints
from ._scene import Scene, build


class Array(np.ndarray):
    """An array with the methods of Open3D's tensors that programs call on results."""

    def numpy(self) -> np.ndarray:
        return self.view(np.ndarray)

    def cpu(self) -> "Array":
        return self

    def isfinite(self) -> "Array":
        return np.isfinite(self).view(Array)


def _is_tensor(values: Any) -> bool:
    return type(values).__module__.startswith("open3d.") and hasattr(values, "numpy")


def _as_array(values: Any, name: str) -> np.ndarray:
    return values.cpu().numpy() if _is_tensor(values) else as_numpy(values, name)


def _rays(values: Any, last: int = 6, name: str = "rays") -> np.ndarray:
    array = _as_array(values, name)
    if array.ndim < 2 or array.shape[-1] != last:
        raise InputError(f"{name}: expected at least 2 dimensions, the last of {last} numbers, "
                         f"found shape {array.shape}")
    if array.dtype != np.float32:
        raise InputError(f"{name}: expected float32, found {array.dtype}")
    return array


def _check_samples(nsamples: int) -> None:
    if nsamples < 1 or nsamples % 2 == 0:
        raise InputError(f"nsamples: {nsamples} is not an odd number of at least 1")


def _like(values: Any, result: np.ndarray) -> Any:
    """The result as the caller has his arrays."""
    if not _is_tensor(values):
        return result.view(Array)
    return type(values).from_numpy(np.ascontiguousarray(result))


class RaycastingScene:
    """A scene to which meshes are added, and queries of rays and points.

    nthreads: of builds, 0: all. device: a CPU device, or None. quality: of the BVH, see hiprt.build().
    """

    INVALID_ID = INVALID

    def __init__(self, nthreads: int = 0, device: Any = None, *, quality: str = "balanced") -> None:
        if device is not None and not str(device).upper().startswith("CPU"):
            raise InputError(f"device: {device} is not a CPU, and hiprt for Python traces on the CPU")
        self._threads = int(nthreads)
        self._quality = quality
        self._meshes: list[Mesh] = []
        self._built: Optional[Scene] = None

    def add_triangles(self, *args: Any, **kwargs: Any) -> int:
        """add_triangles(vertex_positions, triangle_indices) or add_triangles(mesh): returns the mesh's geometry ID.

        vertex_positions: n x 3, float32. triangle_indices: m x 3, uint32. mesh: o3d.t.geometry.TriangleMesh.
        """
        names = ("vertex_positions", "triangle_indices") if len(args) + len(kwargs) == 2 else ("mesh",)
        given = dict(zip(names, args))
        if len(args) > 2 or set(kwargs) - set(names) or len(given) + len(kwargs) != len(names):
            raise TypeError("add_triangles() takes (vertex_positions, triangle_indices) or (mesh)")
        given.update(kwargs)
        if "mesh" in given:
            mesh = given["mesh"]
            positions, indices = mesh.vertex["positions"], mesh.triangle["indices"]
        else:
            positions, indices = given["vertex_positions"], given["triangle_indices"]
        vertices = np.array(as_float32(_as_array(positions, "vertex_positions"), "vertex_positions"))
        triangles = np.array(as_uint32(_as_array(indices, "triangle_indices"), "triangle_indices"))
        self._meshes.append(Mesh(vertices, triangles))
        self._built = None
        return len(self._meshes) - 1

    @property
    def scene(self) -> Scene:
        """The hiprt.Scene of the meshes, which is built when it is first needed."""
        if self._built is None:
            self._built = build(self._meshes, self._quality, threads=self._threads)
        return self._built

    def cast_rays(self, rays: Any, nthreads: int = 0) -> Dict[str, Any]:
        """The first hit of each ray. rays: ... x 6, float32: origin and direction.

        t_hit ... float32 (inf: a miss), geometry_ids and primitive_ids ... uint32 (INVALID_ID: a miss), primitive_uvs
        ... x 2, primitive_normals ... x 3, of length 1.
        """
        array = _rays(rays)
        hits = self.scene.cast(array[..., :3], array[..., 3:], threads=nthreads)
        length = np.linalg.norm(hits.normal, axis=-1, keepdims=True)
        normals = np.divide(hits.normal, length, out=np.zeros_like(hits.normal), where=length > 0)
        found = {"t_hit": hits.t, "geometry_ids": hits.geometry, "primitive_ids": hits.primitive,
                 "primitive_uvs": np.stack((hits.u, hits.v), axis=-1), "primitive_normals": normals}
        return {key: _like(rays, value) for key, value in found.items()}

    def test_occlusions(self, rays: Any, tnear: float = 0.0, tfar: float = math.inf, nthreads: int = 0) -> Any:
        """Whether each ray hits anything between tnear and tfar, bool."""
        array = _rays(rays)
        return _like(rays, self.scene.occluded(array[..., :3], array[..., 3:], float(tnear), float(tfar),
                                               threads=nthreads, precision="watertight"))

    def count_intersections(self, rays: Any, nthreads: int = 0) -> Any:
        """Number of triangles that each ray hits, int32."""
        array = _rays(rays)
        counts = self.scene.count(array[..., :3], array[..., 3:], threads=nthreads, precision="watertight")
        return _like(rays, counts.astype(np.int32))

    def list_intersections(self, rays: Any, nthreads: int = 0) -> Dict[str, Any]:
        """All hits, ray by ray, nearest first. Hits of ray i are ray_splits[i] to ray_splits[i + 1] - 1.

        ray_splits n + 1 and ray_ids m, uint32; t_hit, geometry_ids, primitive_ids m; primitive_uvs m x 2.
        """
        array = _rays(rays)
        hits = self.scene.list(array[..., :3], array[..., 3:], threads=nthreads, precision="watertight")
        found = {"ray_splits": hits.offsets.astype(np.uint32), "ray_ids": hits.rays.astype(np.uint32), "t_hit": hits.t,
                 "geometry_ids": hits.geometry, "primitive_ids": hits.primitive,
                 "primitive_uvs": np.stack((hits.u, hits.v), axis=-1)}
        return {key: _like(rays, value) for key, value in found.items()}

    def compute_closest_points(self, query_points: Any, nthreads: int = 0) -> Dict[str, Any]:
        """The closest point of the meshes to each point. query_points: ... x 3, float32.

        points ... x 3, float32; geometry_ids and primitive_ids ... uint32; primitive_uvs ... x 2; primitive_normals
        ... x 3, of length 1. Without a closest point IDs are INVALID_ID, points NaN, uvs and normals 0.
        """
        near = self.scene.closest_point(_rays(query_points, 3, "query_points"), threads=nthreads)
        found = {"points": near.point, "geometry_ids": near.geometry, "primitive_ids": near.primitive,
                 "primitive_uvs": np.stack((near.u, near.v), axis=-1), "primitive_normals": self._normals(near)}
        return {key: _like(query_points, value) for key, value in found.items()}

    def compute_distance(self, query_points: Any, nthreads: int = 0) -> Any:
        """The distance of each point to the meshes, float32; inf: there is no triangle. query_points: ... x 3, float32.
        """
        points = _rays(query_points, 3, "query_points")
        return _like(query_points, self.scene.closest_point(points, threads=nthreads).distance)

    def compute_signed_distance(self, query_points: Any, nthreads: int = 0, nsamples: int = 1) -> Any:
        """The same, negative inside of closed meshes. nsamples: as for compute_occupancy()."""
        _check_samples(nsamples)
        points = _rays(query_points, 3, "query_points")
        return _like(query_points, self.scene.signed_distance(points, threads=nthreads))

    def compute_occupancy(self, query_points: Any, nthreads: int = 0, nsamples: int = 1) -> Any:
        """1 for points inside of closed meshes, 0 for others, float32.

        query_points: ... x 3, float32. Crossings are counted exactly, so one ray decides; nsamples must be odd.
        """
        _check_samples(nsamples)
        points = _rays(query_points, 3, "query_points")
        return _like(query_points, self.scene.occupancy(points, threads=nthreads).astype(np.float32))

    def _normals(self, near: ClosestPoints) -> np.ndarray:
        """... x 3: of the triangles, of length 1; 0 where nothing was found."""
        normals = np.zeros_like(near.point)
        for geometry, mesh in enumerate(self._meshes):
            assert mesh.indices is not None  # add_triangles() has them.
            here = near.geometry == geometry
            corners = mesh.vertices.astype(np.float64)[mesh.indices[near.primitive[here]]]
            across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            length = np.linalg.norm(across, axis=-1, keepdims=True)
            normals[here] = np.divide(across, length, out=np.zeros_like(across), where=length > 0)
        return normals

    @staticmethod
    def create_rays_pinhole(*args: Any, **kwargs: Any) -> Any:
        """create_rays_pinhole(intrinsic_matrix, extrinsic_matrix, width_px, height_px), or
        create_rays_pinhole(fov_deg, center, eye, up, width_px, height_px): height_px x width_px x 6, float32.

        Directions have the length 1 along the axis of the camera. Rays pass through the middles of pixels.
        """
        by_matrix = ("intrinsic_matrix", "extrinsic_matrix", "width_px", "height_px")
        by_view = ("fov_deg", "center", "eye", "up", "width_px", "height_px")
        names = by_matrix if len(args) + len(kwargs) == len(by_matrix) else by_view
        given = dict(zip(names, args))
        given.update(kwargs)
        if set(given) != set(names) or len(args) + len(kwargs) != len(names):
            raise TypeError(f"create_rays_pinhole() takes ({', '.join(by_matrix)}) or ({', '.join(by_view)})")
        size = int(given["width_px"]), int(given["height_px"])
        if names == by_matrix:
            intrinsic = np.asarray(_as_array(given["intrinsic_matrix"], "intrinsic_matrix"), np.float64)
            extrinsic = np.asarray(_as_array(given["extrinsic_matrix"], "extrinsic_matrix"), np.float64)
        else:
            center, eye, up = (np.asarray(_as_array(given[name], name), np.float64) for name in by_view[1:4])
            intrinsic, extrinsic = _view(float(given["fov_deg"]), center, eye, up, size)
        return _like(next((v for v in given.values() if _is_tensor(v)), None), _pinhole(intrinsic, extrinsic, size))


def _view(fov: float, center: np.ndarray, eye: np.ndarray, up: np.ndarray, size: tuple[int, int]):
    """Intrinsic and extrinsic matrix of a camera with a horizontal field of view in degrees.

    As in Open3D the rows of the picture go up, and its columns to the left.
    """
    focal = 0.5 * size[0] / math.tan(0.5 * math.radians(fov))
    intrinsic = np.array([[focal, 0, 0.5 * size[0]], [0, focal, 0.5 * size[1]], [0, 0, 1]])
    ahead = (center - eye) / np.linalg.norm(center - eye)
    left = np.cross(up, ahead)
    left /= np.linalg.norm(left)
    extrinsic = np.eye(4)
    extrinsic[:3, :3] = left, np.cross(ahead, left), ahead
    extrinsic[:3, 3] = -extrinsic[:3, :3] @ eye
    return intrinsic, extrinsic


def _pinhole(intrinsic: np.ndarray, extrinsic: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    x, y = np.meshgrid(np.arange(size[0]) + 0.5, np.arange(size[1]) + 0.5)
    to_scene = extrinsic[:3, :3].T
    directions = np.stack((x, y, np.ones_like(x)), axis=-1) @ np.linalg.inv(intrinsic).T @ to_scene.T
    origins = np.broadcast_to(-to_scene @ extrinsic[:3, 3], directions.shape)
    return np.concatenate((origins, directions), axis=-1).astype(np.float32)
