# SPDX-License-Identifier: Apache-2.0
"""The metrics of ewa eval and ewa compare against other implementations: flip-evaluator, scikit-image where it is installed,
Pillow, TensorBoard, and the formulas of gsplat, multinerf and Wang in numpy."""

import json
import math
import pathlib

import numpy as np
import pytest
from PIL import Image

import ewa

ROOT = pathlib.Path(__file__).resolve().parents[2]
STILL_LIFE = ROOT / "scenes/still_life"
CLOSE = 1e-4


def picture(width, height, seed):
    """Waves, noise, and patches that are black and white."""
    random = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width]
    waves = [np.sin(x / random.uniform(3, 40) + y / random.uniform(3, 40) + random.uniform(0, 6)) for _ in range(9)]
    image = 0.5 + 0.14 * np.stack([sum(waves[i::3]) for i in range(3)], -1) + random.normal(scale=0.03, size=(height, width, 3))
    image[: height // 6, : width // 5], image[-height // 7 :, -width // 6 :] = 0, 1
    return image


def saved(path, image):
    """Writes an 8-bit PNG, and returns its values in 0..1."""
    levels = np.round(255 * np.clip(image, 0, 1)).astype(np.uint8)
    Image.fromarray(levels).save(path)
    return levels / 255.0


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """A file that is judged, its reference, and their values."""
    folder = tmp_path_factory.mktemp("pair")
    reference = picture(211, 182, 1)
    judged = 0.06 + 0.8 * reference**1.2 + np.random.default_rng(2).normal(scale=0.04, size=reference.shape)
    return folder / "a.png", folder / "b.png", saved(folder / "a.png", judged), saved(folder / "b.png", reference)


@pytest.fixture(scope="module")
def figures(pair, program):
    file = pair[0].parent / "figures.json"
    program("compare", *pair[:2], "--metrics", "all", "--json", file)
    return json.loads(file.read_text())


def psnr(a, b):
    return -10 * math.log10(np.mean((a - b) ** 2))


def windowed(values, valid):
    """The Gaussian window of 11 x 11 pixels and sigma 1.5."""
    taps = np.exp(-(np.arange(-5, 6) ** 2) / 4.5)
    taps /= taps.sum()
    for axis in (0, 1):
        if not valid:
            values = np.pad(values, [(5, 5) if i == axis else (0, 0) for i in range(3)])
        size = values.shape[axis] - 10
        values = sum(tap * np.take(values, range(i, i + size), axis) for i, tap in enumerate(taps))
    return values


def ssim_and_contrast(a, b, valid=True):
    mean_a, mean_b = windowed(a, valid), windowed(b, valid)
    variances = windowed(a * a, valid) - mean_a**2 + windowed(b * b, valid) - mean_b**2
    contrast = (2 * (windowed(a * b, valid) - mean_a * mean_b) + 9e-4) / (variances + 9e-4)
    return np.mean(contrast * (2 * mean_a * mean_b + 1e-4) / (mean_a**2 + mean_b**2 + 1e-4)), np.mean(contrast)


def affine(image, reference):
    """gsplat's color_correct_affine."""
    a = (np.mean(reference * image, (0, 1)) - np.mean(reference, (0, 1)) * np.mean(image, (0, 1))) / np.var(reference, (0, 1))
    b = np.mean(image, (0, 1)) - a * np.mean(reference, (0, 1))
    return np.clip((image - b) / a, 0, 1)


def quadratic(image, reference):
    """multinerf's color_correct."""
    def unclipped(z):
        return (z >= 0.5 / 255) & (z <= 1 - 0.5 / 255)

    shape, image, reference = image.shape, image.reshape(-1, 3), reference.reshape(-1, 3)
    first = unclipped(image)
    for _ in range(5):
        terms = np.concatenate([image[:, c : c + 1] * image[:, c:] for c in range(3)] + [image, np.ones_like(image[:, :1])], -1)
        maps = []
        for c in range(3):
            mask = first[:, c] & unclipped(image[:, c]) & unclipped(reference[:, c])
            maps.append(np.linalg.lstsq(terms * mask[:, None], reference[:, c] * mask, rcond=-1)[0])
        image = np.clip(terms @ np.stack(maps, -1), 0, 1)
    return image.reshape(shape)


def test_psnr_and_ssim(pair, figures):
    a, b = pair[2:]
    assert figures["psnr"] == pytest.approx(psnr(a, b), abs=CLOSE)
    assert figures["ssim"] == pytest.approx(ssim_and_contrast(a, b, valid=False)[0], abs=CLOSE)
    assert figures["ssim_valid"] == pytest.approx(ssim_and_contrast(a, b)[0], abs=CLOSE)


def test_scikit_image_agrees(pair, figures):
    metrics = pytest.importorskip("skimage.metrics")
    a, b = pair[2:]
    assert figures["psnr"] == pytest.approx(metrics.peak_signal_noise_ratio(b, a, data_range=1), abs=CLOSE)
    similarity = metrics.structural_similarity(
        a, b, channel_axis=2, data_range=1, gaussian_weights=True, sigma=1.5, use_sample_covariance=False
    )
    assert figures["ssim_valid"] == pytest.approx(similarity, abs=CLOSE)


@pytest.mark.parametrize("prefix, correct", [("cc_", affine), ("cc2_", quadratic)])
def test_colour_correction(pair, figures, prefix, correct):
    a, b = pair[2:]
    corrected = correct(a, b)
    assert psnr(corrected, b) > psnr(a, b) + 1
    assert figures[f"{prefix}psnr"] == pytest.approx(psnr(corrected, b), abs=CLOSE)
    assert figures[f"{prefix}ssim"] == pytest.approx(ssim_and_contrast(corrected, b, valid=False)[0], abs=CLOSE)


def test_colour_correction_of_grey_images(tmp_path, program):
    """All terms of the quadratic map depend on each other, so that least squares has many solutions."""
    grey = picture(40, 30, 3)[..., :1].repeat(3, -1)
    b, a = saved(tmp_path / "b.png", grey), saved(tmp_path / "a.png", 0.2 + 0.6 * grey)
    program("compare", tmp_path / "a.png", tmp_path / "b.png", "--metrics", "cc2_psnr", "--json", tmp_path / "j")
    assert json.loads((tmp_path / "j").read_text())["cc2_psnr"] == pytest.approx(psnr(quadratic(a, b), b), abs=1e-3)


def test_multi_scale_ssim(pair, figures):
    a, b, product = *pair[2:], 1
    for scale, exponent in enumerate((0.0448, 0.2856, 0.3001, 0.2363, 0.1333)):
        if scale > 0:
            height, width = a.shape[0] // 2 * 2, a.shape[1] // 2 * 2
            a, b = (
                z[:height, :width].reshape(height // 2, 2, width // 2, 2, 3).mean((1, 3)) for z in (a, b)
            )
        product *= max(0, ssim_and_contrast(a, b)[scale < 4]) ** exponent
    assert figures["ms_ssim"] == pytest.approx(product, abs=CLOSE)


def test_flip(pair, figures):
    flip = pytest.importorskip("flip_evaluator")
    judged, reference = (z.astype(np.float32) for z in pair[2:])
    assert figures["flip"] == pytest.approx(flip.evaluate(reference, judged, "LDR", applyMagma=False)[1], abs=CLOSE)


def test_bands(pair, figures):
    """Each band by its own definition: means over squares of one size, without those over squares of twice the side."""
    difference = pair[2] - pair[3]

    def means(side):
        if side == 32:
            return np.zeros_like(difference)
        result = np.empty_like(difference)
        for y in range(0, difference.shape[0], side):
            for x in range(0, difference.shape[1], side):
                result[y : y + side, x : x + side] = difference[y : y + side, x : x + side].mean((0, 1))
        return result

    total = 0
    for side in (1, 2, 4, 8, 16):
        band = np.mean((means(side) - means(2 * side)) ** 2)
        total += band
        assert figures[f"psnr_{side}px"] == pytest.approx(-10 * math.log10(band), abs=CLOSE)
    assert -10 * math.log10(total) == pytest.approx(figures["psnr"], abs=CLOSE)


def evaluated(program, folder, downscale, *options):
    """The figures of the first image by ewa eval, its render, and its file."""
    data = ewa.Dataset(STILL_LIFE, downscale=downscale)
    splats, frame = ewa.Splats.from_points(data.points, data.point_colors, sh_degree=0), data.frames[0]
    ewa.save(folder / "splats.ply", splats)
    program("eval", folder / "splats.ply", STILL_LIFE, "--downscale", downscale, "--json", folder / "eval.json", *options)
    result = json.loads((folder / "eval.json").read_text())
    figures = result["frames"][0]
    assert figures["name"] == frame.name and result["protocol"] == options[1]
    render = ewa.render(splats, data.viewmats[0], data.Ks[0], frame.width, frame.height).color
    return figures, np.clip(np.asarray(render, float), 0, 1), Image.open(next(STILL_LIFE.rglob(frame.name))).convert("RGB")


def test_protocol_of_inria(tmp_path, program):
    """8-bit images that Pillow resizes."""
    figures, a, photo = evaluated(program, tmp_path, 4, "--protocol", "inria")
    a, b = np.floor(255 * a + 0.5) / 255, np.asarray(photo.resize((a.shape[1], a.shape[0]))) / 255.0
    assert set(figures) == {"name", "psnr", "ssim"}
    assert figures["psnr"] == pytest.approx(psnr(a, b), abs=1e-3)  # the resize may differ in its last bit
    assert figures["ssim"] == pytest.approx(ssim_and_contrast(a, b, valid=False)[0], abs=CLOSE)


def test_protocol_of_nerfbaselines(tmp_path, program):
    """8-bit images, of which the render's lose their fraction; SSIM of windows inside the image."""
    figures, a, photo = evaluated(program, tmp_path, 1, "--protocol", "nerfbaselines")
    a, b = np.floor(255 * a) / 255, np.asarray(photo) / 255.0
    assert set(figures) == {"name", "psnr", "ssim"}
    assert figures["psnr"] == pytest.approx(psnr(a, b), abs=CLOSE)
    assert figures["ssim"] == pytest.approx(ssim_and_contrast(a, b)[0], abs=CLOSE)


def test_tensorboard_reads_the_curves(tmp_path, program):
    accumulator = pytest.importorskip("tensorboard.backend.event_processing.event_accumulator")
    words = ["train", STILL_LIFE, "-o", tmp_path / "run", "--downscale", 8, "--seed", 1, "--eval-every", 20,
             "--metrics", "flip,cc_psnr", "--tensorboard", "--quiet"]
    program(*words, "--steps", 40)
    program(*words, "--steps", 60, "--resume")
    lines = [json.loads(line) for line in (tmp_path / "run/metrics.jsonl").read_text().splitlines()]
    events = accumulator.EventAccumulator(str(tmp_path / "run"))
    events.Reload()
    tags = {"train/loss": "loss", "train/splats": "splats", "train/psnr": "train_psnr", "test/psnr": "test_psnr",
            "test/ssim": "test_ssim", "test/flip": "test_flip", "test/cc_psnr": "test_cc_psnr"}
    assert set(events.Tags()["scalars"]) == {*tags, "train/steps_per_second"}
    for tag, name in tags.items():
        expected = [(line["step"], line[name]) for line in lines if name in line]
        assert len(expected) >= 3
        assert [(event.step, event.value) for event in events.Scalars(tag)] == [
            (step, pytest.approx(value, rel=1e-6)) for step, value in expected
        ]
    walls = [event.wall_time for event in events.Scalars("train/loss")]
    assert walls == sorted(walls) and walls[0] > 1.6e9
    summary = json.loads((tmp_path / "run/summary.json").read_text())
    assert summary["test_flip"] == lines[-1]["test_flip"]
