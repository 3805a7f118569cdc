# SPDX-License-Identifier: Apache-2.0
"""The examples that train with torch."""

import ast
import re
import subprocess
import sys

import pytest

torch = pytest.importorskip("torch")

import ewa
from conftest import ROOT, STILL_LIFE

EXAMPLES = ROOT / "examples/python"


def run(name, *arguments):
    """Runs an example and returns what it prints."""
    words = [sys.executable, EXAMPLES / name, *map(str, arguments), "--downscale", "2"]
    result = subprocess.run(words, capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_fit_and_then_refine_poses(tmp_path):
    splats = tmp_path / "splats.ply"
    short = run("fit.py", STILL_LIFE, "--steps", 2)
    long = run("fit.py", STILL_LIFE, "--steps", 160, "--out", splats)
    before, after = (float(re.search(r"([\d.]+) dB", text)[1]) for text in (short, long))
    assert after > before + 6, (before, after)
    assert len(ewa.load(splats)) > 100
    found = run("poses.py", splats, STILL_LIFE, "--steps", 30, "--frames", 2, "--noise", 0.02)
    first, last = (
        float(re.search(rf"{word}: ([\d.]+) deg", found)[1]) for word in ("before", "after")
    )
    assert last < 0.7 * first, found


def test_the_dissimilarity_is_that_of_ssim(monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLES)
    import ssim

    torch.manual_seed(1)
    x = torch.rand(19, 30, 3, dtype=torch.float64, requires_grad=True)
    y = torch.rand(19, 30, 3, dtype=torch.float64)
    window = torch.tensor(ssim.WINDOW, dtype=torch.float64)
    window = (window[:, None] * window)[None, None]

    def mean(image):
        return torch.nn.functional.conv2d(image.permute(2, 0, 1)[:, None], window, padding=5)

    mean_x, mean_y = mean(x), mean(y)
    var_x, var_y = mean(x * x) - mean_x**2, mean(y * y) - mean_y**2
    covar = mean(x * y) - mean_x * mean_y
    top = (2 * mean_x * mean_y + 0.01**2) * (2 * covar + 0.03**2)
    bottom = (mean_x**2 + mean_y**2 + 0.01**2) * (var_x + var_y + 0.03**2)
    expected, actual = 1 - (top / bottom).mean(), ssim.dissimilarity(x, y)
    torch.testing.assert_close(actual, expected)
    found = [torch.autograd.grad(value, x)[0] for value in (actual, expected)]
    torch.testing.assert_close(*found)


def test_the_splatfacto_example_is_valid_python():
    ast.parse((EXAMPLES / "splatfacto.py").read_text())
