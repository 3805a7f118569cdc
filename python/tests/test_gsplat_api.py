# SPDX-License-Identifier: Apache-2.0
"""Names, errors, dialects and the runner of ewa.gsplat."""

import importlib
import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

torch = pytest.importorskip("torch")

from ewa import gsplat as ours
from gsplat_scenes import HEIGHT, WIDTH, Scene

CUDA_ONLY = [
    dict(with_ut=True),
    dict(with_eval3d=True),
    dict(rays=torch.zeros(1)),
    dict(ftheta_coeffs=object()),
    dict(lidar_coeffs=object()),
    dict(external_distortion_coeffs=object()),
    dict(ut_params=object()),
    dict(distributed=True),
    dict(camera_model="ftheta"),
    dict(camera_model="lidar"),
    dict(return_normals=True),
    dict(global_z_order=False),
    dict(render_mode="RGB-d"),
    dict(render_mode="Ed"),
]


@pytest.mark.parametrize("option", CUDA_ONLY, ids=lambda o: "-".join(map(str, o)))
def test_what_is_cuda_only_says_so(option):
    with pytest.raises(NotImplementedError, match="CUDA-only; ewa renders"):
        ours.rasterization(**Scene().arguments(**option))


@pytest.mark.parametrize(
    "name",
    [
        "rasterization_2dgs",
        "rasterization_inria_wrapper",
        "fully_fused_projection_2dgs",
        "fully_fused_projection_with_ut",
        "rasterize_to_pixels_2dgs",
        "rasterize_to_pixels_eval3d",
    ],
)
def test_functions_that_are_cuda_only_say_so(name):
    with pytest.raises(NotImplementedError, match=f"{name}.*CUDA-only"):
        getattr(ours, name)()
    with pytest.raises(NotImplementedError, match="CUDA-only"):
        ours.PngCompression()
    assert ours.has_3dgs() and not ours.has_2dgs() and not ours.has_3dgut()


def test_options_that_change_nothing_are_accepted():
    s = Scene()
    plain = ours.rasterization(**s.arguments())[0]
    image = ours.rasterization(
        **s.arguments(
            channel_chunk=8,
            segmented=True,
            rolling_shutter=ours.RollingShutterType.GLOBAL,
            renderer_config=ours.RendererConfig_MixedBatch(),
        )
    )[0]
    assert torch.equal(image, plain)
    for config, error in (
        (object(), TypeError),
        (ours.RendererConfig_ParallelBatch(), ValueError),
        (type("Other", (ours.RendererConfig,), {})(), NotImplementedError),
    ):
        with pytest.raises(error):
            ours.rasterization(**s.arguments(renderer_config=config))
    with pytest.raises(TypeError):
        ours.RendererConfig()


@pytest.mark.parametrize(
    "name,change",
    [
        ("means", lambda t: t[:, :2]),
        ("means", lambda t: t[0]),
        ("quats", lambda t: t[:, :3]),
        ("quats", lambda t: t[1:]),
        ("scales", lambda t: t[:, :2]),
        ("opacities", lambda t: t[:, None]),
        ("colors", lambda t: t[1:]),
        ("viewmats", lambda t: t[0]),
        ("viewmats", lambda t: t[:, :3]),
        ("Ks", lambda t: t[:, :2]),
        ("backgrounds", lambda t: torch.zeros(1, 4)),
        ("covars", lambda t: torch.zeros(60, 6)),
    ],
)
@pytest.mark.parametrize("error", [ValueError, AssertionError, RuntimeError])
def test_wrong_shapes_name_argument_and_shape(name, change, error):
    s = Scene()
    wrong = change(getattr(s, name, None))
    with pytest.raises(error, match=rf"{name}.*\({', '.join(map(str, wrong.shape))}"):
        ours.rasterization(**s.arguments(**{name: wrong}))


def test_other_wrong_arguments():
    s = Scene()
    for options, error, text in (
        (dict(render_mode="XYZ"), ValueError, "render_mode 'XYZ'"),
        (dict(rasterize_mode="smooth"), ValueError, "rasterize_mode 'smooth'"),
        (dict(packed=False, sparse_grad=True), ValueError, "sparse_grad needs packed"),
        (dict(means=s.means.tolist()), TypeError, "means is a list"),
        (dict(colors=torch.rand(60, 4, 3), sh_degree=2), ValueError, "colors.*9 bands"),
        (dict(colors=torch.rand(60, 0)), ValueError, r"colors .*\(60, 0\).*at least one channel"),
        (dict(colors=torch.rand(60, 4, 0), sh_degree=1), ValueError, "colors .*one channel"),
        (dict(sh_degree=3), ValueError, r"colors .*\(60, 3\); expected \[..., N, K, D\]"),
        (dict(colors=torch.tensor(1.0)), ValueError, r"colors .*\(\); expected \[..., N, D\]"),
        (dict(viewmats=torch.eye(4)), ValueError, r"viewmats .*\[..., C, 4, 4\]"),
        (dict(means=torch.zeros(3)), ValueError, r"means .*\[..., N, 3\]"),
        (dict(eps2d=-0.1), ValueError, "eps2d is -0.1; expected 0 or more"),
        (dict(width=0), ValueError, "width is 0; expected 1 to 2147483647"),
        (dict(height=2**31), ValueError, "height is 2147483648; expected"),
        (dict(width=64.0), TypeError, "width is 64.0; expected an integer"),
        (dict(height="48"), TypeError, "height is '48'; expected an integer"),
        (dict(tile_size=2**40), ValueError, "tile_size is 1099511627776"),
        (dict(tile_size=16.0), TypeError, "tile_size is 16.0"),
        (dict(colors=torch.rand(60, 36, 3), sh_degree=5), ValueError, "sh_degree is 5; .* 0 to 4"),
        (dict(colors=torch.rand(60, 4, 3), sh_degree=1.0), TypeError, "sh_degree is 1.0"),
        (dict(colors=torch.rand(60, 3) + 1j), TypeError, "colors is complex"),
        (dict(means=s.means.to("meta")), TypeError, r"means is on meta.*means.cpu\(\)"),
    ):
        with pytest.raises(error, match=text):
            ours.rasterization(**s.arguments(**options))
    with pytest.raises(ValueError, match="degrees_to_use is 5"):
        ours.spherical_harmonics(5, torch.rand(4, 3), torch.rand(4, 36, 3))
    with pytest.raises(TypeError, match="degrees_to_use is 1.5"):
        ours.spherical_harmonics(1.5, torch.rand(4, 3), torch.rand(4, 9, 3))
    views = (s.means, None, s.quats, s.scales, s.viewmats, s.Ks)
    with pytest.raises(ValueError, match="height is 2147483648"):
        ours.fully_fused_projection(*views, WIDTH, 2**31)
    with pytest.raises(ValueError, match="viewmats .*C, 4, 4"):
        ours.fully_fused_projection(*views[:4], torch.eye(4), s.Ks, WIDTH, HEIGHT)
    with pytest.raises(ValueError, match="quats and scales"):
        ours.fully_fused_projection(s.means, None, None, None, s.viewmats, s.Ks, WIDTH, HEIGHT)


def test_signature_is_that_of_gsplat():
    names = list(inspect.signature(ours.rasterization).parameters)
    start = "means quats scales opacities colors viewmats Ks width height near_plane far_plane"
    middle = "radius_clip eps2d sh_degree packed tile_size backgrounds render_mode sparse_grad"
    end = "absgrad rasterize_mode channel_chunk distributed camera_model segmented covars"
    assert names[:26] == f"{start} {middle} {end}".split()
    theirs = pytest.importorskip("gsplat.rendering")
    for name, parameter in inspect.signature(theirs.rasterization).parameters.items():
        assert name in names, name
        default = inspect.signature(ours.rasterization).parameters[name].default
        if name not in ("tile_size", "rolling_shutter"):
            assert default == parameter.default, name
    strategy = importlib.import_module("gsplat.strategy")
    for cls in ("DefaultStrategy", "MCMCStrategy"):
        own = inspect.signature(getattr(ours, cls)).parameters
        for name, parameter in inspect.signature(getattr(strategy, cls)).parameters.items():
            assert own[name].default == parameter.default, (cls, name)


def test_mcmc_fields_by_position():
    strategy = ours.MCMCStrategy(123, 4.5, 6, 7, 8, 9, 0.1, True, 0.2, 30.0)
    assert (strategy.cap_max, strategy.noise_lr, strategy.refine_start_iter) == (123, 4.5, 6)
    assert (strategy.refine_stop_iter, strategy.noise_injection_stop_iter) == (7, 8)
    assert (strategy.refine_every, strategy.min_opacity, strategy.verbose) == (9, 0.1, True)
    assert (strategy.noise_opacity_t, strategy.noise_opacity_k) == (0.2, 30.0)


@pytest.fixture
def dialect():
    yield ours.dialect
    ours.dialect("1.6")


def test_dialects(dialect):
    s = Scene(cameras=2)
    call = (s.means, None, s.quats, s.scales, s.viewmats, s.Ks, WIDTH, HEIGHT)
    assert dialect() == "1.6" and ours.__version__ == "1.6.0"
    new = ours.fully_fused_projection(*call, packed=True)
    assert len(new) == 9
    dialect("1.5")
    middle = ours.fully_fused_projection(*call, packed=True)
    assert len(middle) == 8 and torch.equal(middle[3], new[4])
    assert dialect("1.4") == "1.4"
    old = ours.fully_fused_projection(*call, packed=True)
    assert len(old) == 7 and torch.equal(old[0], new[1])
    assert torch.equal(old[2], new[4].amax(-1))
    for packed in (False, True):
        image, _, meta = ours.rasterization(**s.arguments(packed=packed))
        assert meta["radii"].dim() == meta["depths"].dim()
        strategy = ours.DefaultStrategy()
        state = strategy.initialize_state()
        strategy.step_pre_backward(None, None, state, 1, meta)
        image.sum().backward(retain_graph=True)
        strategy.step_post_backward({"means": s.means}, {}, state, 1, meta, packed=packed)
        assert state["count"].sum() == (meta["radii"] > 0).sum()
        assert len(meta["isect_ids"]) > 0
    with pytest.raises(ValueError, match="1.3"):
        dialect("1.3")


SCRIPT = """
import sys
import gsplat
from gsplat import rasterization, DefaultStrategy
from gsplat.cuda._wrapper import fully_fused_projection, isect_tiles
from gsplat.rendering import rasterization as same
from gsplat.strategy.ops import duplicate
from gsplat.relocation import compute_relocation
from gsplat.optimizers import SelectiveAdam
from gsplat.exporter import export_splats
from gsplat.distributed import cli
import gsplat.utils
import ewa.gsplat

assert gsplat is ewa.gsplat and same is rasterization and gsplat.__version__ == "1.6.0"
assert gsplat.strategy.DefaultStrategy is DefaultStrategy
assert __name__ == "__main__"
ewa.gsplat.install()
assert sys.modules["gsplat"] is gsplat
cli(lambda rank, world_rank, size, args: print(rank, size, *args), sys.argv[1:])
try:
    import gsplat.nothing
except ModuleNotFoundError:
    print("not found")
sys.exit(5)
"""


def run(*arguments, **options):
    """Runs Python with the modules of this process, and returns the finished process."""
    return subprocess.run(
        [sys.executable, *arguments], capture_output=True, text=True, timeout=120, **options
    )


def test_a_script_that_imports_gsplat(tmp_path):
    script = tmp_path / "train.py"
    (tmp_path / "beside.py").write_text("")
    script.write_text("import beside\n" + SCRIPT)
    done = run("-m", "ewa.gsplat", str(script), "--steps", "7")
    assert done.returncode == 5, done.stderr
    assert done.stdout == "0 1 --steps 7\nnot found\n"
    done = run("-m", "ewa.gsplat", "-m", "train", "a", cwd=tmp_path)
    assert done.returncode == 5 and done.stdout.startswith("0 1 a"), done.stderr


def test_the_runner_says_how_it_is_used(tmp_path, capsys):
    from ewa.gsplat.__main__ import main

    assert main([]) == 2 and capsys.readouterr().err.startswith("usage:")
    assert main(["-m"]) == 2 and capsys.readouterr().err.startswith("usage:")
    assert main([str(tmp_path / "none.py")]) == 2
    assert "no such file" in capsys.readouterr().err
    assert main(["--help"]) == 0 and capsys.readouterr().out.startswith("usage:")


@pytest.mark.parametrize("module", ["nope", "nope.x", "json", ".x"])
def test_a_module_that_is_missing_is_one_line(module, tmp_path):
    done = run("-m", "ewa.gsplat", "-m", module, cwd=tmp_path)
    assert done.returncode == 1 and len(done.stderr.splitlines()) == 1, done.stderr
    assert module in done.stderr and not done.stdout


def test_errors_inside_a_module_stay_visible(tmp_path):
    (tmp_path / "pack").mkdir()
    (tmp_path / "pack/__init__.py").write_text("import nothing_of_the_kind")
    (tmp_path / "pack/part.py").write_text("")
    (tmp_path / "plain.py").write_text("import nothing_of_the_kind")
    for module in ("pack.part", "plain"):
        done = run("-m", "ewa.gsplat", "-m", module, cwd=tmp_path)
        assert done.returncode == 1 and "Traceback" in done.stderr
        assert "No module named 'nothing_of_the_kind'" in done.stderr


def test_without_torch_the_import_says_what_is_missing():
    done = run("-c", "import sys; sys.modules['torch'] = None; import ewa.gsplat")
    line = "ImportError: ewa.gsplat needs PyTorch: pip install torch"
    assert done.stderr.splitlines()[-1] == line


def test_install_comes_before_gsplat(monkeypatch):
    monkeypatch.setitem(sys.modules, "gsplat", object())
    with pytest.raises(RuntimeError, match="imported already"):
        ours.install()


def test_import_is_quick():
    code = """
import sys, time
import torch
start = time.process_time()
import ewa.gsplat
print(time.process_time() - start)
"""
    assert min(float(run("-c", code).stdout) for _ in range(2)) < 0.5


def test_threads_of_torch_wait_without_spinning():
    def policy(code):
        code += "; import os; print(os.environ.get('OMP_WAIT_POLICY'))"
        return run("-c", code).stdout.strip()

    assert policy("import ewa.gsplat") == "PASSIVE"
    assert policy("import torch; import ewa.gsplat") == "None"


def test_export():
    ewa = pytest.importorskip("ewa")
    if not hasattr(ewa, "save"):
        pytest.skip("the package has no files")
    torch.manual_seed(1)
    count = 20
    means = torch.randn(count, 3)
    means[3, 0] = float("nan")
    call = (
        means,
        torch.randn(count, 3),
        torch.randn(count, 4),
        torch.randn(count),
        torch.randn(count, 1, 3),
        torch.randn(count, 8, 3),
    )
    call[5][7, 2, 1] = float("inf")
    data = ours.export_splats(*call)
    assert data.startswith(b"ply") and b"element vertex 18" in data
    assert len(ours.export_splats(*call, format="splat")) == 18 * 32
    assert b"element chunk" in ours.export_splats(*call, format="ply_compressed")
    with pytest.raises(ValueError, match="format"):
        ours.export_splats(*call, format="obj")


def test_export_writes_a_file(tmp_path):
    ewa = pytest.importorskip("ewa")
    if not hasattr(ewa, "save"):
        pytest.skip("the package has no files")
    path = tmp_path / "splats.ply"
    call = [torch.randn(4, n) for n in (3, 3, 4)] + [torch.randn(4), torch.randn(4, 3)]
    data = ours.export_splats(*call, torch.zeros(4, 0, 3), save_to=str(path))
    assert path.read_bytes() == data
    found = ewa.load(str(path))
    torch.testing.assert_close(torch.from_numpy(found.means), call[0])


def test_comparisons_are_skipped_one_by_one_where_gsplat_is_missing():
    code = """
import sys, pytest
sys.modules["gsplat"] = None
sys.exit(pytest.main(["-q", "-p", "no:cacheprovider", *sys.argv[1:]]))
"""
    file = Path(__file__).with_name("test_gsplat_functions.py")
    done = run("-c", code, str(file), "-k", "test_world_to_cam")
    skipped = r"\[  SKIPPED \] .*test_world_to_cam .*: gsplat, to compare with, is not installed"
    assert re.search(skipped, done.stdout) and done.returncode == 0, done.stdout
