# SPDX-License-Identifier: Apache-2.0
"""rasterization against plain torch: gsplat's reference for footprints, every pixel blended."""

import gc
import os
import pickle
import threading
import warnings
from pathlib import Path

import pytest

torch = pytest.importorskip("torch")

import ewa
from ewa import gsplat as ours
from gsplat_scenes import HEIGHT, WIDTH, Scene, assert_close, blend, gradients, reference

MODES = {"RGB": 3, "D": 1, "ED": 1, "RGB+D": 4, "RGB+ED": 4}
META = {
    "batch_ids",
    "camera_ids",
    "gaussian_ids",
    "radii",
    "means2d",
    "depths",
    "conics",
    "opacities",
    "tile_width",
    "tile_height",
    "tiles_per_gauss",
    "isect_ids",
    "flatten_ids",
    "isect_offsets",
    "width",
    "height",
    "tile_size",
    "n_batches",
    "n_cameras",
}


def expected_render(s, mode, antialiased, colors, backgrounds=None):
    """Images and alphas of a scene without batch dimensions; colors are [C, N, D]."""
    covars = reference._quat_scale_to_covar_preci(s.quats, s.scales)[0]
    radii, means2d, depths, conics, factors = reference._fully_fused_projection(
        s.means, covars, s.viewmats, s.Ks, WIDTH, HEIGHT, calc_compensations=antialiased
    )
    images = []
    for i in range(len(s.viewmats)):
        opacities = s.opacities * factors[i] if antialiased else s.opacities
        features = torch.cat((colors[i], depths[i][:, None]), -1)
        background = None
        if backgrounds is not None:
            background = torch.cat((backgrounds[i], torch.zeros(1)))
        images.append(
            blend(means2d[i], conics[i], depths[i], opacities, features, radii[i], background)
        )
    image, alpha = (torch.stack(t) for t in zip(*images))
    depth = image[..., -1:]
    if "ED" in mode:
        depth = depth / alpha.clamp(min=1e-10)
    parts = ([image[..., :-1]] if "RGB" in mode else []) + ([depth] if "D" in mode else [])
    return torch.cat(parts, -1), alpha


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("antialiased", [False, True])
@pytest.mark.parametrize("mode", list(MODES))
def test_modes(mode, antialiased, packed):
    s = Scene(cameras=2)
    backgrounds = torch.rand(2, 3, requires_grad=True)
    image, alpha, meta = ours.rasterization(
        **s.arguments(
            render_mode=mode,
            packed=packed,
            backgrounds=backgrounds,
            rasterize_mode="antialiased" if antialiased else "classic",
        )
    )
    assert image.shape == (2, HEIGHT, WIDTH, MODES[mode])
    assert alpha.shape == (2, HEIGHT, WIDTH, 1)
    colors = s.colors.expand(2, -1, -1)
    expected = expected_render(s, mode, antialiased, colors, backgrounds)
    assert_close(image, expected[0], "image")
    assert_close(alpha, expected[1], "alpha")
    inputs = s.tensors() + [backgrounds]
    found = gradients((image, alpha), inputs), gradients(expected, inputs)
    for name, a, e in zip(s.trained + ("backgrounds",), *found):
        if "RGB" not in mode and name in ("colors", "backgrounds"):
            assert a is None or not a.any()
        else:
            assert_close(a, e, name, 5e-3)


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("mode", list(MODES))
def test_meta(mode, packed):
    s = Scene(cameras=2, batch=(2,))
    _, _, meta = ours.rasterization(**s.arguments(render_mode=mode, packed=packed))
    assert isinstance(meta, dict)
    dense = (2, 2, 60)
    count = meta["means2d"].shape[0]
    lead = (count,) if packed else dense
    shapes = dict(radii=(2,), means2d=(2,), depths=(), conics=(3,), opacities=())
    for name, tail in shapes.items():
        assert meta[name].shape == lead + tail, name
        assert meta[name].dtype == (torch.int32 if name == "radii" else torch.float32)
    for name in ("batch_ids", "camera_ids", "gaussian_ids"):
        if packed:
            assert meta[name].shape == lead and meta[name].dtype == torch.int64
        else:
            assert meta[name] is None
    assert not dict.__contains__(meta, "isect_ids") and "isect_ids" in meta
    assert set(meta) == META and len(meta) == len(META) and set(dict(meta)) == META
    assert set({**meta}) == META and meta.get("nothing") is None
    with pytest.raises(KeyError):
        meta["nothing"]
    assert meta["tiles_per_gauss"].shape == lead
    assert meta["tiles_per_gauss"].dtype == torch.int32
    assert meta["tiles_per_gauss"].sum() == len(meta["isect_ids"]) == len(meta["flatten_ids"])
    assert meta["isect_ids"].dtype == torch.int64
    assert meta["flatten_ids"].dtype == torch.int32
    assert meta["isect_offsets"].shape == (2, 2, 3, 4)
    assert meta["isect_offsets"].dtype == torch.int32
    sizes = ("width", "height", "tile_size", "tile_width", "tile_height", "n_batches", "n_cameras")
    assert [meta[k] for k in sizes] == [WIDTH, HEIGHT, 16, 4, 3, 2, 2]


def test_meta_travels_as_a_plain_dict():
    s = Scene()
    with torch.no_grad():
        _, _, meta = ours.rasterization(**s.arguments())
    assert set(pickle.loads(pickle.dumps(meta))) == META
    assert type(meta.copy()) is dict


def test_meta_is_changed_as_a_dict():
    def make():
        with torch.no_grad():
            return ours.rasterization(**Scene().arguments())[2]

    ids = make()["isect_ids"]
    meta = make()
    meta["isect_ids"] = 1
    assert len(meta["flatten_ids"]) == len(ids) and meta["isect_ids"] == 1
    meta = make()
    assert torch.equal(meta.pop("isect_ids"), ids)
    assert "isect_ids" not in meta and set(meta) == META - {"isect_ids"}
    assert meta.pop("isect_ids", 3) == 3 and meta.get("isect_ids") is None
    for read in (meta.pop, meta.__getitem__, meta.__delitem__):
        with pytest.raises(KeyError):
            read("isect_ids")
    meta = make()
    assert torch.equal(meta.setdefault("isect_ids"), ids) and len(meta["flatten_ids"]) == len(ids)
    assert meta.setdefault("mine", 4) == meta["mine"] == meta.pop("mine") == 4
    meta = make()
    del meta["isect_offsets"]
    assert set(meta) == META - {"isect_offsets"}


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("camera_model", ["pinhole", "ortho", "fisheye"])
def test_autocast_changes_nothing(camera_model, packed):
    s = Scene(cameras=2)
    coeffs = torch.rand(60, 4, 3, requires_grad=True)
    call = s.arguments(camera_model=camera_model, packed=packed, colors=coeffs, sh_degree=1)
    inputs = [s.means, s.quats, s.scales, s.opacities, s.viewmats, coeffs]
    plain = ours.rasterization(**call)[:2]
    with torch.autocast("cpu", dtype=torch.bfloat16):
        cast = ours.rasterization(**call)[:2]
    found = torch.autograd.grad([t.sum() for t in cast], inputs)
    expected = torch.autograd.grad([t.sum() for t in plain], inputs)
    for a, e in zip((*cast, *found), (*plain, *expected)):
        assert a.dtype == torch.float32 and torch.equal(a, e)


@pytest.mark.parametrize("packed,sparse", [(False, False), (True, False), (True, True)])
def test_second_derivatives_are_refused(packed, sparse):
    s = Scene()
    coeffs = torch.rand(60, 4, 3, requires_grad=True)
    call = s.arguments(packed=packed, colors=coeffs, sh_degree=1, sparse_grad=sparse)
    loss = ours.rasterization(**call)[0].sum()  # its gradient is a constant
    plain = torch.autograd.grad(loss, [s.scales, s.opacities, coeffs], retain_graph=True)
    for t, expected in zip((s.scales, s.opacities, coeffs), plain):
        found = torch.autograd.grad(loss, t, create_graph=True)[0]
        if found.is_sparse:
            found, expected = found.to_dense(), expected.to_dense()
        assert torch.equal(found, expected)
        with pytest.raises(NotImplementedError, match="first derivatives only"):
            torch.autograd.grad(found.sum(), s.means)
    with pytest.raises(NotImplementedError, match="first derivatives only"):
        torch.autograd.functional.jvp(
            lambda m: ours.rasterization(**s.arguments(means=m, packed=packed))[0],
            s.means.detach(),
            torch.ones(60, 3),
        )


@pytest.mark.parametrize("packed", [False, True])
def test_the_projected_means_are_between_two_nodes(packed):
    s = Scene(cameras=2)
    image, _, meta = ours.rasterization(**s.arguments(packed=packed, absgrad=True))
    before = meta["means2d"].absgrad
    assert before.shape == meta["means2d"].shape and not before.any() and not before.requires_grad
    meta["means2d"].retain_grad()
    (image * torch.linspace(-1, 1, WIDTH)[:, None]).sum().backward()
    grad, absolute = meta["means2d"].grad, meta["means2d"].absgrad
    assert grad.shape == absolute.shape == meta["means2d"].shape and absolute is before
    assert grad.abs().max() > 0
    assert (absolute >= grad.abs() * 0.999 - 1e-6).all()
    again = ours.rasterization(**s.arguments(packed=packed))[2]["means2d"]
    assert not hasattr(again, "absgrad")


@pytest.mark.parametrize("channels", [3, 7])
def test_absolute_gradients_are_sums_over_pixels(channels):
    """Of the gradient by all channels: |a + b| and not |a| + |b|."""
    s = Scene(splats=12, channels=channels)
    image, alpha, meta = ours.rasterization(**s.arguments(absgrad=True, packed=False))
    gradients((image, alpha), s.tensors())
    values = [meta[k][0].detach() for k in ("conics", "depths", "opacities")]
    pixels = meta["means2d"][0].detach().expand(HEIGHT * WIDTH, -1, -1).clone().requires_grad_()
    expected = blend(pixels, *values, s.colors.detach(), meta["radii"][0])
    expected = gradients([t[None] for t in expected], [pixels])[0].abs().sum(0)
    assert_close(meta["means2d"].absgrad[0], expected)


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("per_view", [False, True])
@pytest.mark.parametrize("degree", [None, 2])
@pytest.mark.parametrize("batch", [(2,), (1, 2)])
def test_batches_are_scenes_one_by_one(batch, degree, per_view, packed):
    s = Scene(cameras=2, batch=batch)
    tail = (3,) if degree is None else (9, 3)
    colors = torch.rand(batch + ((2,) if per_view else ()) + (60,) + tail, requires_grad=True)
    backgrounds = torch.rand(batch + (2, 3))
    call = dict(sh_degree=degree, packed=packed, render_mode="RGB+ED")
    image, alpha, _ = ours.rasterization(
        **s.arguments(colors=colors, backgrounds=backgrounds, **call)
    )
    assert image.shape == batch + (2, HEIGHT, WIDTH, 4)
    given = [t.reshape((2,) + t.shape[len(batch) :]) for t in s.tensors()[:4]]
    ones = []
    for i in range(2):
        index = (0,) * (len(batch) - 1) + (i,)
        one, covered, _ = ours.rasterization(
            *[t[i] for t in given],
            colors[index],
            s.viewmats[index],
            s.Ks[index],
            WIDTH,
            HEIGHT,
            backgrounds=backgrounds[index],
            **call,
        )
        ones.append((one, covered))
    expected = [torch.stack(t).reshape(batch + t[0].shape) for t in zip(*ones)]
    torch.testing.assert_close(image, expected[0])
    torch.testing.assert_close(alpha, expected[1])
    inputs = s.tensors()[:4] + [s.viewmats, colors]
    for a, e in zip(gradients((image,), inputs), gradients(expected[:1], inputs)):
        torch.testing.assert_close(a, e, rtol=1e-3, atol=1e-4)


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("channels, cameras", [(1, 2), (3, 1), (3, 2), (5, 2)])
def test_harmonics(channels, cameras, packed):
    s = Scene(cameras=cameras)
    coeffs = (torch.rand(60, 16, channels) - 0.3).requires_grad_()
    image, alpha, _ = ours.rasterization(**s.arguments(colors=coeffs, sh_degree=3, packed=packed))
    centers = torch.inverse(s.viewmats)[..., :3, 3]
    dirs = s.means - centers[:, None]
    bases = torch.stack(
        [
            reference._spherical_harmonics(3, dirs, c.expand(cameras, 60, 16, 3))[..., 0]
            for c in coeffs[..., None].unbind(2)
        ],
        -1,
    )
    expected = expected_render(s, "RGB", False, (bases + 0.5).clamp(min=0))
    assert_close(image, expected[0])
    inputs = [s.means, s.quats, s.opacities, coeffs]
    for a, e in zip(gradients((image, alpha), inputs), gradients(expected, inputs)):
        assert_close(a, e, tolerance=5e-3)


def test_colors_per_camera_and_many_channels():
    s = Scene(cameras=2)
    colors = torch.rand(2, 60, 37, requires_grad=True)
    image, _, _ = ours.rasterization(**s.arguments(colors=colors, packed=False))
    expected = expected_render(s, "RGB", False, colors)
    assert_close(image, expected[0])
    assert_close(gradients((image,), [colors])[0], gradients(expected[:1], [colors])[0])


@pytest.mark.parametrize("mode", ["RGB", "RGB+ED", "D"])
def test_extra_signals(mode):
    s = Scene(cameras=2)
    signals = torch.rand(60, 5)
    image, alpha, meta = ours.rasterization(**s.arguments(render_mode=mode, extra_signals=signals))
    plain = ours.rasterization(**s.arguments(render_mode=mode))
    torch.testing.assert_close(image, plain[0])
    own = ours.rasterization(**s.arguments(colors=signals))[0]
    torch.testing.assert_close(meta["render_extra_signals"], own)


@pytest.mark.parametrize("packed", [False, True])
def test_covariances_replace_quaternions_and_scales(packed):
    s = Scene()
    covars = ours.quat_scale_to_covar_preci(s.quats, s.scales)[0]
    image, _, _ = ours.rasterization(
        **s.arguments(quats=None, scales=None, covars=covars, packed=packed)
    )
    expected = ours.rasterization(**s.arguments(packed=packed))[0]
    torch.testing.assert_close(image, expected, rtol=1e-3, atol=1e-3)
    for a, e in zip(*(gradients((o,), (s.quats, s.scales)) for o in (image, expected))):
        assert_close(a, e)


@pytest.mark.parametrize("camera_model", ["ortho", "fisheye"])
def test_other_cameras(camera_model):
    s = Scene(cameras=2)
    if camera_model == "ortho":
        s.Ks[:, :2, :2] /= 4
    image, alpha, meta = ours.rasterization(**s.arguments(camera_model=camera_model, packed=False))
    covars = reference._quat_scale_to_covar_preci(s.quats, s.scales)[0]
    radii, means2d, depths, conics, _ = reference._fully_fused_projection(
        s.means, covars, s.viewmats, s.Ks, WIDTH, HEIGHT, camera_model=camera_model
    )
    expected = [
        blend(means2d[i], conics[i], depths[i], s.opacities, s.colors, radii[i]) for i in (0, 1)
    ]
    expected = [torch.stack(t) for t in zip(*expected)]
    assert expected[1].mean() > 0.05
    assert_close(image, expected[0])
    for a, e in zip(gradients((image, alpha), s.tensors()), gradients(expected, s.tensors())):
        assert_close(a, e, tolerance=5e-3)


def _opencv(point, K, radial, tangential, prism):
    """The pixel of a point in camera coordinates (OpenCV, calib3d, "Detailed Description")."""
    x, y = point[0] / point[2], point[1] / point[2]
    w = x * x + y * y
    bent = (1 + w * (radial[0] + w * (radial[1] + w * radial[2]))) / (
        1 + w * (radial[3] + w * (radial[4] + w * radial[5]))
    )
    p1, p2 = tangential
    u = x * bent + 2 * p1 * x * y + p2 * (w + 2 * x * x) + w * (prism[0] + w * prism[1])
    v = y * bent + p1 * (w + 2 * y * y) + 2 * p2 * x * y + w * (prism[2] + w * prism[3])
    return torch.stack((K[0, 0] * u + K[0, 2], K[1, 1] * v + K[1, 2]))


def _bent_fisheye(point, K, radial):
    r = torch.hypot(point[0], point[1])
    angle = torch.atan2(r, point[2])
    w = angle * angle
    bent = angle * (1 + w * (radial[0] + w * (radial[1] + w * (radial[2] + w * radial[3])))) / r
    return torch.stack((K[0, 0] * bent * point[0] + K[0, 2], K[1, 1] * bent * point[1] + K[1, 2]))


_LENSES = {
    "pinhole": (
        _opencv,
        dict(
            radial_coeffs=[-0.12, 0.05, -0.01, 0.02, -0.004, 0.003],
            tangential_coeffs=[0.012, -0.017],
            thin_prism_coeffs=[0.011, -0.004, 0.007, 0.003],
        ),
    ),
    "fisheye": (_bent_fisheye, dict(radial_coeffs=[0.05, -0.02, 0.006, -0.001])),
}


@pytest.mark.parametrize("camera_model", _LENSES)
def test_coefficients_bend_the_image(camera_model):
    s = Scene(cameras=2, splats=30)
    pixel, coefficients = _LENSES[camera_model]
    given = {k: torch.tensor([v, [0.5 * x for x in v]]) for k, v in coefficients.items()}
    call = dict(camera_model=camera_model, packed=False, **given)
    _, _, meta = ours.rasterization(**s.arguments(**call))
    seen = (meta["radii"] > 0).all(-1).nonzero()
    assert len(seen) > 20
    covars = reference._quat_scale_to_covar_preci(s.quats, s.scales)[0]
    means2d, conics = [], []
    for c, i in seen.tolist():
        terms = [v[c] for v in given.values()]
        R, t = s.viewmats[c, :3, :3], s.viewmats[c, :3, 3]

        def to_pixel(point):
            return pixel(point, s.Ks[c], *terms)

        point = R @ s.means[i] + t
        means2d.append(to_pixel(point))
        J = torch.autograd.functional.jacobian(to_pixel, point, create_graph=True) @ R
        inverse = torch.linalg.inv(J @ covars[i] @ J.T + 0.3 * torch.eye(2))
        conics.append(torch.stack((inverse[0, 0], inverse[0, 1], inverse[1, 1])))
    expected = torch.stack(means2d), torch.stack(conics)
    found = tuple(meta[name][seen[:, 0], seen[:, 1]] for name in ("means2d", "conics"))
    # J is taken within the image and a margin, and here everywhere.
    inside = (expected[0] > 0).all(-1) & (expected[0] < torch.tensor([WIDTH, HEIGHT])).all(-1)
    assert inside.sum() > 10
    for a, e in zip(found, expected):
        torch.testing.assert_close(a[inside], e[inside], rtol=2e-3, atol=2e-3)
    for k, inputs in enumerate(((s.means, s.viewmats), (s.means, s.viewmats, s.quats, s.scales))):
        by = [gradients((o[k][inside],), inputs) for o in (found, expected)]
        for a, e in zip(*by):
            assert_close(a, e, tolerance=5e-3)


@pytest.mark.parametrize(
    "call,said",
    [
        (dict(radial_coeffs=torch.zeros(1, 4)), r"radial_coeffs has shape \(1, 4\)"),
        (dict(radial_coeffs=torch.zeros(1, 6), camera_model="fisheye"), "radial_coeffs has shape"),
        (dict(tangential_coeffs=torch.zeros(1, 2), camera_model="fisheye"), "are no terms of"),
        (dict(radial_coeffs=torch.zeros(1, 4), camera_model="ortho"), "are no terms of"),
        (dict(thin_prism_coeffs=torch.full((1, 4), float("nan"))), "distortions are not finite"),
    ],
)
def test_wrong_coefficients(call, said):
    with pytest.raises(ValueError, match=said):
        ours.rasterization(**Scene().arguments(**call))


def test_sparse_gradients():
    s = Scene(cameras=2)
    image = ours.rasterization(**s.arguments(packed=True, sparse_grad=True))[0]
    image.sum().backward()
    assert s.means.grad.is_sparse and s.quats.grad.is_sparse and s.scales.grad.is_sparse
    found = [t.grad.to_dense() for t in (s.means, s.quats, s.scales)]
    dense = ours.rasterization(**s.arguments())[0]
    expected = torch.autograd.grad(dense.sum(), (s.means, s.quats, s.scales))
    for a, e in zip(found, expected):
        torch.testing.assert_close(a, e)
    optimizer = torch.optim.SparseAdam([s.means], lr=0.01)
    before = s.means.detach().clone()
    optimizer.step()
    assert (s.means != before).any()


def test_interleaved_graphs_and_a_second_backward():
    first, second = Scene(seed=1), Scene(seed=2, splats=40)
    lone = [ours.rasterization(**s.arguments())[0] for s in (first, second)]
    expected = [gradients((i,), s.tensors()) for i, s in zip(lone, (first, second))]
    a = ours.rasterization(**first.arguments())[0]
    b = ours.rasterization(**second.arguments())[0]
    for image, s, values in ((b, second, expected[1]), (a, first, expected[0])) * 2:
        for found, value in zip(gradients((image,), s.tensors()), values):
            assert torch.equal(found, value)
    a.sum().backward()
    with pytest.raises(RuntimeError, match="second time"):
        a.sum().backward()


@pytest.mark.parametrize("packed", [False, True])
def test_no_splats(packed):
    s = Scene(splats=0, cameras=2)
    backgrounds = torch.rand(2, 3, requires_grad=True)
    image, alpha, meta = ours.rasterization(**s.arguments(packed=packed, backgrounds=backgrounds))
    assert (image == backgrounds[:, None, None]).all() and not alpha.any()
    (image.sum() + alpha.sum()).backward()
    assert s.means.grad.shape == (0, 3)
    torch.testing.assert_close(backgrounds.grad, torch.full((2, 3), float(WIDTH * HEIGHT)))
    assert len(meta["isect_ids"]) == 0


@pytest.mark.parametrize("camera_model", ["pinhole", "ortho", "fisheye"])
@pytest.mark.parametrize("packed", [False, True])
def test_everything_behind_the_camera(packed, camera_model):
    s = Scene()
    with torch.no_grad():
        s.means[:, 2] -= 100
    image, alpha, meta = ours.rasterization(
        **s.arguments(packed=packed, camera_model=camera_model, render_mode="RGB+ED")
    )
    assert not image.any() and not alpha.any() and not meta["radii"].any()
    meta["means2d"].retain_grad()
    (image.sum() + alpha.sum()).backward()
    for t in s.tensors():
        assert t.grad is None or not t.grad.any()
    assert not meta["means2d"].grad.any()


@pytest.mark.parametrize("packed", [False, True])
def test_no_cameras(packed):
    s = Scene(cameras=2)
    none = {"viewmats": s.viewmats[:0], "Ks": s.Ks[:0]}
    image, alpha, meta = ours.rasterization(**s.arguments(packed=packed, absgrad=True, **none))
    assert image.shape[0] == alpha.shape[0] == 0 and image.shape[1:3] == alpha.shape[1:3]
    (image.sum() + alpha.sum()).backward()
    assert s.means.grad.shape == s.means.shape and not s.means.grad.any()
    names = ("means", "quats", "scales", "opacities", "colors", "viewmats", "Ks")
    batch = {name: getattr(s, name).detach()[None][:0] for name in names}
    with pytest.raises(ValueError, match="a batch without scenes"):
        ours.rasterization(**s.arguments(packed=packed, **batch))


def test_values_that_are_not_finite_are_skipped_with_a_warning():
    s = Scene()
    with torch.no_grad():
        s.colors[2] = float("nan")
        s.opacities[3] = float("inf")
    arguments = s.arguments(opacities=s.opacities.detach())
    with pytest.warns(RuntimeWarning, match="2 of .* splats skipped: a mean, conic, opacity"):
        image = ours.rasterization(**arguments)[0]
    assert torch.isfinite(image).all()


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("channel", [0, 4])
def test_a_splat_without_a_colour_hides_nothing(packed, channel):
    s = Scene(channels=5)
    with torch.no_grad():
        s.colors[2, channel] = float("nan")
    with pytest.warns(RuntimeWarning, match="1 of .* splats skipped"):
        image, alpha, _ = ours.rasterization(**s.arguments(packed=packed))
    without = torch.where(torch.arange(60) == 2, 0.0, s.opacities)
    colors = torch.nan_to_num(s.colors)
    expected = ours.rasterization(**s.arguments(packed=packed, opacities=without, colors=colors))
    torch.testing.assert_close((image, alpha), expected[:2])
    assert all(torch.isfinite(g).all() for g in gradients((image, alpha), s.tensors()[:4]))


def test_view_matrices_need_not_end_in_exactly_0_0_0_1():
    s = Scene()
    noisy = s.viewmats.detach().clone()
    noisy[..., 3, :] += torch.tensor([3e-6, -3e-6, 3e-6, 3e-6])
    plain = ours.rasterization(**s.arguments())[0]
    assert torch.equal(ours.rasterization(**s.arguments(viewmats=noisy))[0], plain)


def test_strided_and_expanded_tensors():
    s = Scene(cameras=3)
    plain = ours.rasterization(**s.arguments(viewmats=s.viewmats[:1].expand(3, 4, 4)))[0]
    odd = {}
    for name in ("means", "quats", "scales", "colors"):
        value = getattr(s, name).detach()
        odd[name] = torch.stack((value, value + 9), -1)[..., 0]
        assert not odd[name].is_contiguous()
        odd[name].requires_grad_()
    odd["opacities"] = s.opacities.detach()[:, None].expand(-1, 2)[:, 1]
    odd["viewmats"] = s.viewmats[0].expand(3, 4, 4)
    odd["Ks"] = s.Ks[0].t().contiguous().t().expand(3, 3, 3)
    image = ours.rasterization(**s.arguments(**odd))[0]
    assert torch.equal(image, plain)
    found = torch.autograd.grad(image.sum(), [odd["means"], odd["colors"]])
    expected = torch.autograd.grad(plain.sum(), [s.means, s.colors])
    for a, e in zip(found, expected):
        assert torch.equal(a, e)
    # One opacity and one colour for all splats.
    same = ours.rasterization(
        **s.arguments(opacities=torch.tensor(0.5).expand(60), colors=torch.ones(1, 3).expand(60, 3))
    )
    torch.testing.assert_close(same[0], same[1].expand(-1, -1, -1, 3))


def test_float64_is_cast_with_one_warning(monkeypatch):
    monkeypatch.setattr(ours._arguments, "_warned_of_double", False)
    s = Scene()
    means = s.means.detach().double().requires_grad_()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        image = ours.rasterization(**s.arguments(means=means, Ks=s.Ks.double()))[0]
    assert ["float64" in str(w.message) for w in caught] == [True]
    assert image.dtype == torch.float32
    image.sum().backward()
    assert means.grad.dtype == torch.float64 and means.grad.any()


def test_four_threads():
    scenes = [Scene(seed=i, splats=30 + i) for i in range(4)]
    expected = []
    for s in scenes:
        image = ours.rasterization(**s.arguments())[0]
        expected.append((image.detach(), gradients((image,), s.tensors())))
    wrong = []

    def work(s, values):
        for _ in range(5):
            image = ours.rasterization(**s.arguments())[0]
            found = gradients((image,), s.tensors())
            same = all(torch.equal(a, e) for a, e in zip(found, values[1]))
            if not same or not torch.equal(image, values[0]):
                wrong.append(s)

    threads = [threading.Thread(target=work, args=a) for a in zip(scenes, expected)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    assert not wrong


def test_without_gradients_nothing_is_kept():
    s = Scene()
    with torch.no_grad():
        image, alpha, meta = ours.rasterization(**s.arguments())
    assert not image.requires_grad and not meta["means2d"].requires_grad
    kept = ours.rasterization(**s.arguments())[0]
    assert torch.equal(image, kept)


def nodes():
    """The nodes of blended images that are alive. They hold memory of the device."""
    return sum(type(o).__name__ == "BlendBackward" for o in gc.get_objects())


@pytest.mark.parametrize("backward", [False, True])
def test_a_dropped_graph_is_freed_at_once(backward):
    s = Scene()
    gc.collect()
    gc.disable()  # A reference cycle would keep the device's memory until a collection.
    try:
        before = nodes()
        image, alpha, meta = ours.rasterization(**s.arguments(absgrad=True))
        assert nodes() == before + 1
        if backward:
            image.sum().backward()
        del image, alpha, meta
        assert nodes() == before
    finally:
        gc.enable()


def test_the_tile_size_changes_no_image():
    s = Scene()
    sizes = [ours.rasterization(**s.arguments(tile_size=t)) for t in (None, 8, 32)]
    for image, _, meta in sizes[1:]:
        torch.testing.assert_close(image, sizes[0][0])
    assert [m["isect_offsets"].shape[-2:] for _, _, m in sizes] == [(3, 4), (6, 8), (2, 2)]


def resident_bytes():
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads Linux's statistics")
def test_many_calls_need_no_more_memory():
    s = Scene(splats=100)

    def call():
        image = ours.rasterization(**s.arguments())[0]
        torch.autograd.grad(image.sum(), s.tensors())

    for _ in range(50):
        call()
    before = resident_bytes()
    for _ in range(1000):
        call()
    assert resident_bytes() - before < 32 << 20


def test_a_forked_process_is_told_that_it_cannot_render():
    s = Scene()
    ours.rasterization(**s.arguments())
    child = os.fork()
    if child == 0:
        try:
            ours.rasterization(**s.arguments())
            os._exit(1)
        except ewa.DeviceError:
            os._exit(7)
        finally:
            os._exit(2)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7


def warnings_of(calls):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for _ in range(3):
            calls()
    return [(str(warning.message), warning.filename) for warning in caught]


def test_logarithms_and_logits_get_one_warning_each():
    s = Scene()
    logits = torch.linspace(-3, 3, 60)

    def right():
        ours.rasterization(**s.arguments(scales=s.scales.detach() * 0, opacities=logits.sigmoid()))
        ours.rasterization(**s.arguments(opacities=(logits > 0).float()))

    def raw():
        ours.rasterization(**s.arguments(scales=s.scales.detach().log(), opacities=logits))

    def low():
        ours.rasterization(**s.arguments(opacities=-logits.sigmoid()))

    def one():
        scales = s.scales.detach().clone()
        scales[7, 1] = -0.1
        ours.rasterization(**s.arguments(scales=scales))

    negative = "scales are negative: pass torch.exp(scales)"
    assert warnings_of(right) == []
    assert warnings_of(raw) == [
        (negative, __file__),
        ("opacities above 1: pass torch.sigmoid(opacities)", __file__),
    ]
    assert warnings_of(raw) == []
    assert warnings_of(low) == [("opacities below 0: pass torch.sigmoid(opacities)", __file__)]
    assert warnings_of(one) == [(negative, __file__)]


def test_a_camera_model_that_nobody_has_is_no_matter_of_cuda():
    with pytest.raises(ValueError, match="'equirectangular' is none of .*pinhole, ortho and fisheye"):
        ours.rasterization(**Scene().arguments(camera_model="equirectangular"))
