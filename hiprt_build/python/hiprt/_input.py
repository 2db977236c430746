"""What a scene is built from: meshes, and instances of scenes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Sequence

import numpy as np

from ._arrays import INVALID, as_float32, as_numpy, as_real, as_rows, as_uint32
from ._errors import InputError

if TYPE_CHECKING:
    from ._scene import Scene

# MotionKind of hiprt_device/format/motion.h.
_MOTIONS = {"slerp": 1, "nlerp": 2, "matrix": 3}


class Mesh:
    """A triangle mesh: one geometry of a scene.

    vertices: n x 3. float32 in any row stride is read in place. Other types are converted: float64 is rounded to the
        nearest float32, because BVH files hold float32. A finite number beyond the range of float32 is an InputError.
    indices: m x 3 numbers of vertices, 0 to n - 1. uint32 and int32 are read in place, other integers are converted.
        None: triangle i has the vertices 3 i, 3 i + 1 and 3 i + 2.
    mask: 32 bits; a ray sees the mesh if (ray mask & mask) != 0.
    name: for the provenance block of the file.

    Triangles with a NaN or infinite corner, or with two equal corners, keep their number, and no ray hits them.
    The arrays must not change while a build reads them.
    """

    __slots__ = ("vertices", "indices", "mask", "name")

    def __init__(self, vertices: Any, indices: Any = None, *, mask: int = INVALID, name: str = "") -> None:
        self.vertices = as_rows(as_float32(vertices, "vertices"), "vertices")
        self.indices = None if indices is None else as_rows(as_uint32(indices, "indices"), "indices")
        if not 0 <= mask <= INVALID:
            raise InputError(f"mask: {mask} is not between 0 and 2^32 - 1")
        self.mask = int(mask)
        self.name = name

    def __len__(self) -> int:
        """Number of triangles."""
        return len(self.vertices) // 3 if self.indices is None else len(self.indices)

    def __repr__(self) -> str:
        return f"hiprt.Mesh({len(self.vertices)} vertices, {len(self)} triangles)"


def as_meshes(what: Any) -> list[Mesh]:
    """A mesh or several. Objects with vertices and faces, such as those of trimesh, are meshes too."""
    if isinstance(what, Mesh):
        return [what]
    if hasattr(what, "vertices") and hasattr(what, "faces"):
        return [Mesh(np.asarray(what.vertices), np.asarray(what.faces))]
    if isinstance(what, (list, tuple)):
        return [mesh for part in what for mesh in as_meshes(part)]
    raise InputError(f"expected a hiprt.Mesh, an object with vertices and faces, or a list of them, found {type(what)}")


def mesh_entries(meshes: Sequence[Mesh]) -> list[tuple]:
    """The meshes as the compiled part takes them."""
    return [(mesh.vertices, mesh.indices, mesh.mask, mesh.name) for mesh in meshes]


class Instances:
    """Scenes placed by transforms. hiprt.build(instances) makes a scene of them.

    objects: a Scene, an Instances, or a sequence of these. Scenes in it have no instances of their own, and all have
        one layout. Instances in Instances make further levels.
    transforms: k x 3 x 4, the rows of matrices from the object to the scene: column 3 is the translation. k x 4 x 4
        with a last row of 0 0 0 1 is accepted. float64 is rounded to float32. Each matrix must have an inverse.
        With times: k x len(times) x 3 x 4.
    which: k numbers of objects. None: object 0 if there is one, or object i for transform i.
    masks: k masks; a ray sees the instance if (ray mask & mask) != 0. None: all bits.
    ids: k numbers of your own, which Scene.instance_ids gives back. None: 0 to k - 1.
    times: ascending times of the keys, for instances that move. Rays have a time, too.
    motion: between two keys "slerp" turns along the shorter arc at constant speed, "nlerp" at slightly uneven speed,
        "matrix" blends matrices.
    """

    __slots__ = ("objects", "transforms", "which", "masks", "ids", "times", "motion")

    def __init__(self, objects: Any, transforms: Any, *, which: Any = None, masks: Any = None, ids: Any = None,
                 times: Any = None, motion: str = "slerp") -> None:
        self.objects = tuple(objects) if isinstance(objects, (list, tuple)) else (objects,)
        self.times = np.zeros(1, np.float32) if times is None else np.ascontiguousarray(as_float32(times, "times"))
        if self.times.ndim != 1 or len(self.times) == 0:
            raise InputError(f"times: expected a list of at least one time, found shape {self.times.shape}")
        self.transforms = _as_transforms(transforms, None if times is None else len(self.times))
        count = len(self.transforms)
        if which is None and len(self.objects) not in (1, count):
            raise InputError(f"which: {count} transforms and {len(self.objects)} objects: say which object is where")
        if which is None:
            which = np.zeros(count, np.uint32) if len(self.objects) == 1 else np.arange(count, dtype=np.uint32)
        self.which = _per_instance(which, "which", count)
        if count != 0 and int(self.which.max()) >= len(self.objects):
            raise InputError(f"which: there is no object {int(self.which.max())}; there are {len(self.objects)}")
        self.masks = _per_instance(np.full(count, INVALID, np.uint32) if masks is None else masks, "masks", count)
        self.ids = _per_instance(np.arange(count, dtype=np.uint32) if ids is None else ids, "ids", count)
        if motion not in _MOTIONS:
            raise InputError(f"motion: '{motion}' is none of {', '.join(_MOTIONS)}")
        self.motion = motion

    def __len__(self) -> int:
        """Number of instances."""
        return len(self.transforms)

    def __repr__(self) -> str:
        return f"hiprt.Instances({len(self)} instances of {len(self.objects)} objects)"


def _per_instance(values: Any, name: str, count: int) -> np.ndarray:
    array = np.ascontiguousarray(as_uint32(values, name))
    if array.shape != (count,):
        raise InputError(f"{name}: expected {count} numbers, one per transform, found shape {array.shape}")
    return array


def _as_transforms(values: Any, keys: int | None) -> np.ndarray:
    """k x keys x 3 x 4, without gaps."""
    array = as_real(values, "transforms")
    shape = "k x 3 x 4" if keys is None else f"k x {keys} x 3 x 4"
    if array.ndim != (3 if keys is None else 4) or array.shape[-2:] not in ((3, 4), (4, 4)) or \
            (keys is not None and array.shape[1] != keys):
        raise InputError(f"transforms: expected {shape} numbers (or 4 x 4 per matrix), found shape {array.shape}")
    if array.shape[-2] == 4:
        if not (array[..., 3, :] == (0, 0, 0, 1)).all():
            raise InputError("transforms: the last row of a 4 x 4 matrix is not 0 0 0 1")
        array = array[..., :3, :]
    array = np.ascontiguousarray(as_float32(array, "transforms"))
    return array.reshape(len(array), keys or 1, 3, 4)


def flattened(root: Instances) -> tuple[list[Scene], list[tuple]]:
    """The scenes, and the groups from the innermost to the root, as the compiled part takes them."""
    from ._scene import Scene
    scenes: list[Scene] = []
    order: list[Instances] = []

    def visit(instances: Instances) -> None:
        for part in instances.objects:
            if isinstance(part, Instances):
                if not any(part is other for other in order):
                    visit(part)
            elif not isinstance(part, Scene):
                raise InputError(f"objects: expected a hiprt.Scene or hiprt.Instances, found {type(part)}")
            elif not any(part is other for other in scenes):
                scenes.append(part)
        order.append(instances)

    visit(root)
    numbers = {id(part): i for i, part in enumerate([*scenes, *order])}
    groups = []
    for group in order:
        objects = np.array([numbers[id(part)] for part in group.objects], np.uint32)
        groups.append((objects[group.which] if len(group) else group.which, group.transforms, group.times, group.masks,
                       group.ids, _MOTIONS[group.motion]))
    return scenes, groups


__all__ = ["Instances", "Mesh", "as_meshes", "as_numpy", "flattened", "mesh_entries"]
