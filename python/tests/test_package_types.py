# SPDX-License-Identifier: Apache-2.0
"""The types that the stubs state."""

import importlib.util
import inspect
import pathlib
import subprocess
import sys

import pytest
from conftest import ROOT

import ewa

USER = """
import numpy as np
import numpy.typing as npt
import ewa

splats: ewa.Splats = ewa.load("scene.ply")
means: npt.NDArray[np.float32] = splats.means
splats.means = splats.means * 2
some = splats[splats.opacity_logits > 0]
lines: list[str] = ewa.save("scene.spz", ewa.join(some, some), comments=["a"])
data = ewa.Dataset("photos", downscale=2)
renders = ewa.render(splats, data.viewmats, data.Ks, 640, 480, mode="depth", background="white")
depth: npt.NDArray[np.float32] | None = renders.depth
trainer = ewa.Trainer(data, steps=100, strategy="mcmc", init=splats, train_frames=[1, 2], growth=1.1)
for report in trainer:
    loss: float = report.loss
result: ewa.Evaluation = ewa.evaluate(trainer.splats(), data)
names: list[str] = [frame.name for frame in result.frames]
some_images: ewa.Images = data.images[0:3]
first: npt.NDArray[np.float32] = some_images[0]
for image in data.images:
    print(image.shape)
ewa.set_device(0)
try:
    ewa.Trainer.resume("a.ewa", data)
except ewa.InputError as error:
    print(error)
"""
WRONG = """
import ewa

ewa.load(3)
ewa.Trainer(ewa.Dataset("photos"), strategy="fast")
ewa.render(ewa.load("a.ply"), 1, 2, "wide", 3)
length: str = len(ewa.load("a.ply"))
"""


def code_of(document):
    """The Python of a document, in its order, with what its comments say goes before."""
    spec = importlib.util.spec_from_file_location("commands", ROOT / "tests/docs/commands.py")
    commands = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(commands)
    parts = []
    for _, language, body, comments in commands.blocks_of(document.read_text()):
        if language == "python":
            parts += [text for kind, _, text in comments if kind == "first"] + body
    return "\n".join(parts) + "\n"


def mypy(*arguments):
    words = [
        sys.executable,
        "-m",
        "mypy",
        "--strict",
        "--no-incremental",
        "--cache-dir=/dev/null",
        *map(str, arguments),
    ]
    result = subprocess.run(words, capture_output=True, text=True, timeout=300)
    return result.stdout


@pytest.fixture(scope="module")
def checked(tmp_path_factory):
    """What mypy says of a user's script, a wrong one and the example, which one run checks."""
    folder = tmp_path_factory.mktemp("types")
    (folder / "user.py").write_text(USER)
    (folder / "wrong.py").write_text(WRONG)
    documents = []
    for document in sorted((ROOT / "docs").glob("python*.md")):
        documents.append(folder / f"{document.stem}_document.py")
        documents[-1].write_text(code_of(document))
    assert len(documents) == 2
    example = ROOT / "examples/python/render_ply.py"
    return mypy(folder / "user.py", folder / "wrong.py", example, *documents)


def test_a_users_script_has_its_types(checked):
    if "No module named mypy" in checked:
        pytest.skip("mypy is not there")
    wrong = [line for line in checked.splitlines() if "wrong.py" not in line]
    assert len(wrong) == 1 and wrong[0].startswith("Found 4 errors"), checked


def test_wrong_types_are_found(checked):
    lines = [line for line in checked.splitlines() if "wrong.py" in line]
    assert len([line for line in lines if "error:" in line]) == 4, checked


def test_the_stub_names_what_the_module_has():
    stub = (
        pathlib.Path(ewa._native.__file__).with_name("_native").joinpath("__init__.pyi").read_text()
    )
    for name in ewa.__all__:
        if not name.startswith("_") and not name.endswith("Error"):
            assert f"def {name}(" in stub or f"class {name}:" in stub, name


def test_everything_public_has_a_signature():
    known = {}
    for name in ewa.__all__:
        value = getattr(ewa, name)
        if callable(value) and not isinstance(value, type):
            known[name] = inspect.signature(value)
        elif isinstance(value, type):
            known[name] = inspect.signature(value)
            for member, method in vars(value).items():
                if not member.startswith("_") and callable(method):
                    known[f"{name}.{member}"] = inspect.signature(method)
    assert len(known) > 40
    assert list(known["load"].parameters) == ["path"]
    render = known["render"].parameters
    assert list(render)[:5] == ["splats", "viewmats", "Ks", "width", "height"]
    assert render["mode"].kind is inspect.Parameter.KEYWORD_ONLY
    assert render["background"].default == (0, 0, 0) and render["width"].annotation == "int"
    trainer = known["Trainer"].parameters
    assert list(trainer)[0] == "dataset" and trainer["steps"].default == 30000
    assert "'stereo'" in trainer["init"].annotation and known["Trainer"].bind("photos", steps=3)
    assert list(known["Trainer.step"].parameters) == ["self"]
    assert list(known["Trainer.resume"].parameters)[0] == "path"
    splats = ewa.Splats.from_points([[0, 0, 0]], [[0, 0, 0]], 0)
    assert list(inspect.signature(ewa.Renderer(splats).replace).parameters) == ["splats"]

    class Own(ewa.Splats):
        def __init__(self, path): ...

    assert list(inspect.signature(Own).parameters) == ["path"]
    assert list(inspect.signature(type("Same", (ewa.Renderer,), {})).parameters)[0] == "splats"


def test_everything_public_has_a_docstring():
    for name in ewa.__all__:
        if name != "__version__":
            assert inspect.getdoc(getattr(ewa, name)), name
    assert (pathlib.Path(ewa._native.__file__).parent / "py.typed").exists()
