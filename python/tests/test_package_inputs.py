# SPDX-License-Identifier: Apache-2.0
"""Runs' folders and archives in place of splats and datasets, and cameras of photos."""

import gc
import json
import os
import pickle
import shutil
import tempfile

import numpy as np
import pytest

import ewa
from conftest import STILL_LIFE, make_splats, run_python

OPTIONS = dict(steps=4, downscale=4, test_every=3, max_splats=2000, strategy="none", masks="ignore")


def same(a, b):
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in ("means", "sh"))


@pytest.fixture(scope="module")
def run(program, tmp_path_factory):
    """The folder of a run of the command line."""
    folder = tmp_path_factory.mktemp("runs") / "a"
    words = [f"--{name.replace('_', '-')}={value}" for name, value in OPTIONS.items()]
    program("train", STILL_LIFE, "-o", folder, *words)
    return folder


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    """A zip of the dataset, in a folder of its own as archives of folders are."""
    folder = tmp_path_factory.mktemp("archives")
    made = shutil.make_archive(folder / "ds", "zip", STILL_LIFE.parent, STILL_LIFE.name)
    return folder / os.path.basename(made)


def test_a_run_has_splats(run):
    splats = ewa.load(run / "splats.ply")
    assert same(ewa.load(run), splats) and same(ewa.load(f"{run}/"), splats)
    renders = []
    data = ewa.Dataset(run)
    view = (data.viewmats[0], data.Ks[0], 32, 24)
    for given in (splats, run, run / "splats.ply"):
        renders.append(ewa.render(given, *view).color)
        renders.append(ewa.Renderer(given).render(*view).color)
    renderer = ewa.Renderer(make_splats())
    renderer.replace(run)
    renders.append(renderer.render(*view).color)
    assert all(np.array_equal(image, renders[0]) for image in renders)


def test_a_run_has_the_dataset_as_it_was_trained(run, still_life):
    data = ewa.Dataset(run)
    assert data.root == STILL_LIFE and len(data) == len(still_life)
    assert data.frames[0].width == still_life.frames[0].width // 4
    assert data.split() == still_life.split(3) != still_life.split()
    assert data.split(5) == still_life.split(5)
    half = ewa.Dataset(run, downscale=2)
    assert half.frames[0].width == still_life.frames[0].width // 2
    again = pickle.loads(pickle.dumps(half))
    assert again.frames[0].width == half.frames[0].width and again.split() == half.split()


def test_a_run_is_evaluated_as_it_was(run):
    expected = json.loads((run / "summary.json").read_text())["test_psnr"]
    assert ewa.evaluate(run, run).psnr == pytest.approx(expected, abs=1e-5)
    assert ewa.evaluate(ewa.load(run), ewa.Dataset(run)).psnr == pytest.approx(expected, abs=1e-5)


def test_a_run_is_trained_on(run):
    data = ewa.Dataset(run)
    trainer = ewa.Trainer(run, steps=4, max_splats=2000, strategy="none")
    assert trainer.train_frames == data.split()[0]
    for _ in trainer:
        pass
    assert same(trainer.splats(), ewa.load(run))
    resumed = ewa.Trainer.resume(run, run, steps=5)
    assert (resumed.steps_done, resumed.steps) == (4, 5)
    resumed.step()
    begun = ewa.Trainer(data, steps=2, init=run, strategy="none")
    assert len(begun.splats()) == len(ewa.load(run))


def test_a_checkpoint_of_a_file_of_first_splats_continues(run, tmp_path):
    first = tmp_path / "first.ply"
    ewa.save(first, ewa.load(run))
    trainer = ewa.Trainer(run, steps=2, init=first, strategy="none")
    trainer.step()
    trainer.save_checkpoint(tmp_path / "run.ewa")
    trainer.step()
    resumed = ewa.Trainer.resume(tmp_path / "run.ewa", run)
    resumed.step()
    assert same(resumed.splats(), trainer.splats())


def test_points_are_first_splats(still_life, tmp_path):
    points = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    points += "property float z\nend_header\n0 0 0\n1 0 0\n0 1 0\n"
    (tmp_path / "points.ply").write_text(points)
    with pytest.warns(UserWarning, match="starts from 3 splats of .*points.ply"):
        trainer = ewa.Trainer(still_life, steps=1, init=tmp_path / "points.ply", strategy="none")
    assert len(trainer.splats()) == 3


def test_refined_cameras_are_used(program, tmp_path):
    run = tmp_path / "run"
    options = ("--downscale", 4, "--max-splats", 2000, "--steps", 20, "--refine-poses")
    program("train", STILL_LIFE, "-o", run, *options)
    moved = ewa.Dataset(run).viewmats - ewa.Dataset(STILL_LIFE).viewmats
    assert 0 < np.abs(moved).max() < 1


def test_folders_that_are_no_runs(tmp_path, run):
    (tmp_path / "empty").mkdir()
    with pytest.raises(ewa.InputError, match="a folder without splats; expected a splat file, or"):
        ewa.load(tmp_path / "empty")
    begun = tmp_path / "begun"
    begun.mkdir()
    shutil.copy(run / "config.json", begun)
    with pytest.raises(ewa.InputError, match="this training run has no splats.ply yet"):
        ewa.load(begun)
    (begun / "config.json").write_text(json.dumps({"dataset": "gone"}))
    with pytest.raises(ewa.InputError, match="the dataset gone was not found"):
        ewa.Dataset(begun)
    with pytest.raises(ewa.InputError, match="init is neither splats .*, and there is no file randm"):
        ewa.Trainer(STILL_LIFE, init="randm")


def unpacked_folders():
    return {name for name in os.listdir(tempfile.gettempdir()) if name.startswith("ewa-zip-")}


def test_an_archive_is_a_dataset(archive, still_life):
    before = unpacked_folders()
    data = ewa.Dataset(archive, downscale=2)
    assert len(unpacked_folders() - before) == 1
    assert repr(data) == f"Dataset('{archive}', {len(still_life)} frames)"
    assert np.array_equal(data.viewmats, still_life.viewmats)
    assert np.array_equal(data.points, still_life.points)
    images = data.images
    trainer = ewa.Trainer(data, steps=2, max_splats=2000, strategy="none", image_cache_bytes=0)
    copy = pickle.loads(pickle.dumps(data))
    assert len(unpacked_folders() - before) == 2
    assert np.array_equal(copy.images[1], images[1])
    del data, copy
    gc.collect()
    assert len(unpacked_folders() - before) == 1  # the images and the trainer need it
    assert images[0].shape == ewa.Dataset(STILL_LIFE, downscale=2).images[0].shape
    del images
    for _ in trainer:
        pass
    del trainer
    gc.collect()
    assert unpacked_folders() == before


def test_an_archive_is_gone_with_the_process(archive):
    before = unpacked_folders()
    code = f"""
import os, ewa
data = ewa.Dataset({str(archive)!r})
child = os.fork()
if child == 0:
    del data
    os._exit(0)
os.waitpid(child, 0)
print(data.images[0].shape[2])
def fails(data):
    raise ValueError
try:
    fails(data)
except ValueError as error:
    kept = error
"""
    assert run_python(code) == "3"
    assert unpacked_folders() == before


def test_archives_that_are_no_datasets(tmp_path, archive, still_life):
    before = unpacked_folders()
    photos = tmp_path / "photos"
    photos.mkdir()
    shutil.copy(still_life.frames[0].image_path, photos)
    shutil.make_archive(tmp_path / "photos", "zip", photos)
    with pytest.raises(
        ewa.InputError, match="without cameras; ewa.find_cameras searches those of the photos"
    ):
        ewa.Dataset(tmp_path / "photos.zip")
    whole = archive.read_bytes()
    (tmp_path / "cut.zip").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ewa.InputError, match="cut.zip"):
        ewa.Dataset(tmp_path / "cut.zip")
    broken = tmp_path / "broken"
    (broken / "images").mkdir(parents=True)
    (broken / "transforms.json").write_text("{")
    shutil.make_archive(tmp_path / "broken", "zip", broken)
    with pytest.raises(ewa.InputError, match=r"broken\.zip: transforms\.json: ") as found:
        ewa.Dataset(tmp_path / "broken.zip")
    assert tempfile.gettempdir() + "/ewa-zip-" not in str(found.value)
    assert unpacked_folders() == before


COLMAP = """#!/bin/sh
case "$*" in *--help*) echo "  --SiftExtraction.use_gpu arg (=1)"; exit 0;; esac
previous=
for word; do
    if [ "$previous" = --output_path ]; then output=$word; fi
    previous=$word
done
if [ "$FAIL" = "$1" ]; then echo "the reason" >&2; exit 1; fi
case $1 in
feature_extractor) touch "$3"; echo "Processed file [4/4]";;
matches_importer) echo "Matching block [1/1] in 0.1s";;
mapper) cp -r "$MODELS"/. "$output";;
esac
"""


@pytest.fixture
def photos(tmp_path, monkeypatch):
    """Photos without cameras, and a stand-in for COLMAP that knows those of three of them."""
    random = np.random.default_rng(0)
    for i in range(4):
        ewa.save_image(tmp_path / f"photos/{i}.png", random.uniform(size=(32, 48, 3)))
    model = tmp_path / "models/0"
    model.mkdir(parents=True)
    camera = np.array([1], "<u8").tobytes() + np.array([1, 1], "<u4").tobytes()
    camera += np.array([48, 32], "<u8").tobytes() + np.array([40, 40, 24, 16], "<f8").tobytes()
    images = np.array([3], "<u8").tobytes()
    for i in range(3):
        images += np.array([i + 1], "<u4").tobytes()
        images += np.array([1, 0, 0, 0, 0.1 * i, 0, 3], "<f8").tobytes()
        images += np.array([1], "<u4").tobytes() + f"{i}.png\0".encode() + bytes(8)
    points = np.array([8], "<u8").tobytes()
    for i in range(8):
        points += np.array([i + 1], "<u8").tobytes()
        points += np.array([0.5 if i & bit else -0.5 for bit in (1, 2, 4)], "<f8").tobytes()
        points += bytes([128] * 3) + np.array([0.5], "<f8").tobytes() + bytes(8)
    for name, contents in (("cameras", camera), ("images", images), ("points3D", points)):
        (model / f"{name}.bin").write_bytes(contents)
    program = tmp_path / "bin/colmap"
    program.parent.mkdir()
    program.write_text(COLMAP)
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{program.parent}:/usr/bin:/bin")
    monkeypatch.setenv("MODELS", str(model.parent))
    return tmp_path / "photos"


def test_cameras_of_photos_are_found(photos, tmp_path):
    seen = []
    with pytest.warns(UserWarning, match="3.png"):
        data = ewa.find_cameras(
            photos, tmp_path / "dataset", matching="unordered", progress=lambda *now: seen.append(now)
        )
    assert [frame.name for frame in data.frames] == ["0.png", "1.png", "2.png"]
    assert len(data.points) == 8 and len(ewa.Dataset(tmp_path / "dataset")) == 3
    assert seen and all(isinstance(what, str) and 0 <= n <= all for what, n, all in seen)
    with pytest.warns(UserWarning, match="starts from 8 points"):
        trainer = ewa.Trainer(data, steps=1, strategy="none", train_frames=[0, 1, 2])
    trainer.step()


def test_searches_that_fail(photos, tmp_path, monkeypatch):
    def stops(what, done, total):
        raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        ewa.find_cameras(photos, tmp_path / "stopped", progress=stops)
    with pytest.raises(ewa.InputError, match="there is no such file or folder"):
        ewa.find_cameras(tmp_path / "gone", tmp_path / "out")
    with pytest.raises(ewa.InputError, match="matching: .*did you mean sequence"):
        ewa.find_cameras(photos, tmp_path / "out", matching="sequense")
    with pytest.raises(ewa.InputError, match="frames is not from 3 to"):
        ewa.find_cameras(photos, tmp_path / "out", frames=1)
    monkeypatch.setenv("FAIL", "feature_extractor")
    with pytest.raises(ewa.DeviceError, match="colmap feature_extractor failed"):
        ewa.find_cameras(photos, tmp_path / "out")


def test_pycolmap_of_the_running_python_is_found(photos, tmp_path, monkeypatch):
    names = "match_image_pairs = ImageReaderOptions = FeatureExtractionOptions"
    (tmp_path / "pycolmap.py").write_text(f"__version__ = '4.2.1'\n{names} = type('Options', (), {{}})\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setenv("PATH", str(tmp_path / "nothing"))
    monkeypatch.delenv("VIRTUAL_ENV", raising=False)
    # It is no whole package.
    with pytest.raises(ewa.DeviceError, match="colmap feature_extractor failed"):
        ewa.find_cameras(photos, tmp_path / "out")


def copy_of_still_life(folder):
    shutil.copytree(STILL_LIFE, folder, symlinks=True)
    return folder


def test_what_is_not_used_is_a_warning(tmp_path):
    data = copy_of_still_life(tmp_path / "a")
    assert ewa.Dataset(data).used.startswith("48 of 48 photos"), ewa.Dataset(data).used
    (data / "masks").mkdir(exist_ok=True)
    photo = data / ewa.Dataset(data).frames[0].image_path.relative_to(data)
    for name in ("other", "another"):
        shutil.copy(photo, data / f"masks/{name}.png")
    with pytest.warns(UserWarning, match="0 of 2 masks .masks/another.png"):
        changed = ewa.Dataset(data)
    assert "0 of 2 masks" in changed.used and isinstance(changed.notes, list)


def test_what_makes_a_training_useless_is_a_warning(still_life):
    away = make_splats()
    away.means = away.means + np.float32(1e4)
    with pytest.warns(UserWarning, match="none of the first splats of init is in view"):
        ewa.Trainer(still_life, init=away, steps=1)
