#!/usr/bin/env python3
"""scene_schema.py BVHBUILD SCHEMA EVERY: bvhbuild and the JSON Schema of scenes accept the same documents.

A document with everything that the format has is changed at one position at a time: values of every kind, more and
fewer keys, longer and shorter arrays. bvhbuild must refuse every document that the schema refuses. It must accept every
document that the schema accepts, unless it has a reason that no schema can know (names, files, numbers of a transform).
Every EVERYth document is tried. Exit 77: no python3-jsonschema.
"""

import copy
import json
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

try:
    import jsonschema
except ImportError:
    print("SKIPPED: python3-jsonschema is not installed")
    sys.exit(77)

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
DOCUMENT = {
    "$schema": "scene.schema.json",
    "format": "hiprt scene",
    "version": 1,
    "objects": {"a": ["a.obj"], "b": ["a.obj", "b.obj", {"spheres": [[0, 0, 0, 1], [1, 0, 0, 0.5]]}, "c.xyzr"],
                "c": {"curves": [[[0, 0, 0, 1], [1, 0, 0, 0]]]}},
    "groups": {
        "low": [{"object": "a", "matrix": [1, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1.5, 0]}, {"object": "b", "mask": 3}],
        "top": [
            {"object": "low", "translate": [1, 2, 3], "rotate": [0, 0, 0, 1], "scale": 2, "mask": 4294967295, "id": 7},
            {"object": "a", "rotate": {"axis": [0, 0, 1], "degrees": 45.5}, "scale": [1, 2, -3]},
            {"object": "low", "motion": {"interpolation": "nlerp", "keys": [
                {"time": 0, "translate": [1, 2, 3], "rotate": {"axis": [0, 0, 1], "degrees": 9}, "scale": 2},
                {"time": 0.5, "rotate": [0, 0, 0, 1], "scale": [1, 2, 3], "shear": [0, 0.5, 0]}]}},
            {"object": "low", "motion": {"keys": [{"time": 0, "matrix": [1, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1.5, 0]}]}},
            {"object": "low"},
            {"object": "c"},
        ],
    },
    "scene": "top",
}
# In place of any value.
VALUES = [None, True, -1, 0, 1, 1.0, 1.5, 4294967295, 4294967296, "", "a", "top", [], [1], [1, 2, 3], [1, 0, 0, 0],
          [1, 2, 3, 4, 5], [[1, 2, 3, 4]], ["a.obj"], {"spheres": [[1, 2, 3, 4]]}, {}, {"object": "a"},
          {"axis": [1, 0, 0], "degrees": 1}, {"axis": [1, 0], "degrees": 1}]
# More keys, in any object.
KEYS = {"": 1, "extra": 1, "object": "a", "scale": 2, "translate": [0, 0, 0],
        "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0], "again": ["a.obj"], "empty": [], "spheres": [[0, 0, 0, 1]],
        "curves": [[[0, 0, 0, 1], [0, 0, 1, 1]]], "motion": {"keys": [{"time": 1}]}, "shear": [0, 0, 0], "time": 7}
# What a schema does not know.
MEANING = ["neither an object nor a group", "no instance in the scene is of it", "a cycle:", "a group expected",
           "there is an object of that name", "cannot open", "is a directory", "has no inverse", "has the length",
           "its length is", "single precision", "unknown mesh format",
           "is not after that of the key before", "the rotation has length 0", "the scale has a 0", "changes its sign"]


def paths(value, path=()):
    """The paths of all values in a document."""
    yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield from paths(inner, path + (key,))


def at(document, path):
    for key in path:
        document = document[key]
    return document


def changed(path, value):
    if not path:
        return value
    document = copy.deepcopy(DOCUMENT)
    at(document, path[:-1])[path[-1]] = value
    return document


def changes():
    yield DOCUMENT
    for path in paths(DOCUMENT):
        value = at(DOCUMENT, path)
        for other in VALUES:
            yield changed(path, other)
        if isinstance(value, dict):
            for key in value:
                yield changed(path, {k: v for k, v in value.items() if k != key})
            for key, more in KEYS.items():
                if key not in value:
                    yield changed(path, {**value, key: more})
        if isinstance(value, list):
            yield changed(path, value[:-1])
            yield changed(path, value + value[-1:])


def fault(bvhbuild, validator, folder, number, document):
    """Where bvhbuild and the schema disagree; None if they agree."""
    path = folder / f"{number}.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    result = subprocess.run([bvhbuild, path, "-o", folder / f"{number}.bvh", "--threads", "1"], capture_output=True,
                            text=True, check=False)
    good = validator.is_valid(document)
    if result.returncode not in (0, 1):
        return f"bvhbuild ends with {result.returncode}: {document}"
    if not good and result.returncode == 0:
        return f"bvhbuild accepts what the schema refuses: {document}"
    if good and result.returncode != 0 and not any(meaning in result.stderr for meaning in MEANING):
        return f"bvhbuild refuses what the schema accepts: {result.stderr.strip()}: {document}"
    return None


def main():
    bvhbuild, schema, every = sys.argv[1:]
    schema = json.loads(Path(schema).read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    # README's scene; its meshes do not exist.
    readme = json.loads((Path(__file__).parent / "forest.json").read_text(encoding="utf-8"))
    documents = [readme] + list(changes())[::int(every)]
    for document in (readme, DOCUMENT):
        if not validator.is_valid(document):
            sys.exit(f"scene_schema.py: the schema refuses {document}")
    with tempfile.TemporaryDirectory() as name, ThreadPoolExecutor(2) as pool:
        folder = Path(name)
        for mesh in ("a.obj", "b.obj"):
            (folder / mesh).write_text(TRIANGLE, encoding="utf-8")
        (folder / "c.xyzr").write_text("0 0 0 1\n", encoding="utf-8")
        faults = list(pool.map(lambda item: fault(bvhbuild, validator, folder, *item), enumerate(documents)))
    faults = [text for text in faults if text]
    for text in faults:
        print(text)
    print(f"{len(documents)} documents, {len(faults)} faults")
    sys.exit(1 if faults else 0)


main()
