"""What a wheel holds, documentation of all names, and the example programs."""

import ast
import importlib
import inspect
import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import hiprt
from gpu_libraries import make_library
from test_render import read_png

FOLDER = Path(hiprt.__file__).parent
EXAMPLES = Path(__file__).resolve().parents[2] / "hiprt_build" / "python" / "examples"
PRINTED = {
    "lidar": r"beams with 1, 2, 3, 4 returns: \d+, \d+, \d+, \d+\n\d+% of the beams reach the ground",
    "point_in_mesh": r"volume: 3\.1[4-7]\d by random points, 3\.158 of a smooth torus",
    "distance_field": r"76800 points: -0\.20 to 1\.11, 0\.000\d from a smooth torus at most",
    "city_shadows": r"400 houses; \d\.\d hours of sun on average",
    "visibility": r"400 points: \d+% of the pairs see each other, 0 in one direction only",
    "visibility_gpu": r"\d+ points on cuda:0: \d+% of the pairs see each other, \d+ in one direction only",
}


def test_the_package_is_typed():
    assert (FOLDER / "py.typed").is_file()
    stub = ast.parse((FOLDER / "_core.pyi").read_text())
    declared = {node.name for node in stub.body if isinstance(node, (ast.FunctionDef, ast.ClassDef))}
    assert declared == {name for name in dir(hiprt._core) if not name.startswith("_")}


def test_types_are_right():
    mypy = pytest.importorskip("mypy.api")
    text, errors, status = mypy.run(["--cache-dir", os.devnull, "-p", "hiprt"])
    assert status == 0, text + errors


@pytest.mark.parametrize("name", ("hiprt", "hiprt.trimesh", "hiprt.open3d_like", "hiprt.render"))
def test_every_public_name_is_documented(name):
    module = importlib.import_module(name)
    assert module.__doc__
    public = getattr(module, "__all__", None) or [n for n, value in vars(module).items() if not n.startswith("_") and
                                                   getattr(value, "__module__", None) == name]
    assert public
    for part in public:
        value = getattr(module, part)
        if not callable(value):
            continue
        assert inspect.getdoc(value), part
        for member, method in vars(value).items() if inspect.isclass(value) else ():
            if not member.startswith("_") and (inspect.isfunction(method) or isinstance(method, property)) and \
                    part != "Array":
                assert inspect.getdoc(method), f"{part}.{member}"


def test_one_import_gives_everything_and_imports_little():
    program = ("import sys, hiprt; hiprt.render.normals, hiprt.trimesh.RayMeshIntersector\n"
               "hiprt.open3d_like.RaycastingScene; print(sorted({'trimesh', 'open3d', 'torch'} & set(sys.modules)))")
    assert subprocess.check_output([sys.executable, "-c", program], text=True) == "[]\n"


def test_version_is_that_of_the_library():
    root = Path(__file__).resolve().parents[2]
    text = (root / "hiprt_device" / "version.h").read_text()
    numbers = [re.search(rf"HIPRT_LIBRARY_{part} (\d+)", text)[1] for part in ("MAJOR", "MINOR", "PATCH")]
    assert hiprt.__version__ == ".".join(numbers)


def test_all_examples_are_run():
    assert {path.stem for path in EXAMPLES.glob("*.py")} == {"first_program", "first_gpu_program", *PRINTED}


def test_first_program(capsys):
    runpy.run_path(os.fspath(EXAMPLES / "first_program.py"))
    assert capsys.readouterr().out == "6 of 9 rays hit; t = 2.000, primitive 0\n"


def test_first_gpu_program(capsys):
    make_library("torch")  # Skips without PyTorch or a GPU.
    runpy.run_path(os.fspath(EXAMPLES / "first_gpu_program.py"))
    assert re.fullmatch(r"\d+% of the pairs on cuda:0 do not see each other; \d+ of 1000 points are above the "
                        r"triangle, 1\.[45] on average\n", capsys.readouterr().out)


@pytest.mark.parametrize("name", PRINTED)
def test_example(name, tmp_path, capsys):
    if name.endswith("_gpu"):
        make_library("torch")  # Skips without PyTorch or a GPU.
    program = runpy.run_path(os.fspath(EXAMPLES / f"{name}.py"))
    program["main"](os.fspath(tmp_path / "picture.png"))
    assert re.search(PRINTED[name], capsys.readouterr().out)
    picture = read_png((tmp_path / "picture.png").read_bytes())
    assert picture.shape[0] >= 200 and len(np.unique(picture)) > 1
