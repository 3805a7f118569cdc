# SPDX-License-Identifier: Apache-2.0
"""Metrics of images and of evaluations."""

import json
import math
import pickle
import sys
import types

import numpy as np
import pytest

import ewa
from conftest import make_splats
from ewa import _lpips

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
        ((IMAGE[0], REFERENCE), {}, "image has the shape"),
        ((IMAGE, REFERENCE), dict(weights=np.ones((3, 3, 3))), "weights has the shape"),
    ],
)
def test_wrong_metrics(arguments, options, text):
    with pytest.raises(ValueError, match=text) as found:
        ewa.metrics(*arguments, **options)
    assert "\n" not in str(found.value)


@pytest.fixture
def package(monkeypatch):
    """Stands in for lpips: the mean absolute difference, twice as high with AlexNet, and a map of it where `spatial` asks for one."""
    torch = pytest.importorskip("torch")
    made = []

    class Network:
        def __init__(self, net, verbose):
            assert not verbose
            made.append(net)
            self.factor, self.spatial = {"vgg": 1, "alex": 2}[net], False

        def __call__(self, a, b):
            assert a.dtype == b.dtype == torch.float32 and a.shape[:2] == b.shape[:2] == (1, 3)
            assert max(a.abs().max(), b.abs().max()) <= 1
            found = self.factor * (a - b).abs().mean(1, keepdim=True)
            return found if self.spatial else found.mean((2, 3), keepdim=True)

    module = types.ModuleType("lpips")
    module.LPIPS = Network
    monkeypatch.setitem(sys.modules, "lpips", module)
    _lpips.network.cache_clear()
    yield made
    _lpips.network.cache_clear()


def test_lpips_is_that_of_the_package(package):
    expected = np.mean(np.abs(2 * IMAGE.astype(float) - 2 * REFERENCE))
    found = ewa.metrics(IMAGE, REFERENCE, "LPIPS,flip")
    assert list(found) == ["psnr", "ssim", "flip", "lpips_vgg", "lpips_alex"]
    assert found["lpips_vgg"] == pytest.approx(expected, abs=1e-6)
    assert found["lpips_alex"] == pytest.approx(2 * expected, abs=1e-6)
    assert list(ewa.metrics(IMAGE, REFERENCE, ["lpips_alex"])) == ["psnr", "ssim", "lpips_alex"]
    assert package == ["vgg", "alex"], "each network is loaded once"
    opaque = np.ones((40, 60, 1), np.float32)
    with_alpha = ewa.metrics(*(np.concatenate([i, opaque], -1) for i in (IMAGE, REFERENCE)), "lpips_vgg")
    assert with_alpha["lpips_vgg"] == pytest.approx(expected, abs=1e-6)
    small = ewa.metrics(IMAGE[:20], REFERENCE[:20], "lpips")
    assert math.isnan(small["lpips_alex"]) and not math.isnan(small["lpips_vgg"])


def test_pixels_of_weight_0_do_not_count_in_lpips(package):
    weights = np.zeros((40, 60))
    weights[:, 30:] = 1
    half = ewa.metrics(IMAGE, REFERENCE, "lpips_vgg", weights=weights)["lpips_vgg"]
    assert half == pytest.approx(np.mean(np.abs(2 * IMAGE - 2 * REFERENCE)[:, 30:]), abs=1e-6)
    assert ewa.metrics(IMAGE, REFERENCE, "lpips_vgg")["lpips_vgg"] != pytest.approx(half, abs=1e-6)
    assert math.isnan(ewa.metrics(IMAGE, REFERENCE, "lpips", weights=0 * weights)["lpips_vgg"])


def test_an_evaluation_has_lpips(package, still_life):
    splats = ewa.Splats.from_points(still_life.points, still_life.point_colors)
    result = ewa.evaluate(splats, still_life, metrics=["lpips_vgg", "flip"])
    assert list(result.metrics) == ["psnr", "ssim", "flip", "lpips_vgg"]
    first = result.frames[0]
    at = [frame.name for frame in still_life.frames].index(first.name)
    frame = still_life.frames[at]
    render = np.asarray(ewa.render(splats, still_life.viewmats[at], still_life.Ks[at], frame.width, frame.height).color)
    image = still_life.images[at]
    assert first.metrics["lpips_vgg"] == pytest.approx(np.mean(np.abs(2 * render.clip(0, 1) - 2 * image)), abs=1e-4)
    mean = np.mean([frame.metrics["lpips_vgg"] for frame in result.frames])
    assert mean == pytest.approx(result.metrics["lpips_vgg"], abs=1e-6)


def test_lpips_without_the_package_names_it(monkeypatch, still_life):
    monkeypatch.setitem(sys.modules, "lpips", None)
    _lpips.network.cache_clear()
    for call in (
        lambda: ewa.metrics(IMAGE, REFERENCE, "flip,lpips"),
        lambda: ewa.evaluate(make_splats(), still_life, metrics=["lpips_alex"]),
    ):
        with pytest.raises(ewa.InputError, match="pip install lpips") as found:
            call()
        assert "\n" not in str(found.value)


def test_a_network_that_cannot_be_loaded_is_named_in_one_line(monkeypatch):
    def refuse(net, verbose):
        raise OSError("no\nnetwork")

    module = types.ModuleType("lpips")
    module.LPIPS = refuse
    monkeypatch.setitem(sys.modules, "lpips", module)
    _lpips.network.cache_clear()
    with pytest.raises(ewa.InputError, match="metrics: lpips_vgg: no network"):
        ewa.metrics(IMAGE, REFERENCE, "lpips_vgg")


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
