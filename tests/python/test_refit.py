"""Refits: hits are those of a fresh build."""

import threading

import numpy as np
import pytest

import hiprt
from shapes import rays_at, same, soup, sphere


def test_hits_after_a_refit_are_those_of_a_fresh_build(rng):
    vertices, indices = soup(rng, 500)
    origins, directions = rays_at(rng, 1500)
    for builder in ("hploc", "sbvh"):
        scene = hiprt.build(hiprt.Mesh(vertices, indices), builder=builder)
        scene.cast(origins, directions)
        for step in range(3):
            moved = hiprt.Mesh(vertices + rng.normal(0, 0.05, vertices.shape), indices)
            figures = scene.refit(moved)
            assert figures["sah_cost"] > 0 and isinstance(figures["rebuild_advised"], bool)
            fresh = hiprt.build(moved)
            assert same(fresh.cast(origins, directions), scene.cast(origins, directions)), (builder, step)
            assert np.array_equal(fresh.bounds, scene.bounds)
        scene.validate()


def test_a_mesh_in_disorder_advises_a_rebuild(rng):
    vertices, indices = sphere(40)
    scene = hiprt.build(hiprt.Mesh(vertices[indices].reshape(-1, 3)), builder="hploc", pair_triangles=False)
    order = rng.permutation(len(indices))
    assert scene.refit(hiprt.Mesh(vertices[indices[order]].reshape(-1, 3)))["rebuild_advised"]
    assert not scene.refit(hiprt.Mesh(1.1 * vertices[indices].reshape(-1, 3)))["rebuild_advised"]


def test_another_mesh_is_refused_and_the_scene_stays(rng):
    vertices, indices = soup(rng, 50)
    scene = hiprt.build(hiprt.Mesh(vertices, indices))
    before = scene.bytes.tobytes()
    for mesh in (hiprt.Mesh(vertices, indices[:-1]), [hiprt.Mesh(vertices, indices)] * 2,
                 hiprt.Mesh(np.where(np.arange(150)[:, None] == 7, np.nan, vertices), indices)):
        with pytest.raises(hiprt.InputError):
            scene.refit(mesh)
    assert scene.bytes.tobytes() == before


def test_queries_during_refits_see_one_state_or_another(rng):
    vertices, indices = sphere(40)
    scene = hiprt.build(hiprt.Mesh(vertices, indices), builder="hploc")
    origins = np.zeros((20000, 3), np.float32)
    directions = rng.normal(size=origins.shape).astype(np.float32)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    faults, stop = [], threading.Event()

    def trace():
        while not stop.is_set():
            t = scene.cast(origins, directions).t
            if not (np.allclose(t, 1, atol=0.02) or np.allclose(t, 2, atol=0.04)):
                faults.append(t)

    threads = [threading.Thread(target=trace) for _ in range(3)]
    for thread in threads:
        thread.start()
    for step in range(20):
        scene.refit(hiprt.Mesh((1 + step % 2) * vertices, indices))
    stop.set()
    for thread in threads:
        thread.join()
    assert not faults
