"""Triangles that touch boxes, against the 13 separating axes in float64."""

import numpy as np
import pytest

import hiprt
from point_oracle import box_gaps
from shapes import same, soup
from test_instances import placed, random_matrices
from test_points import BUILDS


def boxes_at(rng, count, low=-0.5, high=1.5):
    corner = rng.uniform(low, high, (count, 3))
    return np.stack((corner, corner + rng.exponential(0.2, (count, 3))), axis=1).astype(np.float32)


@pytest.mark.parametrize("options", BUILDS)
def test_overlaps_are_those_of_brute_force(rng, options):
    vertices, indices = soup(rng, 200)
    scene = hiprt.build(hiprt.Mesh(vertices, indices), **options)
    boxes = boxes_at(rng, 2000)
    found = scene.overlap(boxes)
    gaps = box_gaps(vertices, indices, boxes)
    listed = np.zeros(gaps.shape, int)
    np.add.at(listed, (found.boxes, found.primitive), 1)
    assert listed.max() == 1 and ((listed == 1) == (gaps <= 0))[np.abs(gaps) > 1e-12].all()
    assert found.offsets[-1] == len(found.primitive) > 2000
    later = found.boxes[1:] == found.boxes[:-1]
    assert (np.diff(found.primitive.astype(int))[later] > 0).all()
    counts = scene.count_overlaps(boxes)
    assert counts.dtype == np.uint32 and (counts == np.diff(found.offsets)).all()
    assert same(found, scene.overlap(boxes, threads=1))


def test_what_touches_overlaps_exactly():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    for quality in ("fast", "high"):
        scene = hiprt.build(hiprt.Mesh(vertices), quality)
        above = np.nextafter(np.float32(0), np.float32(1))
        beside = np.nextafter(np.float32(0.5), np.float32(1))
        boxes = np.array([[[0, 0, 0], [1, 1, 1]], [[0, 0, above], [1, 1, 1]],  # The plane, and just above it.
                          [[0.5, 0.5, -1], [2, 2, 1]], [[0.5, beside, -1], [2, 2, 1]],  # The middle of an edge.
                          [[1, 0, 0], [1, 0, 0]], [[1, 1, 1], [0, 0, 0]]], np.float32)  # A vertex; an empty box.
        assert scene.count_overlaps(boxes).tolist() == [1, 0, 1, 0, 1, 0]


def test_instances_and_masks(rng):
    vertices, indices = soup(rng, 40)
    matrices = random_matrices(rng, 5)
    scene = hiprt.build(hiprt.Instances(hiprt.build(hiprt.Mesh(vertices, indices)), matrices))
    boxes = boxes_at(rng, 600, -2, 2)
    found = scene.overlap(boxes)
    gaps = box_gaps(placed(vertices, matrices).reshape(-1, 3),
                    np.concatenate([indices.astype(int) + i * len(vertices) for i in range(5)]), boxes)
    listed = np.zeros(gaps.shape, int)
    np.add.at(listed, (found.boxes, found.instances[:, 0] * 40 + found.primitive), 1)
    assert listed.max() == 1 and ((listed == 1) == (gaps <= 0))[np.abs(gaps) > 1e-5].all()
    assert (scene.count_overlaps(boxes) == np.diff(found.offsets)).all()
    meshes = [hiprt.Mesh(vertices, indices, mask=1), hiprt.Mesh(vertices, indices, mask=2)]
    flat = hiprt.build(meshes)
    whole = np.array([[-9, -9, -9], [9, 9, 9]], np.float32)
    assert flat.count_overlaps(whole, mask=[1, 2, 3, 4]).tolist() == [40, 40, 80, 0]
    assert flat.overlap(whole, mask=2).geometry.tolist() == [1] * 40


def test_shapes_and_errors(rng):
    scene = hiprt.build(hiprt.Mesh(*soup(rng, 50)))
    assert scene.count_overlaps(scene.bounds) == 50
    grid = boxes_at(rng, 12).reshape(3, 4, 2, 3)
    assert scene.count_overlaps(grid).shape == (3, 4) and len(scene.overlap(grid).offsets) == 13
    assert scene.count_overlaps(np.zeros((0, 2, 3))).shape == (0,)
    for bad, message in ((np.zeros((2, 6)), r"boxes: expected ... x 2 x 3 numbers, found shape \(2, 6\)"),
                         ([[0, 0, 0], [1, np.inf, 1]], r"boxes\[1, 1\]: inf is not finite"),
                         ([[0, 0, 0], [1, 1e300, 1]], r"boxes\[1, 1\]: 1e\+300 is beyond the range of float32")):
        for query in (scene.overlap, scene.count_overlaps):
            with pytest.raises(hiprt.InputError, match=message):
                query(bad)
