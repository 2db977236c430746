"""Bounding volume hierarchies, rays and points for numpy arrays.

    import hiprt
    scene = hiprt.build(hiprt.Mesh(vertices, indices))
    hits = scene.cast(origins, directions)
    near = scene.closest_point(points)

hiprt.trimesh and hiprt.open3d_like have the classes of trimesh and Open3D; hiprt.render makes pictures.
"""

from . import _core, open3d_like, render, trimesh
from ._arrays import INVALID
from ._errors import Cancelled, Error, FileError, GpuError, InputError, OutOfMemoryError
from ._gpu_arrays import GpuArray
from ._input import Instances, Mesh
from ._points import ClosestPoints, Feature, OverlapList, PointList
from ._scene import HitList, Hits, Scene, build, from_bytes, load

__version__: str = _core.version()

__all__ = ["INVALID", "Cancelled", "ClosestPoints", "Error", "Feature", "FileError", "GpuArray", "GpuError", "HitList",
           "Hits", "InputError", "Instances", "Mesh", "OutOfMemoryError", "OverlapList", "PointList", "Scene", "build",
           "from_bytes", "load", "open3d_like", "render", "trimesh"]
