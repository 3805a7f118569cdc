# SPDX-License-Identifier: Apache-2.0
"""Metrics of images and of evaluations."""

import json
import math
import pickle

import numpy as np
import pytest

import ewa
from conftest import make_splats

RANDOM = np.random.default_rng(0)
REFERENCE = RANDOM.uniform(size=(40, 60, 3)).astype(np.float32)
IMAGE = (REFERENCE + RANDOM.normal(scale=0.05, size=REFERENCE.shape)).clip(0, 1).astype(np.float32)


def test_metrics_are_those_of_the_command_line(program, tmp_path):
    for name, image in (("image", IMAGE), ("reference", REFERENCE)):
        ewa.save_image(tmp_path / f"{name}.png", image)
    files = tmp_path / "image.png", tmp_path / "reference.png"
    program("compare", *files, "--metrics", "cc_psnr,flip", "--json", tmp_path / "c.json")
    expected = json.loads((tmp_path / "c.json").read_text())
    expected = expected.get("images", [expected])[0]
    arrays = [ewa.load_image(file) for file in files]
    for given in (files, arrays, [np.rint(255 * image).astype(np.uint8) for image in arrays]):
        found = ewa.metrics(*given, ["cc_psnr", "flip"])
        assert list(found) == ["psnr", "ssim", "cc_psnr", "flip"]
        for name, value in found.items():
            assert value == pytest.approx(expected[name], abs=1e-6), name


def test_psnr_and_ssim_come_alone():
    found = ewa.metrics(IMAGE, REFERENCE)
    assert list(found) == ["psnr", "ssim"]
    error = np.mean((IMAGE.astype(np.float64) - REFERENCE) ** 2)
    assert found["psnr"] == pytest.approx(-10 * np.log10(error), abs=1e-5)
    same = ewa.metrics(REFERENCE, REFERENCE, "all")
    assert math.isinf(same["psnr"]) and same["ssim"] == pytest.approx(1) and same["flip"] == 0
    assert not any(name.startswith("lpips") for name in same)


def test_weights_count_pixels():
    weights = np.zeros((40, 60))
    weights[:, 30:] = 1
    half = ewa.metrics(IMAGE, REFERENCE, weights=weights)["psnr"]
    assert half == pytest.approx(ewa.metrics(IMAGE[:, 30:], REFERENCE[:, 30:])["psnr"], abs=1e-4)
    assert math.isnan(ewa.metrics(IMAGE, REFERENCE, weights=0 * weights)["psnr"])


@pytest.mark.parametrize(
    "arguments, options, text",
    [
        ((IMAGE, REFERENCE[1:]), {}, "pictures of 60 x 40 x 3 and 60 x 39 x 3"),
        ((IMAGE, REFERENCE, "flpi"), {}, "did you mean flip"),
        ((IMAGE, REFERENCE, ["lpips"]), {}, "lpips needs lpips_weights"),
        ((IMAGE[0], REFERENCE), {}, "image has the shape"),
        ((IMAGE, REFERENCE), dict(weights=np.ones((3, 3, 3))), "weights has the shape"),
    ],
)
def test_wrong_metrics(arguments, options, text):
    with pytest.raises(ValueError, match=text) as found:
        ewa.metrics(*arguments, **options)
    assert "\n" not in str(found.value)


def test_an_evaluation_has_metrics(still_life, program, tmp_path):
    splats = ewa.Splats.from_points(still_life.points, still_life.point_colors)
    ewa.save(tmp_path / "s.ply", splats)
    files = tmp_path / "s.ply", still_life.root
    program("eval", *files, "--metrics", "cc_psnr", "--json", tmp_path / "eval.json")
    expected = json.loads((tmp_path / "eval.json").read_text())
    result = ewa.evaluate(splats, still_life, metrics="cc_psnr")
    assert list(result.metrics) == ["psnr", "ssim", "cc_psnr"]
    assert result.metrics["cc_psnr"] == pytest.approx(expected["cc_psnr"], abs=1e-5)
    assert result.metrics["psnr"] == result.psnr
    mean = np.mean([frame.metrics["cc_psnr"] for frame in result.frames])
    assert mean == pytest.approx(result.metrics["cc_psnr"], abs=1e-6)
    again = pickle.loads(pickle.dumps(result))
    assert again.metrics == result.metrics and again.frames[0].metrics == result.frames[0].metrics
    assert list(ewa.evaluate(splats, still_life, [0]).metrics) == ["psnr", "ssim"]
    with pytest.raises(ewa.InputError, match="did you mean"):
        ewa.evaluate(make_splats(), still_life, metrics=["cc_pnsr"])
