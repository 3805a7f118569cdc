# SPDX-License-Identifier: Apache-2.0
"""What notebooks show, and what goes to the workers of a data loader."""

import multiprocessing
import pickle

import numpy as np
import pytest

import ewa
from conftest import camera, make_splats

VIEW, K, WIDTH, HEIGHT = camera()


def copied(value):
    return pickle.loads(pickle.dumps(value))


def shown(png, tmp_path):
    assert png.startswith(b"\x89PNG")
    (tmp_path / "shown.png").write_bytes(png)
    return ewa.load_image(tmp_path / "shown.png")


def test_renders_show_themselves(tmp_path):
    splats = make_splats()
    one = ewa.render(splats, VIEW, K, WIDTH, HEIGHT, mode="depth")
    assert repr(one) == "Renders(color (48, 64, 3), alpha (48, 64, 1), depth (48, 64, 1))"
    assert (
        np.abs(shown(one._repr_png_(), tmp_path) - one.color.clip(0, 1)).max() <= 0.5 / 255 + 1e-6
    )
    many = ewa.render(splats, np.stack([VIEW] * 3), K, WIDTH, HEIGHT)
    assert repr(many) == "Renders(color (3, 48, 64, 3), alpha (3, 48, 64, 1))"
    picture = shown(many._repr_png_(), tmp_path)
    assert picture.shape == (HEIGHT, 3 * WIDTH, 3)
    assert np.array_equal(picture[:, :WIDTH], picture[:, 2 * WIDTH :])


def test_images_show_themselves_and_have_slices(still_life, tmp_path):
    images = still_life.images
    assert repr(images) == f"Images({len(images)} images of '{still_life.root}')"
    some = images[1:6:2]
    assert len(some) == 3 and repr(some).startswith("Images(3 images of")
    for own, index in zip(some, (1, 3, 5)):
        assert np.array_equal(own, images[index])
    assert np.array_equal(images[::-1][0], images[-1]) and np.array_equal(
        images[np.int64(2)], images[2]
    )
    assert len(images[5:2]) == 0 and np.stack(images[:2]).shape[0] == 2
    with pytest.raises(IndexError, match="there are 3 images"):
        some[3]
    frame = still_life.frames[0]
    assert shown(frame._repr_png_(), tmp_path).shape[:2] == (frame.height, frame.width)


def test_datasets_and_results_pickle(still_life):
    again = copied(still_life)
    assert repr(again) == repr(still_life) and np.array_equal(again.viewmats, still_life.viewmats)
    half = ewa.Dataset(still_life.root, downscale=2)
    assert copied(half).frames[0].width == half.frames[0].width
    assert np.array_equal(copied(half.images[2:4])[1], half.images[3])
    for frame in (half.frames[1], still_life.frames[-1]):
        same = copied(frame)
        assert repr(same) == repr(frame) and same.image_path == frame.image_path
        assert same._repr_png_() == frame._repr_png_()
    renders = ewa.render(make_splats(), VIEW, K, WIDTH, HEIGHT, mode="count")
    same = copied(renders)
    assert np.array_equal(same.color, renders.color) and np.array_equal(same.count, renders.count)
    assert same.depth is None


def test_reports_pickle(still_life):
    trainer = ewa.Trainer(still_life, steps=1, max_splats=100, init="random")
    report = trainer.step()
    same = copied(report)
    names = [name for name in dir(ewa.StepReport) if not name.startswith("_")]
    assert len(names) == 8
    assert all(getattr(same, name) == getattr(report, name) for name in names)
    found = ewa.evaluate(trainer.splats(), still_life, [0])
    same = copied(found)
    assert (same.psnr, same.ssim, same.seconds) == (found.psnr, found.ssim, found.seconds)
    assert repr(same.frames) == repr(found.frames)


def mean_of(images):
    return [float(image.mean()) for image in images]


@pytest.mark.parametrize("method", ["spawn", "fork"])
def test_workers_read_images(still_life, method):
    some = still_life.images[:2]
    with multiprocessing.get_context(method).Pool(1) as pool:
        assert pool.apply(mean_of, (some,)) == mean_of(some)
