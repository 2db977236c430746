"""trimesh's RayMeshIntersector: the same methods, arguments and results, traced by hiprt.

    from hiprt.trimesh import RayMeshIntersector   # in place of trimesh.ray.ray_pyembree.RayMeshIntersector
    mesh.ray = RayMeshIntersector(mesh)

trimesh itself is not needed: a mesh is an object with vertices (n x 3) and faces (m x 3).
"""

from __future__ import annotations

from typing import Any, Optional

import numpy as np

from ._arrays import INVALID
from ._input import Mesh
from ._scene import Scene, build

# Hits of a ray that are closer than this part of the mesh's size are one hit, as in trimesh: a ray through the edge of
# two triangles meets both.
_SAME_HIT = 1e-6


def _vectors(values: Any) -> np.ndarray:
    return np.asanyarray(values, dtype=np.float64)


class RayMeshIntersector:
    """Rays against one mesh. It is built again when the mesh has changed.

    geometry: the mesh. scale_to_box: takes coordinates relative to the middle of the mesh, before they are rounded to
    float32. precision, quality, threads: see hiprt.Scene and hiprt.build().
    """

    def __init__(self, geometry: Any, scale_to_box: bool = True, *, precision: str = "watertight",
                 quality: str = "balanced", threads: int = 0) -> None:
        self.mesh = geometry
        self._scale_to_box = scale_to_box
        self._precision = precision
        self._quality = quality
        self._threads = threads
        self._built: Optional[Scene] = None
        self._key: Any = None
        self._middle = np.zeros(3)

    @property
    def scene(self) -> Scene:
        """The hiprt.Scene of the mesh, which is built when it is first needed."""
        key = hash(self.mesh)
        if self._built is None or key != self._key:
            vertices = _vectors(self.mesh.vertices).reshape(-1, 3)
            self._middle = np.zeros(3)
            if self._scale_to_box and len(vertices) != 0:
                self._middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
            self._built = build(Mesh(vertices - self._middle, np.asarray(self.mesh.faces).reshape(-1, 3)),
                                self._quality, threads=self._threads)
            self._key = key
        return self._built

    def _rays(self, ray_origins: Any, ray_directions: Any) -> tuple[Scene, np.ndarray, np.ndarray]:
        origins, directions = _vectors(ray_origins), _vectors(ray_directions)
        if origins.shape != directions.shape:
            raise ValueError("Ray origin and direction don't match!")
        if origins.ndim != 2 or origins.shape[1] != 3:
            raise ValueError(f"rays must be (n, 3), not {origins.shape}")
        scene = self.scene
        return scene, origins - self._middle, directions

    def intersects_location(self, ray_origins: Any, ray_directions: Any, multiple_hits: bool = True,
                            **kwargs: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Where rays hit the mesh: locations (m x 3, float64), index_ray (m), index_tri (m)."""
        triangles, rays, locations = self.intersects_id(ray_origins, ray_directions, multiple_hits=multiple_hits,
                                                        return_locations=True, **kwargs)
        return locations, rays, triangles

    def intersects_id(self, ray_origins: Any, ray_directions: Any, multiple_hits: bool = True, max_hits: int = 100,
                      return_locations: bool = False, **_kwargs: Any):
        """Which triangles rays hit: index_tri (m), index_ray (m), and with return_locations locations (m x 3).

        Hits are sorted by ray, then by distance. multiple_hits: all hits, at most max_hits of a ray; else the first.
        """
        scene, origins, directions = self._rays(ray_origins, ray_directions)
        if multiple_hits:
            found = scene.list(origins, directions, precision=self._precision, threads=self._threads)
            rays, triangles, t = found.rays, found.primitive.astype(np.int64), found.t.astype(np.float64)
            kept = self._apart(scene, rays, t, directions, max_hits)
            rays, triangles, t = rays[kept], triangles[kept], t[kept]
        else:
            hits = scene.cast(origins, directions, precision=self._precision, threads=self._threads)
            rays = np.flatnonzero(hits.found)
            triangles, t = hits.primitive[rays].astype(np.int64), hits.t[rays].astype(np.float64)
        if not return_locations:
            return triangles, rays
        return triangles, rays, self._locations(_vectors(ray_origins)[rays], directions[rays], triangles, t)

    def intersects_first(self, ray_origins: Any, ray_directions: Any, **_kwargs: Any) -> np.ndarray:
        """The first triangle that each ray hits (n, int64); -1: none."""
        scene, origins, directions = self._rays(ray_origins, ray_directions)
        primitive = scene.cast(origins, directions, precision=self._precision, threads=self._threads).primitive
        return np.where(primitive == INVALID, np.int64(-1), primitive.astype(np.int64))

    def intersects_any(self, ray_origins: Any, ray_directions: Any, **_kwargs: Any) -> np.ndarray:
        """Whether each ray hits the mesh (n, bool)."""
        scene, origins, directions = self._rays(ray_origins, ray_directions)
        return scene.occluded(origins, directions, precision=self._precision, threads=self._threads)

    def contains_points(self, points: Any) -> np.ndarray:
        """Whether each point (n x 3) is inside of a closed mesh (n, bool). Crossings are counted exactly."""
        points = _vectors(points)
        if points.ndim != 2 or points.shape[1] != 3:
            raise ValueError("points must be (n,3)")
        scene = self.scene
        single = (points - self._middle).astype(np.float32)
        return scene.count(single, np.array([0, 0, 1], np.float32), precision="reference",
                           threads=self._threads) % 2 == 1

    def _apart(self, scene: Scene, rays: np.ndarray, t: np.ndarray, directions: np.ndarray,
               most: int) -> np.ndarray:
        """Which hits to report: one of several at the same place, and the first of each ray."""
        low, high = scene.bounds.astype(np.float64)
        nearest = _SAME_HIT * float(np.linalg.norm(high - low))
        distance = t * np.linalg.norm(directions, axis=1)[rays]
        first = np.ones(len(rays), bool)
        first[1:] = rays[1:] != rays[:-1]
        kept = first.copy()
        kept[1:] |= distance[1:] - distance[:-1] > nearest
        before = np.cumsum(kept)
        begin = np.maximum.accumulate(np.where(first, before, 0))
        return kept & (before - begin < most)

    def _locations(self, origins: np.ndarray, directions: np.ndarray, triangles: np.ndarray,
                   t: np.ndarray) -> np.ndarray:
        """Hit points in float64: t is computed again from the mesh's own vertices, where that is well defined."""
        corners = _vectors(self.mesh.vertices)[np.asarray(self.mesh.faces)[triangles]].reshape(-1, 3, 3)
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        with np.errstate(divide="ignore", invalid="ignore"):
            exact = np.einsum("ij,ij->i", normals, corners[:, 0] - origins) / np.einsum("ij,ij->i", normals, directions)
            close = np.abs(exact - t) <= 1e-4 * np.abs(t) + _SAME_HIT
        return origins + np.where(close, exact, t)[:, None] * directions

    def __getstate__(self) -> dict:
        return {**self.__dict__, "_built": None}

    def __copy__(self, *_args: Any) -> "RayMeshIntersector":
        return RayMeshIntersector(self.mesh, self._scale_to_box, precision=self._precision, quality=self._quality,
                                  threads=self._threads)

    def __deepcopy__(self, *_args: Any) -> "RayMeshIntersector":
        return self.__copy__()
