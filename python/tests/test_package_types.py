# SPDX-License-Identifier: Apache-2.0
"""The types that the stubs state."""

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
    return mypy(folder / "user.py", folder / "wrong.py", ROOT / "examples/python/render_ply.py")


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


def test_everything_public_has_a_docstring():
    for name in ewa.__all__:
        if name != "__version__":
            assert inspect.getdoc(getattr(ewa, name)), name
    assert (pathlib.Path(ewa._native.__file__).parent / "py.typed").exists()
