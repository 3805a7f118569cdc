# SPDX-License-Identifier: Apache-2.0
"""Renders and devices."""

import re

import numpy as np
import pytest
from conftest import STILL_LIFE, camera, make_splats, run_python

import ewa

C0 = 0.28209479177387814


def one_splat(opacity=0.7, color=(1.0, 0.5, 0.25), z=0.0, log_scale=-1.0):
    return ewa.Splats(
        means=[[0, 0, z]],
        quats=[[1, 0, 0, 0]],
        log_scales=np.full((1, 3), log_scale),
        opacity_logits=[np.log(opacity / (1 - opacity))],
        sh=(np.array([[color]]) - 0.5) / C0,
    )


def test_one_splat_has_its_closed_form():
    viewmat, _, width, height = camera()
    k = np.array([[60, 0, 32.5], [0, 60, 24.5], [0, 0, 1.0]])  # the axis meets the centre of a pixel
    renders = ewa.render(one_splat(), viewmat, k, width, height, background=(0, 0, 1), mode="depth")
    assert renders.color.shape == (48, 64, 3) and renders.alpha.shape == renders.depth.shape == (48, 64, 1)
    assert renders.color.dtype == np.float32 and renders.count is None
    assert renders.alpha[24, 32, 0] == pytest.approx(0.7, abs=1e-5)
    assert renders.color[24, 32] == pytest.approx([0.7, 0.35, 0.7 * 0.25 + 0.3], abs=1e-5)
    assert renders.depth[24, 32, 0] == pytest.approx(4, abs=1e-5)
    # sigma of the footprint in px: the focal length times exp(-1) / 4, and the low pass of 0.3
    variance = (60 * np.exp(-1) / 4) ** 2 + 0.3
    assert renders.alpha[24, 37, 0] == pytest.approx(0.7 * np.exp(-0.5 * 25 / variance), abs=1e-4)
    assert renders.color[0, 0] == pytest.approx([0, 0, 1]) and renders.alpha[0, 0, 0] == 0 and renders.depth[0, 0, 0] == 0


def test_a_flat_splat_is_a_surface():
    viewmat, _, width, height = camera()
    k = np.array([[60, 0, 32.5], [0, 60, 24.5], [0, 0, 1.0]])
    # Flat across its z axis, which is turned by 30 degrees about x.
    half = np.radians(15)
    splat = ewa.Splats(
        means=[[0, 0, 0]],
        quats=[[np.cos(half), np.sin(half), 0, 0]],
        log_scales=[[0, 0, -7]],
        opacity_logits=[4],
        sh=[[[1, 1, 1]]],
    )
    views = np.stack([viewmat, viewmat])
    renders = ewa.render(splat, views, k, width, height, mode="normal")
    assert renders.normal.shape == (2, 48, 64, 3) and renders.median_depth is None
    z_axis = np.array([0, -np.sin(2 * half), np.cos(2 * half)])
    toward_eye = z_axis * -np.sign((viewmat[:3, :3] @ z_axis) @ viewmat[:3, 3])
    assert renders.normal[1, 24, 32] == pytest.approx(toward_eye, abs=1e-3)
    depth = ewa.render(splat, viewmat, k, width, height, mode="median-depth").median_depth
    assert depth.shape == (48, 64, 1)
    assert depth[24, 32, 0] == pytest.approx(viewmat[2, 3], abs=1e-3)
    plain = ewa.render(splat, viewmat, k, width, height)
    assert np.array_equal(renders.color[0], plain.color) and np.array_equal(renders.alpha[0], plain.alpha)
    assert plain.normal is None
    with pytest.raises(ewa.InputError, match="integrator splat"):
        ewa.render(splat, viewmat, k, width, height, mode="normal", integrator="ray")


def test_a_batch_holds_the_single_renders():
    splats = make_splats()
    viewmats = np.stack([camera(d)[0] for d in (3, 4, 5)]).astype(np.float32)
    _, k, width, height = camera()
    renders = ewa.render(splats, viewmats, k, width, height, mode="count")
    assert renders.color.shape == (3, 48, 64, 3) and renders.count.shape == (3, 48, 64, 1) and renders.depth is None
    assert renders.count.max() >= 2
    for i in range(3):
        one = ewa.render(splats, viewmats[i], k, width, height)
        assert np.array_equal(renders.color[i], one.color) and np.array_equal(renders.alpha[i], one.alpha)
    other = k * [[1.5], [1.5], [1]]
    each = ewa.render(splats, viewmats, np.stack([k, other, k]), width, height)
    assert np.array_equal(renders.color[::2], each.color[::2])
    assert np.array_equal(each.color[1], ewa.render(splats, viewmats[1], other, width, height).color)
    assert not np.array_equal(renders.color[0], renders.color[1])
    none = ewa.render(splats, viewmats[:0], k, width, height)
    assert none.color.shape == (0, 48, 64, 3)


def brightest(image):
    """The middle of the pixels above half of the largest value: x, y in px."""
    y, x = np.nonzero(image[..., 0] > image.max() / 2)
    return np.array([x.mean() + 0.5, y.mean() + 0.5])


@pytest.mark.parametrize("model", ["opencv", "fisheye", "equirectangular", "orthographic"])
def test_a_lens_shows_a_splat_where_its_formula_says(model):
    x, y, z = (0.8, -0.5, 1.5) if model in ("opencv", "orthographic") else (1.2, -0.7, -0.9)
    splats = ewa.Splats(means=[[x, y, z]], quats=[[1, 0, 0, 0]], log_scales=np.full((1, 3), -3.5), opacity_logits=[3.0], sh=[[[1, 1, 1]]])
    k = np.array([[60, 0, 101.0], [0, 58, 99.0], [0, 0, 1.0]])
    terms = {"opencv": [0.1, -0.05, 0.02, -0.03, 0.01, 0.02, 0.0, 0.0, 0.03], "fisheye": [0.05, -0.01]}.get(model)
    if model == "opencv":
        a, b = x / z, y / z
        r = a * a + b * b
        radial = (1 + 0.1 * r - 0.05 * r**2 + 0.01 * r**3) / (1 + 0.02 * r)
        u = a * radial + 2 * 0.02 * a * b - 0.03 * (r + 2 * a * a) + 0.03 * r
        v = b * radial + 0.02 * (r + 2 * b * b) - 2 * 0.03 * a * b
    elif model == "fisheye":
        r = np.hypot(x, y)
        angle = np.arctan2(r, z)
        bent = angle * (1 + 0.05 * angle**2 - 0.01 * angle**4)
        u, v = bent * x / r, bent * y / r
    elif model == "equirectangular":
        u, v = np.arctan2(x, z), np.arctan2(y, np.hypot(x, z))
    else:
        u, v = x, y
    at = [60 * u + 101, 58 * v + 99]
    renders = ewa.render(splats, np.eye(4), k, 380, 200, camera_model=model, distortion=terms)
    assert np.abs(brightest(renders.color) - at).max() < 0.7
    if model == "equirectangular":
        whole = ewa.render(splats, np.eye(4), None, 400, 200, camera_model=model)
        assert np.abs(brightest(whole.color) - [200 + 200 / np.pi * u, 100 + 200 / np.pi * v]).max() < 0.7


def test_what_is_no_lens_is_refused():
    viewmat, k, width, height = camera()
    for kwargs, text in (
        ({"camera_model": "tele"}, "camera_model: 'tele' is none of pinhole, opencv, fisheye"),
        ({"camera_model": "fisheye", "distortion": [0.1] * 5}, "distortion has 5 terms; camera_model 'fisheye' has at most 4"),
        ({"distortion": [0.1]}, "camera_model 'pinhole' has at most 0"),
        ({"camera_model": "opencv", "distortion": [np.nan]}, "distortion is not finite"),
        ({"camera_model": "opencv", "distortion": [[0.1]]}, "distortion"),
    ):
        with pytest.raises(ValueError, match=re.escape(text)):
            ewa.render(make_splats(), viewmat, k, width, height, **kwargs)
    with pytest.raises((TypeError, ValueError), match="Ks"):
        ewa.render(make_splats(), viewmat, None, width, height)
    with pytest.raises(ValueError, match="parallel rays"):
        ewa.render(make_splats(), viewmat, k, width, height, camera_model="orthographic", integrator="march")


def test_a_rolling_shutter_needs_an_order_and_its_last_poses():
    viewmat, k, width, height = camera()
    behind = np.diag([-1.0, 1, -1, 1]) @ viewmat
    for kwargs, text in (
        ({"rolling_shutter": "top", "viewmats_end": viewmat}, "rolling_shutter: 'top' is none of global, top-to-bottom"),
        ({"rolling_shutter": "top-to-bottom"}, "rolling_shutter 'top-to-bottom' needs viewmats_end"),
        ({"viewmats_end": viewmat}, "viewmats_end needs rolling_shutter"),
        ({"rolling_shutter": "top-to-bottom", "viewmats_end": viewmat[None]}, "viewmats_end"),
        ({"rolling_shutter": "top-to-bottom", "viewmats_end": np.full((4, 4), np.nan)}, "viewmats_end is not finite"),
        ({"rolling_shutter": "top-to-bottom", "viewmats_end": behind}, "viewmats_end: the camera turns by more than 90 degrees"),
    ):
        with pytest.raises(ValueError, match=re.escape(text)):
            ewa.render(make_splats(), viewmat, k, width, height, **kwargs)
    plain = ewa.render(make_splats(), viewmat, k, width, height).color
    still = ewa.render(make_splats(), viewmat, k, width, height, rolling_shutter="left-to-right", viewmats_end=viewmat)
    assert np.array_equal(still.color, plain)


def test_renders_are_those_of_the_command_line(tmp_path, program, still_life):
    splats = ewa.Splats.from_points(still_life.points, still_life.point_colors, sh_degree=0)
    ewa.save(tmp_path / "splats.ply", splats)
    frames = [1, 30]
    program("render", tmp_path / "splats.ply", "--cameras", STILL_LIFE, "--frames", "1,30", "-o", tmp_path / "views")
    size = still_life.frames[1].width, still_life.frames[1].height
    renders = ewa.render(splats, still_life.viewmats[frames], still_life.Ks[frames], *size)
    files = sorted((tmp_path / "views").glob("*.png"))
    assert len(files) == 2
    for file, color in zip(files, renders.color):
        assert np.abs(ewa.load_image(file)[..., :3] - np.clip(color, 0, 1)).max() <= 0.5001 / 255
    assert renders.alpha.mean() > 0.05


def test_a_renderer_keeps_its_scene_until_it_is_replaced():
    splats = make_splats()
    view = camera()
    renderer = ewa.Renderer(splats)
    first = renderer.render(*view).color
    splats.opacity_logits -= 2
    assert np.array_equal(renderer.render(*view).color, first)
    renderer.replace(splats)
    assert renderer.render(*view).color.sum() < first.sum()
    assert np.array_equal(renderer.render(*view).color, ewa.render(splats, *view).color)


def test_antialias_and_degree():
    splats = make_splats(20)
    view = camera(30)
    plain, mip = (ewa.render(splats, *view, kernel=k).alpha for k in ("peak", "antialias"))
    assert mip.sum() < plain.sum()
    splats.antialiased = True
    assert np.array_equal(ewa.render(splats, *view).alpha, mip)
    flat = make_splats(20)
    flat.sh[:, 1:] = 0
    full = make_splats(20)
    assert np.allclose(ewa.render(full, *camera(), sh_degree=0).color, ewa.render(flat, *camera()).color, atol=1e-6)
    assert not np.allclose(ewa.render(full, *camera()).color, ewa.render(flat, *camera()).color, atol=1e-3)


def test_kernels_points_and_integrators_are_those_of_the_command_line(tmp_path, program):
    scene = ewa.Splats.from_points([[0, 0, 0], [0.1, 0, 0.3], [0.4, 0.2, -0.2]], [[1, 0, 0], [0, 1, 0], [0, 0, 1]])
    ewa.save(tmp_path / "s.ply", scene)
    data = ewa.Dataset(STILL_LIFE, need_images=False)
    view = data.viewmats[1], data.Ks[1], data.frames[1].width, data.frames[1].height
    pictures = []
    for look in (
        {},
        {"kernel": "antialias"},
        {"kernel": "density"},
        {"points": True, "nearest": 1},
        {"points": True},
        {"integrator": "ray"},
        {"integrator": "fast-ray", "kernel": "antialias"},
        {"integrator": "march", "samples": 2},
        {"integrator": "march", "kernel": "density"},
    ):
        words = [word for name, value in look.items() for word in ([f"--{name}"] if value is True else [f"--{name}", value])]
        program("render", tmp_path / "s.ply", "--cameras", STILL_LIFE, "--frames", "1", "-o", tmp_path, *words)
        file = ewa.load_image(next(tmp_path.glob("*.png")))
        color = ewa.render(scene, *view, **look).color
        assert np.abs(file[..., :3] - np.clip(color, 0, 1)).max() <= 0.5001 / 255, look
        assert np.array_equal(ewa.Renderer(scene, **look).render(*view).color, color)
        assert not any(np.array_equal(color, other) for other in pictures), look
        pictures.append(color)


def test_densities_can_be_rendered_as_opacities():
    opacities = make_splats()
    densities = make_splats()
    densities.density = True
    view = camera()
    as_densities = ewa.render(opacities, *view, kernel="density").color
    assert not np.array_equal(as_densities, ewa.render(densities, *view).color)  # their logits are fitted
    assert np.abs(as_densities - ewa.render(opacities, *view).color).mean() < 0.02
    assert np.abs(ewa.render(densities, *view, kernel="peak").color - ewa.render(densities, *view).color).mean() < 0.02
    spheres = ewa.render(densities, *view, points=True).color
    assert np.array_equal(spheres, ewa.render(opacities, *view, points=True).color)


@pytest.mark.parametrize(
    "look, message",
    [
        ({"kernel": "box"}, "kernel: 'box' is not one of peak, antialias, density"),
        ({"integrator": "marsh"}, "integrator: 'marsh' is not one of splat, ray, fast-ray, march; did you mean march?"),
        ({"samples": 4}, 'samples= is an option of integrator="march"'),
        ({"integrator": "march", "samples": 0}, "samples is not from 1 to 4096"),
        ({"integrator": "march", "samples": 5000}, "samples is not from 1 to 4096"),
        ({"integrator": "march", "kernel": "antialias"}, 'integrator="march" and kernel="antialias" exclude each other'),
        ({"nearest": 3}, "nearest= is an option of points="),
        ({"points": True, "nearest": 0}, "nearest is not from 1 to 1000"),
        ({"points": True, "kernel": "density"}, 'points= and kernel="density" exclude each other'),
        ({"points": True, "kernel": "antialias"}, 'points= and kernel="antialias" exclude each other'),
        ({"points": True, "integrator": "ray"}, "points= and integrator= exclude each other"),
    ],
)
def test_looks_that_exclude_each_other(look, message, still_life):
    for call in (
        lambda: ewa.render(make_splats(1), *camera(), **look),
        lambda: ewa.Renderer(make_splats(1), **look),
        lambda: ewa.evaluate(make_splats(1), still_life, [0], **look),
    ):
        with pytest.raises(ewa.InputError, match=re.escape(message)):
            call()


def test_evaluations_have_the_looks_of_renders(still_life):
    splats = ewa.Splats.from_points(still_life.points, still_life.point_colors, sh_degree=0)
    frame = still_life.frames[0]
    view = still_life.viewmats[0], still_life.Ks[0], frame.width, frame.height
    image = still_life.images[0][..., :3]
    for look in ({"points": True}, {"integrator": "march", "samples": 3}, {"kernel": "density"}):
        color = np.clip(ewa.render(splats, *view, **look).color, 0, 1)
        psnr = -10 * np.log10(np.mean((color - image) ** 2))
        assert ewa.evaluate(splats, still_life, [0], **look).psnr == pytest.approx(psnr, abs=1e-3)


@pytest.mark.parametrize("background, expected", [("white", [1, 1, 1]), ("#ff0000", [1, 0, 0]), ([0.5, 0, 2], [0.5, 0, 2])])
def test_backgrounds(background, expected):
    empty = make_splats(2)[:0]
    assert np.allclose(ewa.render(empty, *camera(), background=background).color, expected)


def test_splats_that_are_not_finite_are_skipped():
    splats = make_splats(3)
    splats.means[:] = np.nan
    with pytest.warns(RuntimeWarning, match="3 of 3 splats skipped"):
        assert np.all(ewa.render(splats, *camera()).alpha == 0)


@pytest.mark.parametrize(
    "change, message",
    [
        ({"viewmats": np.eye(3)}, "viewmats has the shape (3, 3); expected (C, 4, 4) or (4, 4)"),
        ({"Ks": np.zeros((2, 3, 3))}, "Ks has the shape (2, 3, 3); expected (3, 3)"),
        ({"viewmats": np.stack([np.eye(4)] * 3), "Ks": np.zeros((2, 3, 3))}, "Ks has the shape (2, 3, 3); expected (3, 3, 3) or (3, 3)"),
        ({"viewmats": 2 * np.eye(4)}, "viewmats: its last row is not 0 0 0 1"),
        ({"viewmats": np.stack([np.eye(4), np.diag([2, 2, 2, 1])])}, "viewmats[1]: its first three rows and columns are no rotation; it maps the world to the camera"),
        ({"viewmats": np.full((4, 4), np.nan)}, "viewmats is not finite"),
        ({"Ks": np.eye(3) * 2}, "Ks is not [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]"),
        ({"Ks": np.diag([-1, 1, 1])}, "Ks: a focal length is not positive"),
        ({"width": 0}, "width and height are not positive"),
        ({"background": [0, 0]}, "background has the shape (2,); expected (3,)"),
        ({"background": "reddish"}, "background: "),
        ({"mode": "colr"}, "mode: "),
        ({"sh_degree": 4}, "sh_degree is not 0, 1, 2 or 3"),
    ],
)
def test_wrong_arguments_name_themselves(change, message):
    viewmat, k, width, height = camera()
    arguments = {"viewmats": viewmat, "Ks": k, "width": width, "height": height, **change}
    end = "" if message.endswith(" ") else "$"
    with pytest.raises(ValueError, match="^" + re.escape(message) + end):
        ewa.render(make_splats(), **arguments)


def test_wrong_types():
    with pytest.raises(TypeError):
        ewa.render(make_splats().means, *camera())
    with pytest.raises(TypeError, match="viewmats holds no real numbers"):
        ewa.render(make_splats(), "eye", *camera()[1:])


def test_pictures_too_large_are_refused():
    with pytest.raises((ewa.InputError, ewa.DeviceError)):
        ewa.render(make_splats(), *camera()[:2], 1 << 30, 1)


def test_devices():
    devices = ewa.devices()
    assert devices and [device.index for device in devices] == list(range(len(devices)))
    current = ewa.current_device()
    assert current.name in [device.name for device in devices]
    ewa.set_device(current.index)
    ewa.set_device(current.name[:5].upper())
    with pytest.raises(ewa.DeviceError, match="no usable Vulkan device matches 'no such device'"):
        ewa.set_device("no such device")
    assert ewa.current_device().name == current.name  # the one before stays
    with pytest.raises(TypeError):
        ewa.set_device(None)
    ewa.set_device("")


def test_a_device_that_cannot_be_had_is_not_kept():
    code = "import ewa\ntry: ewa.set_device('no such device')\nexcept ewa.DeviceError: print(ewa.current_device().index >= 0)"
    assert run_python(code) == "True"


def test_the_environment_names_the_device():
    code = "import ewa\ntry: ewa.current_device()\nexcept ewa.DeviceError as e: print(e)"
    assert "matches 'no such device'" in run_python(code, EWA_DEVICE="no such device")


RENDER = """
import ewa, numpy as np
splats = ewa.load("tests/fuzz/seeds/read_ply/little.ply")
ewa.save({path!r}, splats)
assert len(ewa.load({path!r})) == len(splats)
for call in (ewa.devices, lambda: ewa.render(splats, np.eye(4), np.eye(3), 8, 8), lambda: ewa.set_device(0)):
    try: call()
    except ewa.DeviceError as error: print(error)
"""


def test_without_a_driver_files_work_and_the_error_says_what_to_install(tmp_path):
    lines = run_python(RENDER.format(path=str(tmp_path / "a.ply")), VK_DRIVER_FILES="/dev/null", VK_ICD_FILENAMES="/dev/null")
    assert len(lines.splitlines()) == 3 and lines.count("mesa-vulkan-drivers") == 3


def test_without_a_loader_files_work_and_the_error_says_what_to_install(tmp_path):
    (tmp_path / "libvulkan.so.1").write_text("no library")
    lines = run_python(RENDER.format(path=str(tmp_path / "a.ply")), LD_LIBRARY_PATH=str(tmp_path))
    assert lines.count("there is no Vulkan loader") == lines.count("apt install mesa-vulkan-drivers") == 3
