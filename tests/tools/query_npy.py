"""bvhquery with arrays of numpy: the results of raw files, for every type, byte order and index order of the input.

Usage: query_npy.py BVHBUILD BVHQUERY FOLDER. Exit status 77 where numpy is missing.
"""

import subprocess
import sys
from pathlib import Path

try:
    import numpy as np
except ImportError:
    print("numpy is missing")
    sys.exit(77)

POINT = np.dtype([("distance", "<f4"), ("point", "<f4", (3,)), ("u", "<f4"), ("v", "<f4"), ("primitive", "<u4"),
                  ("feature", "<u4")])
PATH = np.dtype([("instance", "<u4"), ("id", "<u4")])
SEED = 20271130


def raw(folder, values):
    """The file that --help describes."""
    path = folder / "in.queries"
    path.write_bytes(np.array(values.shape, "<u4").tobytes() + values.astype("<f4").tobytes())
    return path


def ask(tool, scene, shape, source, output, *more):
    run = subprocess.run([tool, scene, f"--{shape}", source, "-o", output, *map(str, more)], capture_output=True,
                         text=True, check=False)
    assert run.returncode == 0, run.stderr


def raw_records(path, dtype):
    """(records, the query of each record) of a result file."""
    data = path.read_bytes()
    count, each = np.frombuffer(data, "<u4", 2)
    if each != 0:
        return np.frombuffer(data, dtype, offset=8), np.repeat(np.arange(count), each)
    first = np.frombuffer(data, "<u8", int(count) + 1, offset=8).astype(np.int64)
    return np.frombuffer(data, dtype, offset=16 + 8 * int(count)), np.repeat(np.arange(count), np.diff(first))


def check_results(found, raw_path, query, count):
    """Compares an array with the raw file of the same query, byte by byte."""
    is_point = query in ("closest", "signed", "nearest", "within")
    expected, queries = raw_records(raw_path, POINT if is_point else np.dtype("<u4"))
    if query in ("within", "overlaps"):
        assert found.shape == expected.shape and found.dtype.names[0] == "query"
        assert (found["query"] == queries).all()
        names = POINT.names if is_point else ("primitive",)
        for name in names:
            assert found[name].tobytes() == (expected[name] if is_point else expected).tobytes()
        return
    assert found.shape == ((count, 3) if query == "nearest" else (count,))
    assert found.dtype == (POINT if is_point else np.dtype("<u4")) and found.tobytes() == expected.tobytes()


def check_paths(build, tool, folder, points):
    """Paths through two levels of instances."""
    (folder / "scene.json").write_text(
        '{"format": "hiprt scene", "version": 1, "scene": "all", "objects": {"soup": ["soup.obj"]},'
        ' "groups": {"pair": [{"object": "soup", "id": 5}, {"object": "soup", "translate": [3, 0, 0], "id": 6}],'
        ' "all": [{"object": "pair", "id": 7}, {"object": "pair", "translate": [0, 4, 0], "id": 8}]}}',
        encoding="utf-8")
    subprocess.run([build, folder / "scene.json", "-o", folder / "scene.bvh"], check=True, capture_output=True)
    for query in ("closest", "nearest"):
        np.save(folder / "in.npy", 2 * points)
        ask(tool, folder / "scene.bvh", "points", folder / "in.npy", folder / "out.npy", "--query", query, "--paths",
            folder / "paths.npy")
        ask(tool, folder / "scene.bvh", "points", raw(folder, 2 * points), folder / "raw.results", "--query", query,
            "--paths", folder / "raw.paths")
        paths = np.load(folder / "paths.npy", allow_pickle=False)
        count, levels = np.frombuffer((folder / "raw.paths").read_bytes(), "<u4", 2)
        assert paths.shape == (count, levels) == (np.load(folder / "out.npy").size, 2)
        assert paths.dtype == PATH and paths.tobytes() == (folder / "raw.paths").read_bytes()[8:]
        assert set(paths["id"][:, 0]) == {7, 8} and set(paths["id"][:, 1]) == {5, 6}


def main(build, tool, folder):
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(SEED)
    print(f"seed {SEED}")
    vertices, scene = rng.uniform(-1, 1, (300, 3)), folder / "soup.bvh"
    obj = "".join(f"v {x} {y} {z}\n" for x, y, z in vertices)
    obj += "".join(f"f {3 * i + 1} {3 * i + 2} {3 * i + 3}\n" for i in range(100))
    (folder / "soup.obj").write_text(obj, encoding="utf-8")
    subprocess.run([build, folder / "soup.obj", "-o", scene], check=True, capture_output=True)
    points = rng.uniform(-2, 2, (500, 3)).astype(np.float32)
    spheres = np.hstack((points, rng.uniform(0, 1, (500, 1)))).astype(np.float32)
    boxes = np.hstack((points, points + rng.uniform(0, 0.5, (500, 3)))).astype(np.float32)
    for shape, values, queries in (
            ("points", points, ("closest", "signed", "nearest -k 3", "within --max-distance 0.4", "inside")),
            ("spheres", spheres, ("within", "overlaps", "any-overlap")), ("boxes", boxes, ("overlaps", "any-overlap"))):
        for query in queries:
            name, *more = query.split()
            more = ["--query", name, *more]
            paths = [] if name == "inside" else ["--paths", folder / "paths.npy"]
            ask(tool, scene, shape, raw(folder, values), folder / "raw.results", *more)
            for array in (values, np.asfortranarray(values), values.astype("<f8"), values.astype(">f4"),
                          np.asfortranarray(values).astype(">f8"), values[:0]):
                np.save(folder / "in.npy", array)
                ask(tool, scene, shape, folder / "in.npy", folder / "out.npy", *more, *paths)
                found = np.load(folder / "out.npy", allow_pickle=False)
                if len(array) == 0:
                    assert found.shape[0] == 0
                    continue
                check_results(found, folder / "raw.results", name, len(values))
                if paths:
                    table = np.load(folder / "paths.npy", allow_pickle=False)
                    assert table.shape == (found.size, 0) and table.dtype == PATH
    check_paths(build, tool, folder, points)
    # float64 that is no float32: points are rounded to the nearest.
    wide = rng.uniform(-2, 2, (200, 3))
    np.save(folder / "in.npy", wide)
    ask(tool, scene, "points", folder / "in.npy", folder / "out.npy")
    ask(tool, scene, "points", raw(folder, wide.astype(np.float32)), folder / "raw.results")
    check_results(np.load(folder / "out.npy"), folder / "raw.results", "closest", 200)
    np.save(folder / "in.npy", np.zeros((2, 3), "<i8"))
    refused = subprocess.run([tool, scene, "--points", folder / "in.npy", "-o", folder / "out.npy"],
                             capture_output=True, text=True, check=False)
    assert refused.returncode == 1 and "'<i8'" in refused.stderr and "float32" in refused.stderr, refused.stderr


if __name__ == "__main__":
    main(*sys.argv[1:])
