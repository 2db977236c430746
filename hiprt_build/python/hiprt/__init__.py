"""Bounding volume hierarchies and rays for numpy arrays.

    import hiprt
    scene = hiprt.build(hiprt.Mesh(vertices, indices))
    hits = scene.cast(origins, directions)

hiprt.trimesh and hiprt.open3d_like have the ray classes of trimesh and Open3D; hiprt.render makes pictures.
"""

from . import _core, open3d_like, render, trimesh
from ._arrays import INVALID
from ._errors import Cancelled, Error, FileError, InputError, OutOfMemoryError
from ._input import Instances, Mesh
from ._scene import HitList, Hits, Scene, build, from_bytes, load

__version__: str = _core.version()

__all__ = ["INVALID", "Cancelled", "Error", "FileError", "HitList", "Hits", "InputError", "Instances", "Mesh",
           "OutOfMemoryError", "Scene", "build", "from_bytes", "load", "open3d_like", "render", "trimesh"]
