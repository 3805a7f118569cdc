# SPDX-License-Identifier: Apache-2.0
"""Datasets, training and evaluation."""

import json
import re
import shutil

import numpy as np
import pytest
from conftest import STILL_LIFE, make_splats

import ewa

ARRAYS = ["means", "quats", "log_scales", "opacity_logits", "sh"]
OPTIONS = {"steps": 12, "seed": 3, "max_splats": 3500, "strategy": "mcmc"}


def same(a, b):
    return len(a) == len(b) and all(
        np.array_equal(getattr(a, name), getattr(b, name)) for name in ARRAYS
    )


def trained(trainer):
    for _ in trainer:
        pass
    return trainer.splats()


def test_a_dataset_has_images_cameras_and_points(still_life):
    count = len(still_life)
    assert count == len(still_life.frames) == len(still_life.images) == 48
    assert still_life.viewmats.shape == (48, 4, 4) and still_life.Ks.shape == (48, 3, 3)
    assert still_life.points.shape == (3000, 3) and still_life.point_colors.dtype == np.uint8
    frame, image = still_life.frames[0], still_life.images[0]
    assert image.shape == (frame.height, frame.width, 3) and image.dtype == np.float32
    assert 0 <= image.min() < 0.3 and 0.7 < image.max() <= 1
    assert frame.image_exists and frame.image_path.name == frame.name and frame.mask_path is None
    assert np.array_equal(still_life.images[-1], still_life.images[47])
    with pytest.raises(IndexError, match="48 images"):
        still_life.images[48]
    assert sum(1 for _ in still_life.images) == 48
    # The points are seen: they are in front of most cameras and project into the image.
    inside = []
    for viewmat, k in zip(still_life.viewmats, still_life.Ks):
        p = still_life.points @ viewmat[:3, :3].T + viewmat[:3, 3]
        uv = (p @ k.T)[:, :2] / p[:, 2:]
        inside.append(
            np.mean((p[:, 2] > 0) & np.all((uv >= 0) & (uv < [frame.width, frame.height]), axis=1))
        )
    assert np.mean(inside) > 0.5


def test_a_dataset_of_smaller_images_and_cameras_alone(tmp_path):
    small = ewa.Dataset(STILL_LIFE, downscale=2)
    assert small.images[0].shape == (96, 128, 3)
    assert np.allclose(small.Ks[0][:2] * 2, ewa.Dataset(STILL_LIFE).Ks[0][:2])
    shutil.copy(STILL_LIFE / "transforms.json", tmp_path)
    with pytest.raises(ewa.InputError):
        ewa.Dataset(tmp_path)
    cameras = ewa.Dataset(tmp_path, need_images=False)
    assert len(cameras) == 48 and not cameras.frames[0].image_exists
    with pytest.raises(ewa.InputError):
        cameras.images[0]


def test_the_split_is_that_of_the_command_line(still_life):
    train, test = still_life.split()
    assert test == list(range(0, 48, 8)) and sorted(train + test) == list(range(48))
    assert still_life.split(0)[1] == []
    with pytest.raises(ewa.InputError):
        still_life.split(-1)


def test_datasets_that_cannot_be_read(tmp_path):
    with pytest.raises(ewa.InputError, match=re.escape(str(tmp_path))):
        ewa.Dataset(tmp_path)
    (tmp_path / "transforms.json").write_text('{"frames": [')
    with pytest.raises(ewa.InputError, match="transforms.json"):
        ewa.Dataset(tmp_path)
    with pytest.raises(ewa.InputError, match="downscale"):
        ewa.Dataset(STILL_LIFE, downscale=0)
    with pytest.raises(ewa.InputError, match="masks: .*; did you mean cut"):
        ewa.Dataset(STILL_LIFE, masks="cutt")


@pytest.fixture(scope="module")
def command_line_run(program, tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    arguments = [f"--{name.replace('_', '-')}={value}" for name, value in OPTIONS.items()]
    program("train", STILL_LIFE, "-o", folder, "--save-every", 6, *arguments)
    return folder


def test_training_gives_the_bytes_of_the_command_line(still_life, command_line_run):
    assert same(
        trained(ewa.Trainer(still_life, **OPTIONS)), ewa.load(command_line_run / "splats.ply")
    )


def test_a_checkpoint_of_the_command_line_continues(
    still_life, command_line_run, program, tmp_path
):
    again = ewa.Trainer.resume(command_line_run / "checkpoint.ewa", still_life, steps=15)
    assert (again.steps_done, again.steps, again.options["seed"]) == (12, 15, 3)
    assert len(trained(again)) > 0 and again.steps_done == 15


def test_reports_and_properties(still_life):
    trainer = ewa.Trainer(still_life, **{**OPTIONS, "steps": 3})
    assert (
        trainer.train_frames == still_life.split()[0]
        and trainer.steps == 3
        and trainer.steps_done == 0
    )
    assert trainer.options["strategy"] == "mcmc" and trainer.options["sh_degree"] == 3
    reports = list(trainer)
    assert [report.step for report in reports] == [1, 2, 3] == [1, 2, trainer.steps_done]
    assert all(
        0 < report.loss < 1 and report.splats == 3000 and report.psnr > 5 for report in reports
    )
    assert list(trainer) == []
    with pytest.raises(ewa.InputError, match="all 3 steps are done"):
        trainer.step()
    assert trainer.exposures().shape == (0, 3, 4)


def test_a_checkpoint_continues_with_the_bytes_of_an_uninterrupted_training(still_life, tmp_path):
    options = {
        **OPTIONS,
        "growth": 1.1,
        "background": "white",
        "means_rate": 2e-4,
        "train_frames": range(5),
    }
    path = tmp_path / "checkpoint.ewa"
    whole = ewa.Trainer(still_life, **options)
    for report in whole:
        if report.step == 7:
            whole.save_checkpoint(path)
    again = ewa.Trainer.resume(path, still_life)
    assert (
        again.steps_done == 7
        and again.options == whole.options
        and again.train_frames == [0, 1, 2, 3, 4]
    )
    assert same(trained(again), whole.splats())


def test_a_checkpoint_of_own_splats_wants_them_again(still_life, tmp_path):
    start = ewa.Splats.from_points(
        still_life.points[::3], still_life.point_colors[::3], sh_degree=1
    )
    trainer = ewa.Trainer(still_life, init=start, **{**OPTIONS, "sh_degree": 2})
    assert trainer.splats().sh_degree == 2 and len(trainer.splats()) == 1000
    trainer.step()
    trainer.save_checkpoint(tmp_path / "a.ewa")
    with pytest.raises(
        ewa.InputError, match="a.ewa: its training began with splats; pass them again as init"
    ):
        ewa.Trainer.resume(tmp_path / "a.ewa", still_life)
    again = ewa.Trainer.resume(tmp_path / "a.ewa", still_life, init=start)
    assert same(trained(again), trained(trainer))


def test_checkpoints_that_cannot_be_used(still_life, tmp_path):
    trainer = ewa.Trainer(still_life, **OPTIONS)
    trainer.step()
    path = tmp_path / "a.ewa"
    trainer.save_checkpoint(path)
    with pytest.raises(ewa.InputError, match="a.ewa: its images had downscale=1, and those .*=2"):
        ewa.Trainer.resume(path, ewa.Dataset(STILL_LIFE, downscale=2))
    (tmp_path / "nowhere").write_text("a file")
    with pytest.raises(OSError, match="nowhere"):
        trainer.save_checkpoint(tmp_path / "nowhere/a.ewa")
    data = path.read_bytes()
    path.write_bytes(data[:-9])
    with pytest.raises(ewa.InputError, match="a.ewa"):
        ewa.Trainer.resume(path, still_life)
    path.write_bytes(data.replace(b'"growth":1.05', b'"growth":"x" '))
    with pytest.raises(ewa.InputError, match="a.ewa"):
        ewa.Trainer.resume(path, still_life)


def test_random_first_splats(still_life):
    trainer = ewa.Trainer(still_life, init="random", max_splats=500, steps=1, seed=1)
    assert len(trainer.splats()) == 500
    with pytest.raises(ewa.InputError, match="init is neither"):
        ewa.Trainer(still_life, init="rnd")


def test_the_cap_is_chosen_and_kept(still_life, tmp_path):
    trainer = ewa.Trainer(still_life, steps=12)
    first = len(trainer.splats())
    assert trainer.options["max_splats"] == first + 100 * 12
    assert trainer.options["final_splats"] == 0  # adc ends with all
    mcmc = ewa.Trainer(still_life, steps=200, strategy="mcmc").options
    assert mcmc["final_splats"] == mcmc["max_splats"] * 2 // 3 > first
    trainer.step()
    trainer.save_checkpoint(tmp_path / "a.ewa")
    resumed = ewa.Trainer.resume(tmp_path / "a.ewa", still_life)
    assert resumed.options["max_splats"] == first + 100 * 12
    longer = ewa.Trainer.resume(tmp_path / "a.ewa", still_life, steps=20)
    assert longer.options["max_splats"] == first + 100 * 20
    assert ewa.Trainer(still_life, max_splats=4e3).options["max_splats"] == 4000


@pytest.mark.parametrize(
    "options, error, message",
    [
        ({"stepz": 3}, TypeError, "Trainer has no option stepz; did you mean steps?"),
        ({"skip_blurred": True}, TypeError, "Trainer has no option skip_blurred; ewa train has it"),
        ({"steps": 0}, ewa.InputError, "steps=0: '0' is not a whole number from 1 to "),
        ({"steps": 1.5}, ewa.InputError, "steps=1.5: '1.5' is not a whole number"),
        ({"steps": "many"}, TypeError, "steps='many' is of the wrong type"),
        ({"growth": float("nan")}, ewa.InputError, "growth=nan: 'nan' is not a number from 1 to 1000"),
        ({"strategy": "mcm"}, ewa.InputError, "strategy='mcm': .*; did you mean mcmc"),
        ({"sh_degree": 4}, ewa.InputError, "sh_degree=4: '4' is not a whole number from 0 to 3"),
        ({"moment_bits": 8}, ewa.InputError, "moment_bits=8: '8' is neither 16 nor 32"),
        ({"refine_poses": "yes"}, TypeError, "refine_poses='yes' is of the wrong type"),
        ({"background": [1, 2]}, ValueError, r"background has the shape \(2,\); expected \(3,\)"),
        ({"train_frames": []}, ewa.InputError, "no training image"),
        (
            {"train_frames": [48]},
            IndexError,
            "train_frames has the index 48; the dataset has 48 frames",
        ),
        ({"max_splats": 10, "init": make_splats(11)}, ewa.InputError, "11 splats"),
        ({"max_splats": 0}, ewa.InputError, "max_splats=0: '0' is not a whole number from 1 to"),
        ({"max_splats": "many"}, TypeError, "max_splats='many' is of the wrong type"),
        ({"init": make_splats(2).means}, TypeError, ""),
        ({"image_cache_bytes": -1}, ewa.InputError, "image_cache_bytes=-1: '-1' is not a whole"),
        ({"nearest": 4}, ewa.InputError, "nearest= is an option of points="),
        ({"points": True, "init_opacity": 0.5}, ewa.InputError, "init_opacity= and points= exclude each other"),
        ({"dense_start": "of"}, ewa.InputError, "dense_start='of': .*; did you mean on?"),
        ({"loss": "l3=1"}, ewa.InputError, "loss='l3=1': 'l3' is no term of the loss; .*; did you mean l1?"),
        ({"loss": {"l1": -1}}, ewa.InputError, "loss={'l1': -1}: l1: '-1' is not a number from 0"),
        ({"loss": {"l1": "much"}}, TypeError, "loss={'l1': 'much'} is of the wrong type"),
        ({"loss": 3}, TypeError, "loss=3 is of the wrong type"),
    ],
)
def test_wrong_options(still_life, options, error, message):
    with pytest.raises(error, match=message):
        ewa.Trainer(still_life, **options)


def test_first_splats_and_points(still_life, tmp_path):
    options = dict(steps=2, init_opacity=0.25, init_scale=2, train_frames=[0], dense_start="off")
    start = ewa.Trainer(still_life, **options).splats()
    usual = ewa.Trainer(still_life, steps=2, train_frames=[0], dense_start="off").splats()
    assert np.allclose(start.opacity_logits, np.log(0.25 / 0.75), atol=1e-5)
    assert np.allclose(start.log_scales, np.log(2) + usual.log_scales, atol=1e-5)
    trainer = ewa.Trainer(still_life, steps=2, points=True, nearest=3, train_frames=[0])
    assert (trainer.options["points"], trainer.options["nearest"]) == (True, 3)
    assert trainer.step().loss > 0
    trainer.save_checkpoint(tmp_path / "a.ewa")
    resumed = ewa.Trainer.resume(tmp_path / "a.ewa", still_life)
    assert resumed.options == trainer.options


def test_whole_floats_and_numpy_numbers_are_options(still_life):
    trainer = ewa.Trainer(
        still_life,
        steps=7e3,
        seed=np.int64(5),
        growth=1.5,
        strategy="adc",
        train_frames=np.arange(3),
    )
    assert (trainer.options["steps"], trainer.options["seed"], trainer.options["growth"]) == (
        7000,
        5,
        1.5,
    )


def test_antialiased_training_makes_antialiased_splats(still_life):
    splats = ewa.Trainer(still_life, steps=1, kernel="antialias", train_frames=[0]).splats()
    assert splats.antialiased
    usual, plain = ewa.evaluate(splats, still_life, [0]), ewa.evaluate(splats, still_life, [0], kernel="peak")
    assert usual.psnr == ewa.evaluate(splats, still_life, [0], kernel="antialias").psnr != plain.psnr


def test_densities_are_trained_and_kept(still_life, tmp_path):
    trainer = ewa.Trainer(still_life, steps=1, kernel="density", train_frames=[0])
    assert trainer.options["kernel"] == "density"
    assert ewa.Trainer(still_life, steps=1, kernel="ewa", train_frames=[0]).options == trainer.options
    splats = trainer.splats()
    assert splats.density and not splats.antialiased
    ewa.save(tmp_path / "a.ply", splats)
    again = ewa.load(tmp_path / "a.ply")
    assert again.density and np.allclose(again.opacity_logits, splats.opacity_logits, atol=1e-5)
    usual = ewa.evaluate(splats, still_life, [0])
    assert abs(usual.psnr - ewa.evaluate(again, still_life, [0]).psnr) < 1e-3
    splats.density = False
    assert ewa.evaluate(splats, still_life, [0]).psnr != usual.psnr
    with pytest.raises(ewa.InputError, match="kernel"):
        ewa.Trainer(still_life, steps=1, kernel="box", train_frames=[0])


def test_exposures_are_learned(still_life):
    trainer = ewa.Trainer(still_life, steps=2, appearance="affine", train_frames=[0, 1, 2])
    assert np.array_equal(trainer.exposures(), np.tile(np.eye(3, 4, dtype=np.float32), (3, 1, 1)))
    trained(trainer)
    assert not np.array_equal(
        trainer.exposures(), np.tile(np.eye(3, 4, dtype=np.float32), (3, 1, 1))
    )


def test_the_loss_has_weights(still_life, tmp_path):
    trainer = ewa.Trainer(still_life, steps=3, loss={"l2": 1, "l1": 0.5}, train_frames=[0])
    assert trainer.options["loss"] == "l1=0.5,l2=1"
    trainer.step()
    trainer.save_checkpoint(tmp_path / "a.ewa")
    resumed = ewa.Trainer.resume(tmp_path / "a.ewa", still_life)
    assert resumed.options == trainer.options
    assert same(trained(resumed), trained(trainer))
    as_text = ewa.Trainer(still_life, steps=3, loss="l1=0.5,l2=1", train_frames=[0])
    assert same(trained(as_text), trainer.splats())
    usual = ewa.Trainer(still_life, steps=3, train_frames=[0])
    assert usual.options["loss"] == "l1=0.8,ssim=0.2"
    assert not same(trained(usual), trainer.splats())


def test_a_region_has_six_numbers(still_life):
    trainer = ewa.Trainer(still_life, steps=2, region=(-9, -9, -9, 9, 9, 9.5), train_frames=[0])
    assert trainer.options["region"] == "-9,-9,-9,9,9,9.5"
    assert ewa.Trainer(still_life, steps=2, train_frames=[0]).options["region"] == ""
    for wrong in ("1,2", (1, 0, 0, 0, 0, 0)):
        with pytest.raises(ewa.InputError, match="region=.*lower corner first"):
            ewa.Trainer(still_life, steps=2, region=wrong, train_frames=[0])
    with pytest.raises(TypeError, match="region=.*wrong type"):
        ewa.Trainer(still_life, steps=2, region=(1, 2), train_frames=[0])


def test_the_sky_is_learned(still_life):
    trainer = ewa.Trainer(still_life, steps=20, background="sky", train_frames=[0, 1, 2])
    assert trainer.options["background"] == "sky" and np.all(trainer.sky() == 0.5)
    splats, sky = trained(trainer), trainer.sky()
    assert sky.shape[0] == sky.shape[1] > 1 and sky.shape[2] == 3 and np.ptp(sky) > 0.01
    with_sky = ewa.evaluate(splats, still_life, [0], background=sky)
    assert with_sky.psnr > ewa.evaluate(splats, still_life, [0]).psnr
    frame = still_life.frames[0]
    camera = still_life.viewmats[0], still_life.Ks[0], frame.width, frame.height
    red = np.zeros((1, 1, 3)) + [1, 0, 0]
    assert np.allclose(
        ewa.render(splats, *camera, background=red).color,
        ewa.render(splats, *camera, background=(1, 0, 0)).color,
        atol=1e-6,
    )
    for wrong in (np.zeros((2, 3, 3)), np.zeros((0, 0, 3)), np.full((1, 1, 3), np.nan)):
        with pytest.raises(ValueError, match="background"):
            ewa.render(splats, *camera, background=wrong)
    none = ewa.Trainer(still_life, steps=1, train_frames=[0])
    assert none.sky().shape == (0, 0, 3)


def test_evaluation_is_that_of_the_command_line(still_life, command_line_run, program, tmp_path):
    program("eval", command_line_run / "splats.ply", STILL_LIFE, "--json", tmp_path / "eval.json")
    expected = json.loads((tmp_path / "eval.json").read_text())
    splats = ewa.load(command_line_run / "splats.ply")
    result = ewa.evaluate(splats, still_life)
    assert result.psnr == pytest.approx(expected["psnr"], abs=1e-6)
    assert result.ssim == pytest.approx(expected["ssim"], abs=1e-6)
    assert [frame.name for frame in result.frames] == [
        still_life.frames[i].name for i in still_life.split()[1]
    ]
    one = ewa.evaluate(splats, still_life, [8], background="white")
    assert len(one.frames) == 1 and one.psnr != result.frames[1].psnr
    with pytest.raises(ewa.InputError, match="frames is empty"):
        ewa.evaluate(splats, still_life, [])
    with pytest.raises(IndexError, match="frames has the index -1"):
        ewa.evaluate(splats, still_life, [-1])


def test_quality_stands_for_steps(still_life):
    for quality, steps in (("low", 2000), ("medium", 7000), ("high", 30000)):
        assert ewa.Trainer(still_life, quality=quality, max_splats=3000).steps == steps
    assert ewa.Trainer(still_life, quality="low", steps=5).steps == 5
    with pytest.raises(ewa.InputError, match="quality: .*did you mean low"):
        ewa.Trainer(still_life, quality="lwo")


def test_a_limit_of_memory_is_an_error_in_bytes(still_life):
    with pytest.raises(ewa.DeviceError, match="device_memory_bytes=2 is too little: this needs ") as e:
        ewa.Trainer(still_life, device_memory_bytes=2)
    needed = int(re.search(r"needs (\d+) or more", str(e.value))[1])
    assert needed > 1000 and "--" not in str(e.value)


@pytest.fixture(scope="module")
def passers_by(still_life, tmp_path_factory):
    """The still life in small images, three of which show a block that the others do not."""
    folder = tmp_path_factory.mktemp("passers_by")
    shutil.copytree(still_life.root, folder, dirs_exist_ok=True)
    for index in (5, 20, 33):
        frame = still_life.frames[index]
        image = still_life.images[index].copy()
        image[40:110, 60:130, :3] = (1, 0, 1)
        ewa.save_image(folder / "images" / frame.name, image)
    return ewa.Dataset(folder, downscale=4)


def test_robust_trainings_are_those_of_the_command_line(passers_by, program, tmp_path):
    options = dict(steps=252, robust=True, max_splats=3000, seed=2)
    words = ["--steps=252", "--robust", "--max-splats=3000", "--seed=2", "--appearance=none"]
    program("train", passers_by.root, "-o", tmp_path / "run", "--downscale=4", *words)
    masks = sorted(path.name for path in (tmp_path / "run/passers_by").rglob("*.png"))
    assert masks
    trainer = ewa.Trainer(passers_by, **options)
    for _ in range(250):
        trainer.step()
    trainer.save_checkpoint(tmp_path / "half.ewa")
    splats = trained(trainer)
    assert same(splats, ewa.load(tmp_path / "run"))
    assert same(trained(ewa.Trainer.resume(tmp_path / "half.ewa", passers_by)), splats)
    # The command line keeps the masks beside its checkpoint.
    again = ewa.Trainer.resume(tmp_path / "run", passers_by, steps=253)
    assert again.options["robust"] and again.steps_done == 252
    again.step()
    shutil.rmtree(tmp_path / "run/passers_by")
    (tmp_path / "run/passers_by").mkdir()
    with pytest.raises(ewa.InputError, match="its masks of robust=True are not those"):
        ewa.Trainer.resume(tmp_path / "run", passers_by, steps=253)


def test_short_robust_trainings_mask_nothing(passers_by, tmp_path):
    with pytest.warns(UserWarning, match="robust: nothing is masked, since 6 steps are too few to find what only one image shows"):
        trainer = ewa.Trainer(passers_by, steps=6, robust=True, max_splats=3000)
    trainer.step()
    trainer.save_checkpoint(tmp_path / "short.ewa")
    again = ewa.Trainer.resume(tmp_path / "short.ewa", passers_by, steps=600)
    assert same(again.splats(), trainer.splats())
