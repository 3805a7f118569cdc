# SPDX-License-Identifier: Apache-2.0
"""Start-up, memory, threads, signals and forks."""

import gc
import multiprocessing
import os
import pathlib
import resource
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from conftest import ROOT, STILL_LIFE, camera, make_splats, run_python

import ewa


def test_import_is_quick_and_opens_nothing():
    code = """
import resource, sys
import numpy
before = resource.getrusage(resource.RUSAGE_SELF)
import ewa
after = resource.getrusage(resource.RUSAGE_SELF)
print(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
print("torch" in sys.modules, "vulkan" in open("/proc/self/maps").read())
"""
    seconds, state = run_python(code).splitlines()
    assert float(seconds) < 0.3 and state == "False False"


def test_the_errors_are_the_packages():
    assert issubclass(ewa.InputError, ValueError) and issubclass(ewa.DeviceError, RuntimeError)
    assert repr(ewa.InputError) == "<class 'ewa.InputError'>"


def test_the_version_is_that_of_the_program(program):
    assert ewa.__version__ in program("--version")


def resident_kib():
    gc.collect()
    pages = pathlib.Path("/proc/self/statm").read_text().split()[1]
    return int(pages) * resource.getpagesize() // 1024


def test_renders_do_not_grow_memory():
    splats, view = make_splats(2000), camera(width=320, height=240)
    for _ in range(20):
        ewa.render(splats, *view)
    before = resident_kib()
    for _ in range(200):
        ewa.render(splats, *view)
    assert resident_kib() - before < 16 * 1024


def test_splats_do_not_grow_memory():
    splats = make_splats(20000)
    for _ in range(5):
        splats[:].means.sum()
    before = resident_kib()
    for _ in range(50):
        kept = splats[:].means
    assert kept.shape == (20000, 3) and resident_kib() - before < 16 * 1024


def test_four_threads_render_and_train_at_once():
    data = ewa.Dataset(STILL_LIFE, downscale=4)
    renderer, view = ewa.Renderer(make_splats()), camera()
    expected = renderer.render(*view).color
    wrong = []

    def render():
        for _ in range(20):
            if not np.array_equal(renderer.render(*view).color, expected):
                wrong.append("shared")
            if not np.array_equal(ewa.render(make_splats(), *view).color, expected):
                wrong.append("own")

    def train():
        losses = [report.loss for report in ewa.Trainer(data, steps=10, strategy="mcmc")]
        if losses != alone:
            wrong.append("training")

    alone = [report.loss for report in ewa.Trainer(data, steps=10, strategy="mcmc")]
    threads = [threading.Thread(target=work) for work in (render, render, train, train)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


def test_other_threads_run_meanwhile():
    # A thread that counts gets on during a render only if the interpreter is given to it: none takes it away here.
    splats, view = make_splats(20000), camera(width=1024, height=1024)
    ewa.render(splats, *camera())
    counted, started, done = 0, threading.Event(), threading.Event()

    def count():
        nonlocal counted
        started.set()
        while not done.is_set():
            counted += 1
            time.sleep(0)  # gives it back

    thread = threading.Thread(target=count)
    thread.start()
    started.wait()
    before = counted
    interval = sys.getswitchinterval()
    sys.setswitchinterval(100)
    try:
        ewa.render(splats, *view)
        during = counted - before
    finally:
        done.set()
        sys.setswitchinterval(interval)
        thread.join()
    assert during > 5


def test_a_thread_that_still_renders_does_not_disturb_the_end():
    code = f"""
import sys, threading
sys.path.insert(0, {str(ROOT / "python/tests")!r})
from conftest import camera, ewa, make_splats
renderer, rendered = ewa.Renderer(make_splats()), threading.Event()
def render():
    while True:
        renderer.render(*camera())
        rendered.set()
for _ in range(2):
    threading.Thread(target=render, daemon=True).start()
rendered.wait()
other = ewa.Renderer(make_splats())  # freed at the end
print("end")
"""
    assert [run_python(code) for _ in range(3)] == ["end"] * 3


INTERRUPTED = """
import os, signal, sys
import numpy as np
import ewa
trainer = ewa.Trainer(ewa.Dataset(sys.argv[1], downscale=4), steps=1000)
try:
    for report in trainer:
        if report.step == 5:
            os.kill(os.getpid(), signal.SIGINT)
except KeyboardInterrupt:
    print("interrupted after", trainer.steps_done)
print(trainer.step().step, len(trainer.splats()))
"""


def test_ctrl_c_ends_a_training_after_the_step():
    result = subprocess.run(
        [sys.executable, "-c", INTERRUPTED, STILL_LIFE], capture_output=True, text=True, timeout=120
    )
    assert result.stdout.splitlines() == ["interrupted after 5", "6 3000"], result.stderr


class Interrupted(Exception):
    pass


def seconds_until_interrupted(work):
    """Processor time of work during which a signal arrives whose handler raises an exception."""

    def handler(*_):
        raise Interrupted

    def send():
        begun.wait()
        signal.pthread_kill(threading.main_thread().ident, signal.SIGUSR1)

    begun = threading.Event()
    thread = threading.Thread(target=send)
    thread.start()
    before, interval = signal.signal(signal.SIGUSR1, handler), sys.getswitchinterval()
    sys.setswitchinterval(100)  # the thread gets the interpreter when work gives it away
    start = time.process_time()  # of all threads, however busy the machine is
    try:
        with pytest.raises(Interrupted):
            begun.set()
            work()
        return time.process_time() - start
    finally:
        sys.setswitchinterval(interval)
        signal.signal(signal.SIGUSR1, before)
        thread.join()


def seconds_of(work):
    work()
    start = time.process_time()
    work()
    return time.process_time() - start


def test_signals_end_a_long_render():
    renderer, (viewmat, k, width, height) = ewa.Renderer(make_splats(50000)), camera()
    one = seconds_of(lambda: renderer.render(viewmat, k, width, height))
    many = np.repeat(viewmat[None], 1000, axis=0)
    assert seconds_until_interrupted(lambda: renderer.render(many, k, width, height)) < 500 * one


def test_signals_end_a_long_evaluation(still_life):
    splats = make_splats(2000)
    frames = list(range(48))
    all_frames = seconds_of(lambda: ewa.evaluate(splats, still_life, frames))
    assert seconds_until_interrupted(lambda: ewa.evaluate(splats, still_life, frames * 10)) < 5 * all_frames


def child(connection):
    splats = make_splats()
    answers = []
    for call in (
        ewa.current_device,
        ewa.devices,
        lambda: ewa.render(splats, *camera()),
        lambda: RENDERERS[0].render(*camera()),
    ):
        try:
            call()
            answers.append("no error")
        except ewa.DeviceError as error:
            answers.append(str(error))
    RENDERERS.clear()  # frees what the parent made
    answers.append(len(splats[:3]))
    connection.send(answers)


RENDERERS = []


def test_a_forked_process_is_told():
    RENDERERS.append(ewa.Renderer(make_splats()))
    here, there = multiprocessing.Pipe()
    process = multiprocessing.get_context("fork").Process(target=child, args=(there,))
    process.start()
    try:
        assert here.poll(60)
        *errors, count = here.recv()
        process.join(60)
        assert process.exitcode == 0 and count == 3
    finally:
        process.kill()
    assert all("forked" in error and "spawn" in error for error in errors), errors
    RENDERERS[0].render(*camera())  # the parent goes on
    RENDERERS.clear()


def test_a_fork_before_the_first_use_may_use_the_device():
    code = """
import os
import ewa
if os.fork() == 0:
    print(len(ewa.devices()) > 0, ewa.current_device().name != "", flush=True)
    os._exit(0)
os.wait()
print(ewa.current_device().name != "")
"""
    assert run_python(code).split() == ["True"] * 3


@pytest.mark.parametrize("path", sorted((ROOT / "examples/python").glob("render_ply.py"), key=str))
def test_the_example_runs(path, tmp_path):
    data = ewa.Dataset(STILL_LIFE)
    ewa.save(tmp_path / "a.ply", ewa.Splats.from_points(data.points, data.point_colors))
    for cameras in (STILL_LIFE / "transforms.json", STILL_LIFE):
        out = tmp_path / f"out{cameras.suffix}"
        subprocess.run(
            [sys.executable, path, tmp_path / "a.ply", cameras, out, "--frames", "3", "0"],
            check=True,
            timeout=120,
        )
        assert sorted(file.name for file in out.iterdir()) == ["view_00.png", "view_03.png"]
        view = data.frames[3]
        expected = ewa.render(
            ewa.load(tmp_path / "a.ply"), data.viewmats[3], data.Ks[3], view.width, view.height
        ).color
        assert np.abs(ewa.load_image(out / "view_03.png") - np.clip(expected, 0, 1)).max() < 0.003
