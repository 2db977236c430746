"""What arrays are accepted, read in place, converted or refused."""

import numpy as np
import pytest

import hiprt
from shapes import rays_at, same, soup, sphere


class Tensor:
    """A DLPack tensor of another library."""

    def __init__(self, array, device=(1, 0)):
        self.array, self.device = array, device

    def __dlpack__(self, **kwargs):
        return self.array.__dlpack__()

    def __dlpack_device__(self):
        return self.device


class CudaArray:
    __cuda_array_interface__ = {"shape": (1, 3), "typestr": "<f4", "data": (0, False), "version": 3}


def variants(array):
    """The same numbers in other layouts."""
    wide = np.zeros((len(array), 8), array.dtype)
    wide[:, 2:5] = array
    packed = np.zeros(len(array), np.dtype([("tag", "u1"), ("p", array.dtype, 3)]))
    packed["p"] = array
    locked = array.copy()
    locked.flags.writeable = False
    columns = np.zeros((3, len(array) * 2), array.dtype)
    columns[:, ::2] = array.T
    yield "contiguous", array
    yield "Fortran order", np.asfortranarray(array)
    yield "rows with gaps", wide[:, 2:5]
    yield "columns with gaps", columns[:, ::2].T
    yield "reversed twice", np.ascontiguousarray(array[::-1, ::-1])[::-1, ::-1]
    yield "not aligned", packed["p"]
    yield "read-only", locked
    yield "big-endian", array.astype(array.dtype.newbyteorder(">"))
    yield "DLPack", Tensor(array)
    yield "broadcast", np.broadcast_to(array, array.shape)


def test_rays_in_any_layout(rng):
    scene = hiprt.build(hiprt.Mesh(*soup(rng, 300)))
    for kind in (np.float32, np.float64):
        origins, directions = (a.astype(kind) for a in rays_at(rng, 1500))
        expected = scene.cast(origins, directions)
        for (name, o), (_, d) in zip(variants(origins), variants(directions)):
            assert same(expected, scene.cast(o, d)), (name, kind)
        t = np.zeros((1500, 2), kind)
        assert same(expected, scene.cast(origins, directions, t[:, 0], np.inf))


def test_meshes_in_any_layout(rng):
    vertices, indices = soup(rng, 300)
    expected = hiprt.build(hiprt.Mesh(vertices, indices)).bytes
    for name, positions in variants(vertices):
        assert np.array_equal(expected, hiprt.build(hiprt.Mesh(positions, indices)).bytes), name
    for name, faces in variants(indices):
        assert np.array_equal(expected, hiprt.build(hiprt.Mesh(vertices, faces)).bytes), name
    for kind in (np.int32, np.int64, np.uint64, np.int16):
        assert np.array_equal(expected, hiprt.build(hiprt.Mesh(vertices, indices.astype(kind))).bytes), kind
    assert np.array_equal(expected, hiprt.build(hiprt.Mesh(vertices.astype(np.float64), indices.tolist())).bytes)
    implicit = hiprt.build(hiprt.Mesh(vertices[indices].reshape(-1, 3)))
    origins, directions = rays_at(rng, 500)
    assert same(implicit.cast(origins, directions), hiprt.from_bytes(expected).cast(origins, directions))


def test_what_needs_no_copy_is_not_copied(rng):
    vertices, indices = soup(rng, 10)
    wide = np.zeros((30, 6), np.float32)
    wide[:, :3] = vertices
    mesh = hiprt.Mesh(wide[:, :3], indices.view(np.int32))
    assert np.shares_memory(mesh.vertices, wide) and np.shares_memory(mesh.indices, indices)


def test_float64_is_rounded_to_the_nearest_float32():
    third = 1 / 3
    mesh = hiprt.Mesh([[third, 0, 0], [1, 0, 0], [0, 1, 0]])
    assert mesh.vertices[0, 0] == np.float32(third)
    with pytest.raises(hiprt.InputError, match=r"vertices\[1, 2\]: 1e\+39 is beyond the range of float32"):
        hiprt.Mesh([[0, 0, 0], [0, 0, 1e39], [0, 1, 0]])
    with np.errstate(all="raise"):
        scene = hiprt.build(hiprt.Mesh([[0, 0, 0], [np.inf, 0, 0], [0, np.nan, 0]]))
    assert scene.validate()["dropped"] == 1


def test_float64_rays_use_double_unless_a_precision_is_named(rng):
    scene = hiprt.build(hiprt.Mesh(*sphere()))
    single = rays_at(rng, 100)
    double = [a.astype(np.float64) for a in single]
    assert scene.cast(*single).t.dtype == np.float32 and scene.cast(*double).t.dtype == np.float64
    assert scene.cast(single[0], double[1]).t.dtype == np.float64
    assert same(scene.cast(*single), scene.cast(*double, precision="watertight"))
    assert same(scene.cast(*double), scene.cast(*single, precision="double"))
    half = [a.astype(np.float16) for a in single]
    assert same(scene.cast(*half), scene.cast(*(a.astype(np.float32) for a in half)))


def test_memory_of_gpus_is_refused():
    scene = hiprt.build(hiprt.Mesh(*sphere()))
    down = np.zeros((1, 3), np.float32)
    for device in (2, 10):  # kDLCUDA, kDLROCM
        with pytest.raises(hiprt.InputError, match=f"origins: the tensor is in the memory of a GPU .DLPack device type "
                                                   f"{device}.*cpu"):
            scene.list(Tensor(down, (device, 0)), down)
    with pytest.raises(hiprt.InputError, match="vertices: the array is in the memory of a GPU"):
        hiprt.Mesh(CudaArray())


def test_wrong_arrays_are_refused(rng):
    vertices, indices = soup(rng, 4)
    for bad, message in ((vertices[:, :2], "vertices: expected an array of n x 3 numbers, found shape"),
                         (vertices[0], "vertices: expected an array of n x 3"), ([["a"] * 3], "expected numbers"),
                         (vertices.astype(complex), "expected numbers, found an array of complex128")):
        with pytest.raises(hiprt.InputError, match=message):
            hiprt.Mesh(bad, indices)
    for bad, message in (([[0, 1, -1]], r"indices\[0, 2\]: -1 is not between 0"),
                         ([[0, 1, 2.5]], "indices: expected whole numbers, found an array of float64"),
                         ([[0, 1, 2**32]], r"indices\[0, 2\]: 4294967296 is not between"),
                         ([0, 1, 2], "indices: expected an array of n x 3")):
        with pytest.raises(hiprt.InputError, match=message):
            hiprt.Mesh(vertices, bad)
    with pytest.raises(hiprt.InputError, match="mesh 0, triangle 1: index 12, but there are 12 vertices"):
        hiprt.build(hiprt.Mesh(vertices, [[0, 1, 2], [3, 4, 12]]))
    with pytest.raises(hiprt.InputError, match="expected a hiprt.Mesh"):
        hiprt.build("mesh")
    with pytest.raises(hiprt.InputError, match="multiple of 3|3"):
        hiprt.build(hiprt.Mesh(vertices[:4]))


def test_meshes_of_other_libraries(rng):
    class Other:
        vertices, faces = soup(rng, 20)

    scene = hiprt.build([Other(), [hiprt.Mesh(Other.vertices, Other.faces, name="second")]])
    assert scene.geometries == 2 and scene.primitives == 40


def test_errors_are_also_what_programs_catch():
    assert issubclass(hiprt.InputError, (ValueError, hiprt.Error)) and issubclass(hiprt.Error, RuntimeError)
    assert issubclass(hiprt.FileError, OSError) and issubclass(hiprt.OutOfMemoryError, MemoryError)
    with pytest.raises(ValueError):
        hiprt.Mesh([[1, 2]])
