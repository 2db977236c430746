"""Pictures: the right pixels, and files that other programs read."""

import struct
import zlib

import numpy as np
import pytest

import hiprt
from hiprt import render
from shapes import sphere


def read_png(data):
    """Pixels of a PNG file without filters, by the specification (ISO/IEC 15948)."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, packed, header = 8, b"", None
    while at < len(data):
        size, = struct.unpack(">I", data[at:at + 4])
        kind, content = data[at + 4:at + 8], data[at + 8:at + 8 + size]
        assert struct.unpack(">I", data[at + 8 + size:at + 12 + size])[0] == zlib.crc32(kind + content)
        header = struct.unpack(">IIBBBBB", content) if kind == b"IHDR" else header
        packed += content if kind == b"IDAT" else b""
        at += 12 + size
    width, height, bits, colour, *_ = header
    assert bits == 8 and colour in (0, 2)
    rows = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, -1)
    assert (rows[:, 0] == 0).all()
    return rows[:, 1:].reshape(height, width, 3) if colour == 2 else rows[:, 1:]


@pytest.fixture(scope="module")
def ball():
    return hiprt.build(hiprt.Mesh(*sphere(60)))


def test_png_files_hold_the_pixels(rng, tmp_path):
    for shape in ((5, 7), (5, 7, 3), (1, 1)):
        pixels = rng.integers(0, 256, shape).astype(np.uint8)
        assert np.array_equal(read_png(render.png(pixels)), pixels)
    assert read_png(render.png(np.array([[0.0, 0.5, 1.0, 7.0]]))).tolist() == [[0, 128, 255, 255]]
    render.write_png(tmp_path / "a.png", np.ones((2, 3)))
    assert read_png((tmp_path / "a.png").read_bytes()).shape == (2, 3)
    with pytest.raises(hiprt.InputError, match=r"picture: expected height x width .* found shape \(2, 3, 4\)"):
        render.png(np.ones((2, 3, 4)))


def test_normals_of_a_ball(ball):
    camera = render.Camera(eye=(0, -4, 0), target=(0, 0, 0), fov=40)
    picture = render.normals(ball, camera, 201, 101)
    assert picture.shape == (101, 201, 3) and picture.dtype == np.uint8
    assert (picture[0, 0] == 255).all()
    # x to the right, z up, and the middle faces the camera at -y.
    assert np.abs(picture[50, 100].astype(int) - [128, 0, 128]).max() <= 6
    assert picture[50, 110, 0] > 140 > 120 > picture[50, 90, 0]
    assert picture[40, 100, 2] > 140 > 120 > picture[60, 100, 2]
    half = 50.5 / np.tan(np.radians(20)) * np.tan(np.arcsin(1 / 4))  # Of the silhouette, in pixels.
    seen = (picture != 255).any(axis=2)
    assert abs(seen[:, 100].sum() - 2 * half) <= 2 and abs(seen[50].sum() - 2 * half) <= 2


def test_ambient_occlusion(ball):
    camera = render.Camera(eye=(0, -4, 0), target=(0, 0, 0))
    free = render.ambient_occlusion(ball, camera, 60, 40, samples=4)
    assert free.shape == (40, 60) and free.dtype == np.float32
    assert (free == 1).all()  # A convex body hides nothing of the sky.
    vertices, indices = sphere(60)
    room = hiprt.build([hiprt.Mesh(vertices, indices), hiprt.Mesh(9 * vertices, indices)])
    closed = render.ambient_occlusion(room, camera, 60, 40, samples=4)
    assert (closed == 0).all()
    near = render.ambient_occlusion(room, camera, 60, 40, samples=4, radius=1.0)
    assert (near[18:22, 28:32] == 1).all()
    # On a floor beside an endless wall half of the light is hidden.
    corner = hiprt.build([hiprt.Mesh([[-1e3, 0, 0], [1e3, 0, 0], [0, -1e4, 0]]),
                          hiprt.Mesh([[-1e6, 0, 0], [1e6, 0, 0], [0, 0, 1e6]])])
    down = render.Camera(eye=(0, -0.01, 5), target=(0, -0.01, 0), up=(0, 1, 0), fov=0.1)
    part = render.ambient_occlusion(corner, down, 16, 16, samples=200)
    assert abs(part.mean() - 0.5) < 0.03


def test_notebooks_show_a_scene(ball):
    picture = read_png(ball._repr_png_())
    assert picture.shape == (240, 320, 3)
    seen = (picture != 255).any(axis=2)
    assert 0.1 < seen.mean() < 0.6 and not seen[[0, -1]].any() and not seen[:, [0, -1]].any()
    assert hiprt.build([])._repr_png_()[:4] == b"\x89PNG"


def test_wrong_cameras(ball):
    for camera in (render.Camera((0, 0, 0), (0, 0, 1)), render.Camera((0, 0, 0), (1, 0, 0), fov=180),
                   render.Camera((1, 1, 1), (1, 1, 1))):
        with pytest.raises(hiprt.InputError, match="camera"):
            render.normals(ball, camera)
    with pytest.raises(hiprt.InputError, match="samples: 0"):
        render.ambient_occlusion(ball, samples=0)
