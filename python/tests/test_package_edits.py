# SPDX-License-Identifier: Apache-2.0
"""Methods that clean, thin and move scenes: each is an option of ewa convert."""

import numpy as np
import pytest

import ewa
from conftest import STILL_LIFE, make_splats

MATRIX = [[0, -2, 0, 1], [2, 0, 0, 0], [0, 0, 2, 3]]
EDITS = {
    "crop": (lambda s: s.crop((-0.5, -0.5, -1, 0.5, 0.5, 1)), ["--crop=-0.5,-0.5,-1,0.5,0.5,1"]),
    "sphere": (lambda s: s.where("sphere=0,0,0,0.8"), ["--where=sphere=0,0,0,0.8"]),
    "where": (
        lambda s: s.where("opacity=0.3..", "scale=..0.2"),
        ["--where=opacity=0.3..", "--where=scale=..0.2"],
    ),
    "scale_to": (lambda s: s.scale_to([0, 0, 0, 1, 0, 0, 3]), ["--scale-to=0,0,0,1,0,0,3"]),
    "sort": (lambda s: s.remove_invalid().sort(), ["--remove-invalid", "--sort=morton"]),
    "max_sh": (lambda s: s.max_sh(1), ["--max-sh=1"]),
    "remove_invalid": (lambda s: s.remove_invalid(), ["--remove-invalid"]),
    "remove_floaters": (lambda s: s.remove_floaters(), ["--remove-floaters"]),
    "largest_cluster": (lambda s: s.largest_cluster(), ["--largest-cluster"]),
    "decimate": (lambda s: s.decimate(20), ["--decimate=20"]),
    "decimate_part": (lambda s: s.decimate("25%"), ["--decimate=25%"]),
    "transform": (
        lambda s: s.transform("turn=0,0,1,90", "move=1,2,3"),
        ["--transform=turn=0,0,1,90", "--transform=move=1,2,3"],
    ),
    "matrix": (
        lambda s: s.transform(np.array(MATRIX)),
        ["--transform=0,-2,0,1,2,0,0,0,0,0,2,3"],
    ),
}


def scene():
    """A heap of splats, some far away, and one that cannot be drawn."""
    splats = make_splats(200)
    splats.means[:5] += [30, 0, 0]
    splats.quats[7] = 0
    return splats


@pytest.mark.parametrize("name", EDITS)
def test_edits_are_those_of_the_command_line(name, program, tmp_path):
    edit, words = EDITS[name]
    splats = scene()
    before = {key: getattr(splats, key).copy() for key in ("means", "quats", "sh")}
    view = splats.means
    ewa.save(tmp_path / "scene.ply", splats)
    program("convert", tmp_path / "scene.ply", tmp_path / "theirs.ply", *words)
    edited, expected = edit(splats), ewa.load(tmp_path / "theirs.ply")
    assert len(expected) > 0
    for key in ("means", "quats", "log_scales", "opacity_logits", "sh"):
        assert np.array_equal(getattr(edited, key), getattr(expected, key)), key
    # The splats themselves stay.
    assert view.base is not None and np.array_equal(view, before["means"])
    for key, values in before.items():
        assert np.array_equal(getattr(splats, key), values)
    assert len(edited) < len(splats) or name in ("max_sh", "transform", "matrix", "scale_to")


def test_splats_in_few_images_are_removed(program, tmp_path, still_life):
    run = tmp_path / "run"
    program("train", STILL_LIFE, "-o", run, "--steps", 1, "--downscale", 4, "--strategy", "none")
    program("convert", run, tmp_path / "theirs.ply", "--where", "views=20..")
    splats = ewa.load(run)
    expected = ewa.load(tmp_path / "theirs.ply")
    for dataset in (still_life, STILL_LIFE, run):
        assert np.array_equal(splats.where("views=20..", dataset=dataset).means, expected.means)
    assert 0 < len(expected) < len(splats)


def test_edits_keep_what_splats_are():
    splats = scene()
    splats.antialiased = True
    assert splats.crop((-9, -9, -9, 9, 9, 9)).decimate(30).antialiased
    assert len(splats.crop((5, 5, 5, 6, 6, 6))) == 0


@pytest.mark.parametrize(
    "edit, text",
    [
        (lambda s: s.crop((1, 2, 3)), "^crop: '1.0,2.0,3.0' is not"),
        (lambda s: s.where("sphere=0,0,0,-1"), "^where: .* is not x,y,z,radius"),
        (lambda s: s.where("opacty=0..1"), "^where: .*did you mean opacity"),
        (lambda s: s.where("views=3.."), "^where: views are known"),
        (lambda s: s.decimate("half"), "^decimate: 'half' is neither a number of splats"),
        (lambda s: s.decimate(0), "^decimate: '0' is neither"),
        (lambda s: s.transform("spin=3"), "^transform: 'spin=3' is not move=x,y,z"),
        (lambda s: s.transform("scale=0"), "flattens|could not be drawn"),
        (lambda s: s.max_sh(4), "^max_sh: '4' is not 0, 1, 2 or 3"),
    ],
)
def test_wrong_edits(edit, text):
    with pytest.raises(ewa.InputError, match=text) as found:
        edit(make_splats())
    assert "--" not in str(found.value) and "\n" not in str(found.value)


def test_wrong_types():
    splats = make_splats()
    for edit in (
        lambda: splats.decimate(2.5),
        lambda: splats.where(3),
        lambda: splats.crop(3),
        lambda: splats.crop("abcdef".split()),
        lambda: splats.where("views=1..", dataset=splats),
    ):
        with pytest.raises((TypeError, ValueError)) as found:
            edit()
        assert "\n" not in str(found.value)
    with pytest.raises(ValueError, match="a step has the shape"):
        splats.transform(np.eye(3))
