"""Ctrl-C, progress callbacks, and the GIL."""

import os
import signal
import threading
import time

import numpy as np
import pytest

import hiprt
from shapes import rays_at, soup

RAYS = 100_000


@pytest.fixture(autouse=True)
def ctrl_c():
    """A program in the background may have been started with SIGINT ignored. Then Python raises nothing."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before if before is not None else signal.SIG_DFL)


@pytest.fixture(scope="module")
def dense():
    """Many hits per ray, so that queries take seconds."""
    rng = np.random.default_rng(5)
    return hiprt.build(hiprt.Mesh(*soup(rng, 10_000, 0.05)), "fast")


def interrupted_after(seconds, work):
    """Seconds from Ctrl-C to the KeyboardInterrupt of work()."""
    sent = []

    def send():
        sent.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(seconds, send)
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            work()
        return time.perf_counter() - sent[0]
    finally:
        timer.join()


def check_interrupts(work):
    # The machine may be busy with other things once, but not each time.
    delays = []
    for _ in range(4):
        delays.append(interrupted_after(0.25, work))
        if delays[-1] < 0.1:
            return
    raise AssertionError(f"seconds from Ctrl-C to KeyboardInterrupt: {delays}")


@pytest.mark.parametrize("query", ("cast", "occluded", "count", "list"))
def test_ctrl_c_ends_a_query(rng, dense, query):
    origins, directions = rays_at(rng, 4 * RAYS)

    def work():
        while True:
            getattr(dense, query)(origins, directions, precision="reference", threads=1)

    check_interrupts(work)


@pytest.mark.parametrize("query", ("closest_point", "nearest", "within", "signed_distance", "overlap"))
def test_ctrl_c_ends_a_query_of_points(rng, dense, query):
    points = rng.uniform(0, 1, (RAYS, 3)).astype(np.float32)
    boxes = np.stack((points - 0.1, points + 0.1), axis=-2)
    more = {"nearest": (500,), "within": (0.2,)}.get(query, ())

    def work():
        while True:
            getattr(dense, query)(boxes if query == "overlap" else points, *more, threads=1)

    check_interrupts(work)


def test_ctrl_c_ends_a_build(rng):
    mesh = hiprt.Mesh(*soup(rng, 200_000, 0.02))

    def work():
        while True:
            hiprt.build(mesh, "high", threads=1)

    check_interrupts(work)


def test_progress_of_queries(rng, dense):
    origins, directions = rays_at(rng, RAYS)
    for query in (dense.cast, dense.occluded, dense.count):
        calls, start = [], time.perf_counter()
        query(origins, directions, precision="reference", threads=1,
              progress=lambda done, total: calls.append((done, total)))
        assert calls[-1] == (RAYS, RAYS) and all(total == RAYS for _, total in calls)
        assert calls == sorted(calls)
        assert len(calls) > (time.perf_counter() - start) / 0.2  # Every 50 ms, unless the machine is busy.
    calls = []
    dense.cast(origins[0], directions[0], progress=lambda *call: calls.append(call))
    assert calls == [(1, 1)]


def test_progress_of_points(rng, dense):
    points = rng.uniform(0, 1, (5000, 3)).astype(np.float32)
    boxes = np.stack((points, points + 0.01), axis=-2)
    for query in (lambda note: dense.closest_point(points, progress=note),
                  lambda note: dense.nearest(points, 3, progress=note),
                  lambda note: dense.within(points, 0.01, progress=note),
                  lambda note: dense.occupancy(points, progress=note),
                  lambda note: dense.signed_distance(points, progress=note),
                  lambda note: dense.overlap(boxes, progress=note),
                  lambda note: dense.count_overlaps(boxes, progress=note)):
        calls = []
        query(lambda done, total: calls.append((done, total)))
        assert calls[-1] == (5000, 5000) and all(total == 5000 for _, total in calls) and calls == sorted(calls)
        with pytest.raises(hiprt.Cancelled):
            query(lambda done, total: False)


def test_progress_of_builds_and_refits(rng):
    vertices, indices = soup(rng, 25_000, 0.02)
    calls = []

    def note(done, total):
        calls.append((done, total, threading.current_thread()))

    start = time.perf_counter()
    scene = hiprt.build(hiprt.Mesh(vertices, indices), "high", threads=1, progress=note)
    assert calls[-1][:2] == (25_000, 25_000) and len(calls) > (time.perf_counter() - start) / 0.2
    assert [c[0] for c in calls] == sorted(c[0] for c in calls)
    assert {c[2] for c in calls} == {threading.current_thread()}
    calls.clear()
    scene.refit(hiprt.Mesh(vertices, indices), progress=note)
    assert calls[-1][:2] == (25_000, 25_000)


def test_a_callback_can_cancel_or_raise(rng, dense):
    origins, directions = rays_at(rng, RAYS)
    mesh = hiprt.Mesh(*soup(rng, 100_000, 0.02))

    def fault(done, total):
        raise ZeroDivisionError("mine")

    for work in (lambda progress: dense.count(origins, directions, progress=progress),
                 lambda progress: dense.list(origins, directions, progress=progress),
                 lambda progress: hiprt.build(mesh, "high", progress=progress)):
        with pytest.raises(hiprt.Cancelled, match="progress callback returned False"):
            work(lambda done, total: False)
        with pytest.raises(ZeroDivisionError, match="mine"):
            work(fault)


def test_a_callback_may_use_the_library(rng, dense):
    origins, directions = rays_at(rng, RAYS)
    inner = []
    dense.count(origins, directions,
                progress=lambda *_: inner.append(dense.cast(origins[:3000], directions[:3000]).found.any()))
    assert inner and all(inner)


def test_other_threads_run_meanwhile(rng, dense):
    origins, directions = rays_at(rng, RAYS)
    ticks, stop = [], threading.Event()

    def tick():
        while not stop.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    start, longest = time.perf_counter(), 0
    while time.perf_counter() < start + 1:
        begin = time.perf_counter()
        dense.count(origins, directions, threads=1)
        longest = max(longest, len([t for t in ticks if begin < t]))
    stop.set()
    thread.join()
    assert longest > 5  # During one call.


def test_queries_from_many_threads(rng, dense):
    origins, directions = rays_at(rng, 20_000)
    expected = dense.cast(origins, directions)
    results = [None] * 6

    def trace(i):
        results[i] = dense.cast(origins, directions, threads=1 + i % 3).t

    threads = [threading.Thread(target=trace, args=(i,)) for i in range(len(results))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(t, expected.t) for t in results)
