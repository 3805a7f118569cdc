# SPDX-License-Identifier: Apache-2.0
"""Errors in one line, in Python's words."""

import inspect
import re

import numpy as np
import pytest

import ewa
from conftest import ROOT, camera, make_splats
from ewa import _native
from ewa._errors import spelled, wrong_arguments

VIEW, K, WIDTH, HEIGHT = camera()
SPLATS = make_splats(4)


def calls(data):
    """Wrong calls and their texts."""
    view = (SPLATS, VIEW, K)
    choices = 'expected "auto", "ignore", "cut", "none" or None'
    operators = _native.operators
    return [
        (
            lambda: ewa.render(*view, 8, 8, backgruond=0),
            "render has no argument backgruond; did you mean background?",
        ),
        (lambda: ewa.render(*view, 8, 8, zzz=0), "render has no argument zzz"),
        (lambda: ewa.render(*view, 64.0, 8), "render: width is a float; expected an int"),
        (lambda: ewa.render(*view, width="8", height=8), "render: width is a str; expected an int"),
        (lambda: ewa.render(*view, 8), "render lacks height"),
        (lambda: ewa.render(SPLATS, VIEW), "render lacks Ks, width and height"),
        (
            lambda: ewa.render(*view, 8, 8, "white"),
            "render takes 5 arguments by position, not 6; the others have names, such as background=",
        ),
        (
            lambda: ewa.render(*view, 8, 8, width=8),
            "render has width twice: by position and by name",
        ),
        (
            lambda: ewa.render(3, VIEW, K, 8, 8),
            "render: splats is an int; expected Splats or a path",
        ),
        (lambda: ewa.render(*view, 8, 8, points=3), "render: points is an int; expected a bool"),
        (
            lambda: ewa.render(*view, 8, 8, samples="3"),
            "render: samples is a str; expected an int or None",
        ),
        (lambda: ewa.Renderer(None), "Renderer: splats is None; expected Splats or a path"),
        (lambda: ewa.Renderer(SPLATS).render(VIEW, K), "Renderer.render lacks width and height"),
        (lambda: ewa.load(3), "load: path is an int; expected a path"),
        (lambda: ewa.load(), "load lacks path"),
        (lambda: ewa.save("x.ply"), "save lacks splats"),
        (
            lambda: ewa.save("x.ply", SPLATS, comments=3),
            "save: comments is an int; expected a sequence",
        ),
        (lambda: ewa.Trainer(3), "Trainer: dataset is an int; expected a Dataset or a path"),
        (lambda: ewa.Trainer(SPLATS), "Trainer: dataset is a Splats; expected a Dataset or a path"),
        (lambda: ewa.Trainer(data, step=3), "Trainer has no option step; did you mean steps?"),
        (lambda: ewa.Trainer(), "Trainer lacks dataset"),
        (lambda: ewa.Trainer.resume(3, data), "resume: path is an int; expected a path"),
        (
            lambda: ewa.evaluate(SPLATS, 3),
            "evaluate: dataset is an int; expected a Dataset or a path",
        ),
        (
            lambda: ewa.evaluate(data, data),
            "evaluate: splats is a Dataset; expected Splats or a path",
        ),
        (
            lambda: ewa.Dataset("x", downscal=2),
            "Dataset has no argument downscal; did you mean downscale?",
        ),
        (lambda: ewa.Dataset("x", downscale=2.5), "Dataset: downscale is a float; expected an int or None"),
        (lambda: ewa.Dataset("x", masks=1), f"Dataset: masks is an int; {choices}"),
        (lambda: ewa.Dataset(), "Dataset lacks path"),
        (lambda: data.split("x"), "Dataset.split: test_every is a str; expected an int or None"),
        (lambda: data.images["a"], "Images.__getitem__: index is a str; expected an int"),
        (lambda: ewa.set_device(1.5), "set_device: device is a float; expected an int or a str"),
        (lambda: ewa.devices(1), "devices takes 0 arguments by position, not 1"),
        (lambda: setattr(SPLATS, "density", "x"), "an attribute of Splats takes a bool, not a str"),
        (lambda: ewa.Splats(means=0), "Splats lacks quats, log_scales, opacity_logits and sh"),
        (
            lambda: operators.Projection(1),
            "Projection lacks quats, scales, covars, opacities, viewmats, Ks, width, "
            "height, eps2d, near, far, radius_clip, compensations, camera_model and distortions",
        ),
    ]


def test_a_call_that_fits_no_signature_gets_one_line(still_life):
    for call, text in calls(still_life):
        with pytest.raises(TypeError) as found:
            call()
        assert str(found.value) == text


def test_every_function_says_in_one_line_what_it_lacks_or_does_not_know():
    owners = (_native, _native.operators, *vars(_native).values())
    functions = {}
    for owner in owners:
        for name, value in vars(owner).items() if hasattr(owner, "__dict__") else ():
            if type(value).__name__ in ("nb_func", "nb_method") and not name.startswith("__"):
                functions[f"{owner.__name__}.{name}"] = value
    assert len(functions) > 20
    for name, function in functions.items():
        if name.endswith("._native.join"):
            continue  # takes any number of splats
        with pytest.raises(TypeError) as found:
            function(no_such_argument=1)
        text = str(found.value)
        assert "\n" not in text and "Invoked" not in text and len(text) < 300, name


def test_an_object_without_its_init_is_named():
    class Own(ewa.Splats):
        def __init__(self):
            pass

    for empty in (ewa.Splats.__new__(ewa.Splats), Own()):
        for use in (
            lambda: empty.means,
            lambda: len(empty),
            lambda: ewa.render(empty, VIEW, K, 8, 8),
        ):
            with pytest.raises(TypeError, match="made without its __init__"):
                use()


def test_a_number_that_is_too_large_is_named():
    with pytest.raises(TypeError, match="^render cannot take these arguments .* too large"):
        ewa.render(SPLATS, VIEW, K, 2**40, 8)


def test_other_texts_stay():
    assert wrong_arguments("f(): incompatible function arguments. ???") == (
        "f(): incompatible function arguments. ???"
    )


@pytest.mark.parametrize(
    "text, expected",
    [
        ("--bands and --appearance exclude each other", "bands= and appearance= exclude each other"),
        ("more than --max-splats 300.", "more than max_splats=300."),
        ("--steps 300; give a larger --steps", "steps=300; give a larger steps="),
        ("take --integrator splat, fewer --samples", 'take integrator="splat", fewer samples='),
        ("--strategy mcmc moves splats", 'strategy="mcmc" moves splats'),
        ("--device-memory 2.5 GiB", "device_memory_bytes=2.5 GiB"),
        ("--points needs adc", "points= needs adc"),
        ("; --dense-start off prevents that", '; dense_start="off" prevents that'),
        ("--resolution-schedule 2, --absgrad", "halvings=2, absolute_gradients="),
        ("x: damaged; --force starts anew", "x: damaged; a new Trainer starts anew"),
        ("--crop: 'a' is no box", "crop: 'a' is no box"),
        ("--image-cache: 'a' is none", "image_cache_bytes: 'a' is none"),
        (
            "--device-memory 0.0001 is too little: this needs 0.057 or more (61234567 bytes, not 2); x",
            "device_memory_bytes=2 is too little: this needs 61234567 or more; x",
        ),
        ("a - b -- c", "a - b -- c"),
    ],
)
def test_options_are_spelled_as_arguments(text, expected):
    assert spelled(text) == expected


# Options in errors that only runs of the command line meet.
COMMAND_LINE = {
    "adjust",
    "codec",
    "delete",
    "depth",
    "duplicate",
    "edits",
    "force",
    "frames",
    "hide",
    "inria",
    "keep",
    "lock",
    "metrics",
    "output",
    "remove",
    "remove-contradicted",
    "reset",
    "resume",
    "rolling-shutter",
    "save-every",
    "scale-to",
    "select",
    "serve",
    "test-every",
    "transform",
    "unhide",
    "unlock",
}


def test_every_option_in_an_error_of_libewa_is_an_argument():
    """Rows of src/run/option_table.cpp name the arguments that Python spells otherwise."""
    known = set(inspect.signature(spelled).parameters)
    for function in (
        ewa.render,
        ewa.save,
        ewa.mesh,
        ewa.evaluate,
        ewa.Dataset.__init__,
        ewa.Trainer.__init__,
    ):
        known |= set(re.findall(r"(\w+):", function.__nb_signature__[0][0]))
    known |= set(vars(ewa.Splats))
    found = {}
    modules = "core image scene edit folders prepare gpu io pipeline operators report live mesh train run ranks portions".split()
    for path in (p for m in modules for p in (ROOT / "src" / m).rglob("*.cpp")):
        code = re.sub(r"//.*", "", path.read_text())
        for literal in re.findall(r'"(?:[^"\\\n]|\\.)*"', code):
            for option in re.findall(r"(?<![\w-])--([a-z][a-z-]*[a-z])", literal):
                found.setdefault(option, f"{path.name}: {literal}")
            assert (
                "-o DIR" not in literal
                or "--" not in spelled(literal)
                or path.name == "earlier_run.cpp"
            )
    assert {"bands", "max-splats", "image-cache"} <= set(found)
    strangers = {
        option: place
        for option, place in found.items()
        if option not in COMMAND_LINE
        and option not in ("ratio", "width", "un")  # of style sheets; the beginning of others
        and spelled(f"--{option}").removesuffix("=") not in known
    }
    assert not strangers
    assert COMMAND_LINE <= set(found)


def test_errors_of_training_name_arguments(still_life, tmp_path):
    for options, text in (
        (dict(bands=2, appearance="affine"), "bands= and appearance= exclude each other"),
        (dict(batch=2, refine_poses=True), "batch= and refine_poses= exclude each other"),
        (dict(steps=5, max_splats=1, init=SPLATS), "max_splats=1"),
        (dict(train_frames=[]), "name some as train_frames="),
    ):
        with pytest.raises(ewa.InputError, match=text) as found:
            ewa.Trainer(still_life, **options)
        assert "--" not in str(found.value)
    trainer = ewa.Trainer(still_life, steps=2, max_splats=200, init="random")
    trainer.step()
    trainer.step()
    trainer.save_checkpoint(tmp_path / "new" / "folder" / "run.ewa")
    with pytest.raises(
        ewa.InputError, match="is at step 2, .*steps=1; .* a new Trainer starts anew"
    ):
        ewa.Trainer.resume(tmp_path / "new/folder/run.ewa", still_life, steps=1)
    half = ewa.Dataset(still_life.root, downscale=2)
    with pytest.raises(ewa.InputError, match="had downscale=1, and .* have downscale=2"):
        ewa.Trainer.resume(tmp_path / "new/folder/run.ewa", half)


def test_missing_folders_are_made(tmp_path):
    ewa.save(tmp_path / "a/b/x.ply", SPLATS)
    assert len(ewa.load(tmp_path / "a/b/x.ply")) == 4
    ewa.save_image(tmp_path / "c/x.png", np.zeros((2, 2, 3)))
    assert ewa.load_image(tmp_path / "c/x.png").shape == (2, 2, 3)
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="file"):
        ewa.save(tmp_path / "file/x.ply", SPLATS)


@pytest.mark.parametrize("extension", ["ply", "compressed.ply"])
def test_comments_that_no_reader_takes_are_refused(tmp_path, extension):
    path = tmp_path / f"x.{extension}"
    for comments in (["a" * 100_000], ["a" * 60_000] * 100):
        with pytest.raises(ewa.InputError, match="fit in the file"):
            ewa.save(path, SPLATS, comments=comments)
    assert not path.exists()
    ewa.save(path, SPLATS, comments=["a" * 64_000])
    assert ewa.load(path).comments == ["a" * 64_000]


def test_numbers_that_are_not_whole_are_refused(still_life):
    for wrong in ([1.5], [np.nan], [1e30]):
        with (
            np.errstate(invalid="ignore"),
            pytest.raises(ValueError, match="train_frames holds numbers"),
        ):
            ewa.Trainer(still_life, train_frames=wrong)
    with pytest.raises(
        ValueError, match="frames holds numbers that are not whole, or not within int64"
    ):
        ewa.evaluate(SPLATS, still_life, [0.5])
    with pytest.raises(
        ValueError, match="colors holds numbers that are not whole, or not within uint8"
    ):
        ewa.Splats.from_points(np.zeros((1, 3)), [[0.2, 0.5, 0.5]])
    with pytest.raises(ValueError, match="colors holds .* uint8"):
        ewa.Splats.from_points(np.zeros((1, 3)), [[0, 256, 0]])
    assert len(ewa.Splats.from_points(np.zeros((1, 3)), [[0.0, 255.0, 1.0]])) == 1
    with pytest.raises(ValueError, match="offsets holds numbers that are not whole"):
        _native.operators.Blending(footprints(), [(0, 1)], 8, 8, 8, lists=[([0, 0.9], [0])])


def footprints(**changes):
    """Footprints of one splat."""
    arrays = dict(
        means2d=[[4, 4]], conics=[[1, 0, 1]], opacities=[0.5], features=[[1]], depths=[1]
    )
    return _native.operators.Footprints(**{**arrays, **changes})


@pytest.mark.parametrize(
    "change, text",
    [
        (dict(conics=[[1, 0]]), r"conics has the shape \(1, 2\); expected \(1, 3\)"),
        (dict(radii=[[3, 3], [3, 3]]), r"radii has the shape \(2, 2\); expected \(1, 2\)"),
        (dict(depths=[[1]]), r"depths has the shape \(1, 1\); expected \(1,\)"),
        (dict(means2d=4), r"means2d has the shape \(\); expected \(..., 2\)"),
    ],
)
def test_footprints_have_one_shape(change, text):
    with pytest.raises(ValueError, match=text):
        footprints(**change)


def test_wrong_images_of_footprints_are_named():
    def blending(rows=((0, 1),), lists=(), **changes):
        return _native.operators.Blending(footprints(**changes), rows, 8, 8, 8, lists=lists)

    for wrong, text in (
        (dict(rows=[(0, 2)]), "rows from 0 to 2 of 1 footprints"),
        (dict(rows=[(1, 0)]), "rows from 1 to 0 of 1 footprints"),
        (dict(lists=[([0, 1], [0])] * 2), "2 lists of 1 images"),
        (dict(depths=None), "footprints without depths"),
        (dict(features=None), "footprints without features"),
    ):
        with pytest.raises(ewa.InputError, match=text):
            blending(**wrong)
    images = blending()
    images.blend(keep=False)
    with pytest.raises(ewa.InputError, match="images whose gradients were not kept"):
        images.gradients(None, None, absolute=False)


def test_a_render_that_shows_nothing_is_warned_of():
    with pytest.warns(
        RuntimeWarning, match=r"camera of viewmats\[1\] sees no splat; .*numpy.linalg.inv"
    ):
        ewa.render(SPLATS, [VIEW, np.linalg.inv(VIEW)], K, WIDTH, HEIGHT)
    damaged = make_splats(4)
    damaged.means[1] = np.nan
    with pytest.warns(RuntimeWarning, match="1 of 4 splats skipped: a value is not finite"):
        ewa.render(damaged, VIEW, K, WIDTH, HEIGHT)
    damaged.means[:] = np.nan
    with pytest.warns(RuntimeWarning, match="4 of 4 splats skipped") as found:
        ewa.render(damaged, VIEW, K, WIDTH, HEIGHT)
    assert len(found) == 1


def test_a_nearly_exact_last_row_is_taken():
    noisy = VIEW.astype(np.float32)
    noisy[3] = [5e-6, -5e-6, 5e-6, 1 - 5e-6]
    expected = ewa.render(SPLATS, VIEW, K, WIDTH, HEIGHT).color
    assert np.array_equal(ewa.render(SPLATS, noisy, K, WIDTH, HEIGHT).color, expected)
    turned = np.linalg.inv(np.linalg.inv(VIEW.astype(np.float32)))
    ewa.render(SPLATS, turned, K, WIDTH, HEIGHT)
    noisy[3, 0] = 1e-3
    with pytest.raises(ValueError, match="its last row is not 0 0 0 1"):
        ewa.render(SPLATS, noisy, K, WIDTH, HEIGHT)
