"""Files: saving, mapping, bytes, pickles, and files that are not good."""

import copy
import pickle

import numpy as np
import pytest

import hiprt
from shapes import rays_at, same, soup


@pytest.fixture
def scene(rng):
    return hiprt.build(hiprt.Mesh(*soup(rng, 400)))


def test_a_scene_survives_every_way_out_and_in(rng, scene, tmp_path):
    path = tmp_path / "scene.bvh"
    scene.save(path)
    assert path.read_bytes() == scene.bytes.tobytes()
    origins, directions = rays_at(rng, 1200)
    expected = scene.cast(origins, directions)
    data = scene.bytes.tobytes()
    others = [hiprt.load(path), hiprt.load(str(path), validate=False, threads=1), hiprt.from_bytes(data),
              hiprt.from_bytes(scene.bytes, validate=False), hiprt.from_bytes(memoryview(data)),
              hiprt.from_bytes(bytearray(b"." + data)[1:]), pickle.loads(pickle.dumps(scene)), copy.copy(scene),
              copy.deepcopy(scene)]
    for other in others:
        assert same(expected, other.cast(origins, directions))
        assert np.array_equal(other.bounds, scene.bounds) and other.primitives == 400


def test_bytes_are_a_view_that_keeps_the_file_alive(scene):
    data = scene.bytes
    before = data.tobytes()
    assert data.dtype == np.uint8 and not data.flags.writeable and not data.flags.owndata
    with pytest.raises(ValueError):
        data[0] = 0
    del scene
    assert data.tobytes() == before


def test_bad_files_are_refused_with_the_fault_and_the_byte(scene, tmp_path):
    path = tmp_path / "scene.bvh"
    data = bytearray(scene.bytes.tobytes())
    path.write_bytes(data[:-100])
    with pytest.raises(hiprt.InputError, match=r"scene.bvh: .* bytes, but its header says .*truncated"):
        hiprt.load(path)
    data[5000] ^= 1
    path.write_bytes(data)
    with pytest.raises(hiprt.InputError, match=r"scene.bvh: .*BadChecksum"):
        hiprt.load(path)
    with pytest.raises(hiprt.InputError, match="BadChecksum"):
        hiprt.load(path, validate=False).validate()
    for junk in (b"", b"no file at all", bytes(4096)):
        with pytest.raises(hiprt.InputError):
            hiprt.from_bytes(junk)
        with pytest.raises(hiprt.InputError):
            hiprt.from_bytes(junk, validate=False)


def test_files_that_cannot_be_read_or_written(scene, tmp_path):
    with pytest.raises(hiprt.FileError, match="none.bvh': No such file"):
        hiprt.load(tmp_path / "none.bvh")
    with pytest.raises(OSError):
        hiprt.load(tmp_path)
    with pytest.raises(hiprt.FileError, match="absent"):
        scene.save(tmp_path / "absent" / "scene.bvh")


def test_statistics_and_summary(scene):
    statistics, summary = scene.statistics(), scene.validate()
    assert statistics["builder"] == "sbvh" and statistics["bytes"] == scene.bytes.nbytes
    assert statistics["nodes"] == summary["nodes"] > 50 and statistics["depth"] == summary["depth"] > 2
    assert summary["primitives"] == 400 and summary["dropped"] == 0
    assert statistics["sah_cost"] > 1 and 0 <= statistics["exchange_slack"] <= 1
    assert "builder" not in hiprt.from_bytes(scene.bytes).statistics()


def test_bounds_are_those_of_the_vertices(rng):
    vertices, indices = soup(rng, 50)
    scene = hiprt.build(hiprt.Mesh(vertices, indices))
    assert scene.bounds.dtype == np.float32 and scene.bounds.shape == (2, 3)
    assert (scene.bounds[0] <= vertices.min(axis=0)).all() and (scene.bounds[1] >= vertices.max(axis=0)).all()
    assert np.allclose(scene.bounds, [vertices.min(axis=0), vertices.max(axis=0)], atol=1e-5)
    assert "50 primitives" in repr(scene)
    empty = hiprt.build([]).bounds
    assert (empty[0] == np.inf).all() and (empty[1] == -np.inf).all()
