# SPDX-License-Identifier: Apache-2.0
"""Fixtures, and lines on standard output by which scripts/test-summary counts each test: GoogleTest's."""

import os
import pathlib
import subprocess
import sys

import numpy as np
import pytest

import ewa

ROOT = pathlib.Path(__file__).resolve().parents[2]
STILL_LIFE = ROOT / "scenes/still_life"
SEEDS = ROOT / "tests/fuzz/seeds"


def pytest_runtest_logstart(nodeid, location):
    print(f"\n[ RUN      ] {nodeid}")


def pytest_runtest_logreport(report):
    if report.when == "call" and report.passed:
        print(f"\n[       OK ] {report.nodeid} ({report.duration * 1000:.0f} ms)")
    elif report.skipped:
        reason = report.longrepr[-1] if isinstance(report.longrepr, tuple) else ""
        print(f"\n[  SKIPPED ] {report.nodeid} ({report.duration * 1000:.0f} ms): {reason}")
    elif report.failed:
        print(f"\n[  FAILED  ] {report.nodeid} ({report.duration * 1000:.0f} ms)")


def make_splats(n=50, sh_degree=3, seed=0):
    """Random splats in the unit cube around the origin."""
    random = np.random.default_rng(seed)
    return ewa.Splats(
        means=random.uniform(-1, 1, (n, 3)),
        quats=random.normal(size=(n, 4)),
        log_scales=random.uniform(-3, -1, (n, 3)),
        opacity_logits=random.normal(size=n),
        sh=random.normal(scale=0.3, size=(n, (sh_degree + 1) ** 2, 3)),
    )


def camera(distance=4.0, width=64, height=48):
    """A camera that looks along z at the origin: viewmat, K, width, height."""
    viewmat = np.eye(4)
    viewmat[2, 3] = distance
    return viewmat, np.array([[60, 0, width / 2], [0, 60, height / 2], [0, 0, 1.0]]), width, height


def run_python(code, **environment):
    """Runs code in a process of its own and returns its standard output."""
    result = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ, **environment},
    )
    assert result.returncode == 0, result.stderr
    return result.stdout.strip()


@pytest.fixture(scope="session")
def program():
    """The command line program of the same build."""

    def run(*arguments):
        words = [os.environ["EWA_PROGRAM"], *map(str, arguments)]
        result = subprocess.run(words, capture_output=True, text=True, timeout=300)
        assert result.returncode == 0, result.stderr
        return result.stdout

    return run


@pytest.fixture(scope="session")
def still_life():
    return ewa.Dataset(STILL_LIFE)
