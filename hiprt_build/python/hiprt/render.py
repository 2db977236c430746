"""Pictures of scenes as arrays, for notebooks and reports.

    picture = hiprt.render.normals(scene)              # height x width x 3, uint8
    hiprt.render.write_png("scene.png", picture)
"""

from __future__ import annotations

import math
import os
import struct
import zlib
from dataclasses import dataclass
from typing import Any, Optional, Sequence

import numpy as np

from ._errors import InputError
from ._scene import Scene


@dataclass(frozen=True)
class Camera:
    """A pinhole camera. fov: vertical field of view in degrees, more than 0 and less than 180."""

    eye: Sequence[float]
    target: Sequence[float]
    up: Sequence[float] = (0.0, 0.0, 1.0)
    fov: float = 40.0

    @staticmethod
    def around(scene: Scene, towards: Sequence[float] = (-1.0, 1.4, -0.8), up: Sequence[float] = (0.0, 0.0, 1.0),
               fov: float = 40.0) -> "Camera":
        """A camera that sees the whole scene and looks in the direction `towards`."""
        low, high = np.asarray(scene.bounds, np.float64)
        if not (low <= high).all():
            low, high = -np.ones(3), np.ones(3)  # An empty scene.
        middle, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low)) or 1.0
        ahead = np.asarray(towards, np.float64) / np.linalg.norm(towards)
        eye = middle - ahead * radius / math.sin(0.5 * math.radians(fov))
        return Camera(tuple(eye), tuple(middle), up, fov)

    def rays(self, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
        """Origin (3) and directions (height x width x 3) of the rays through the middles of pixels, float32."""
        eye, target = np.asarray(self.eye, np.float64), np.asarray(self.target, np.float64)
        ahead = target - eye
        right = np.cross(ahead, np.asarray(self.up, np.float64))
        if not (0 < self.fov < 180) or not np.linalg.norm(right) > 0:
            raise InputError("camera: fov must be between 0 and 180 degrees, and up must not point along the view")
        ahead, right = ahead / np.linalg.norm(ahead), right / np.linalg.norm(right)
        down = np.cross(ahead, right)
        half = math.tan(0.5 * math.radians(self.fov))
        y = ((np.arange(height) + 0.5) / height * 2 - 1) * half
        x = ((np.arange(width) + 0.5) / width * 2 - 1) * half * width / height
        directions = ahead + y[:, None, None] * down + x[None, :, None] * right
        return eye.astype(np.float32), directions.astype(np.float32)


def normals(scene: Scene, camera: Optional[Camera] = None, width: int = 640, height: int = 480,
            **query: Any) -> np.ndarray:
    """height x width x 3, uint8: normals towards the camera as colours on white. query: arguments of Scene.cast()."""
    origin, directions = (camera or Camera.around(scene)).rays(width, height)
    hits = scene.cast(origin, directions, **query)
    colours = 0.5 + 0.5 * _towards(hits.normal, -directions)
    return _bytes_of(np.where(hits.found[..., None], colours, 1.0))


def ambient_occlusion(scene: Scene, camera: Optional[Camera] = None, width: int = 640, height: int = 480, *,
                      samples: int = 16, radius: float = math.inf, seed: int = 0, **query: Any) -> np.ndarray:
    """height x width, float32: the part of the hemisphere over each point that is open, 0 to 1; 1 where nothing is hit.

    samples: rays per pixel, distributed by cosine. radius: farther blockers do not count. query: see Scene.occluded().
    """
    if samples < 1:
        raise InputError(f"samples: {samples} is less than 1")
    origin, directions = (camera or Camera.around(scene)).rays(width, height)
    hits = scene.cast(origin, directions, **query)
    normal = _towards(hits.normal, -directions).astype(np.float32)
    starts = hits.spawn_origins(origin, directions, normal)[hits.found].astype(np.float32)
    normal, open_rays = normal[hits.found], np.zeros(int(hits.found.sum()), np.float32)
    random = np.random.default_rng(seed)
    for _ in range(samples):
        # A point on a sphere that touches the surface from above is distributed by cosine.
        sphere = random.normal(size=normal.shape).astype(np.float32)
        sphere /= np.maximum(np.linalg.norm(sphere, axis=1, keepdims=True), 1e-6)
        up = normal + 0.999 * sphere
        up /= np.linalg.norm(up, axis=1, keepdims=True)
        open_rays += ~scene.occluded(starts, up, tmax=radius, **query)
    picture = np.ones((height, width), np.float32)
    picture[hits.found] = open_rays / samples
    return picture


def _towards(normal: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Unit normals on the side of the directions; 0 for triangles without area."""
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    unit = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    return np.where((unit * direction).sum(axis=-1, keepdims=True) < 0, -unit, unit)


def _bytes_of(picture: np.ndarray) -> np.ndarray:
    if picture.dtype == np.uint8:
        return picture
    return (np.clip(picture, 0, 1) * 255 + 0.5).astype(np.uint8)


def png(picture: np.ndarray) -> bytes:
    """A PNG file. picture: height x width (grey) or height x width x 3, uint8, or numbers from 0 to 1."""
    pixels = np.ascontiguousarray(_bytes_of(np.asarray(picture)))
    if pixels.ndim not in (2, 3) or pixels.size == 0 or (pixels.ndim == 3 and pixels.shape[2] != 3):
        raise InputError(f"picture: expected height x width or height x width x 3, found shape {pixels.shape}")
    height, width = pixels.shape[:2]
    rows = np.zeros((height, 1 + pixels[0].size), np.uint8)  # Each row begins with its filter: none.
    rows[:, 1:] = pixels.reshape(height, -1)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 0 if pixels.ndim == 2 else 2, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)) +
            chunk(b"IEND", b""))


def write_png(path: "os.PathLike[str] | str", picture: np.ndarray) -> None:
    """Writes png(picture)."""
    with open(path, "wb") as file:
        file.write(png(picture))
