# SPDX-License-Identifier: Apache-2.0
"""The lower functions of ewa.gsplat against the torch reference of gsplat's own package."""

import itertools
import math

import pytest

torch = pytest.importorskip("torch")

from ewa import gsplat as ours
from gsplat_scenes import HEIGHT, WIDTH, Scene, assert_close, blend, gradients, reference

BATCHES = [(), (2,), (1, 2)]


@pytest.mark.parametrize("batch", BATCHES)
@pytest.mark.parametrize("triu", [False, True])
def test_covariances_and_precisions(triu, batch):
    s = Scene(batch=batch)
    actual = ours.quat_scale_to_covar_preci(s.quats, s.scales, triu=triu)
    expected = reference._quat_scale_to_covar_preci(s.quats, s.scales, triu=triu)
    for a, e in zip(actual, expected):
        torch.testing.assert_close(a, e, rtol=1e-4, atol=1e-4)
    for a, e in zip(*(gradients(o, (s.quats, s.scales)) for o in (actual, expected))):
        assert_close(a, e)
    assert ours.quat_scale_to_covar_preci(s.quats, s.scales, False, False) == (None, None)


def test_world_to_cam():
    s = Scene(cameras=3, batch=(2,))
    covars = ours.quat_scale_to_covar_preci(s.quats, s.scales)[0]
    for a, e in zip(
        ours.world_to_cam(s.means, covars, s.viewmats),
        reference._world_to_cam(s.means, covars, s.viewmats),
    ):
        torch.testing.assert_close(a, e, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("camera_model", ["pinhole", "ortho", "fisheye"])
@pytest.mark.parametrize("batch", BATCHES)
def test_proj(camera_model, batch):
    s = Scene(cameras=2, batch=batch)
    covars = ours.quat_scale_to_covar_preci(s.quats, s.scales)[0]
    means, covars = (
        t.detach().requires_grad_() for t in reference._world_to_cam(s.means, covars, s.viewmats)
    )
    call = {"pinhole": "_persp_proj", "ortho": "_ortho_proj", "fisheye": "_fisheye_proj"}
    actual = ours.proj(means, covars, s.Ks, WIDTH, HEIGHT, camera_model)
    expected = getattr(reference, call[camera_model])(means, covars, s.Ks, WIDTH, HEIGHT)
    for a, e in zip(actual, expected):
        torch.testing.assert_close(a, e, rtol=1e-4, atol=1e-3)
    for a, e in zip(*(gradients(o, (means, covars)) for o in (actual, expected))):
        assert_close(a, e)


@pytest.mark.parametrize("camera_model", ["pinhole", "ortho", "fisheye"])
@pytest.mark.parametrize("compensations", [False, True])
@pytest.mark.parametrize("fused", [False, True])
@pytest.mark.parametrize("batch", BATCHES)
def test_projection(camera_model, compensations, fused, batch):
    s = Scene(cameras=2, batch=batch)
    full = reference._quat_scale_to_covar_preci(s.quats, s.scales)[0]
    upper = None if fused else ours.quat_scale_to_covar_preci(s.quats, s.scales, triu=True)[0]
    shapes = (None, s.quats, s.scales) if fused else (upper, None, None)
    actual = ours.fully_fused_projection(
        s.means,
        *shapes,
        s.viewmats,
        s.Ks,
        WIDTH,
        HEIGHT,
        calc_compensations=compensations,
        camera_model=camera_model,
    )
    expected = reference._fully_fused_projection(
        s.means,
        full,
        s.viewmats,
        s.Ks,
        WIDTH,
        HEIGHT,
        calc_compensations=compensations,
        camera_model=camera_model,
    )
    seen = (actual[0] > 0).all(-1) & (expected[0] > 0).all(-1)
    assert 10 < seen.sum() < seen.numel()
    assert actual[0].dtype == torch.int32 and not actual[0].requires_grad
    assert (actual[0] - expected[0]).abs().max() <= 1
    pairs = [(a[seen], e[seen]) for a, e in zip(actual[1:], expected[1:]) if e is not None]
    assert len(pairs) == 3 + compensations and len(actual) == 5
    for a, e in pairs:
        torch.testing.assert_close(a, e, rtol=1e-3, atol=1e-3)
    inputs = (s.means, s.quats, s.scales, s.viewmats)
    found = [gradients([p[i] for p in pairs], inputs) for i in (0, 1)]
    for name, a, e in zip(("means", "quats", "scales", "viewmats"), *found):
        assert_close(a, e, name)


@pytest.mark.parametrize("camera_model", ["pinhole", "fisheye"])
@pytest.mark.parametrize("batch", BATCHES)
def test_packed_projection_is_the_dense_one_without_what_is_unseen(camera_model, batch):
    s = Scene(cameras=3, batch=batch)
    call = (s.means, None, s.quats, s.scales, s.viewmats, s.Ks, WIDTH, HEIGHT)
    options = dict(calc_compensations=True, camera_model=camera_model, opacities=s.opacities)
    dense = ours.fully_fused_projection(*call, **options)
    packed = ours.fully_fused_projection(*call, packed=True, **options)
    batch_ids, camera_ids, gaussian_ids, indptr = packed[:4]
    seen = (dense[0] > 0).all(-1)
    assert 0 < seen.sum() < seen.numel()
    images = math.prod(batch) * 3
    place = seen.reshape(-1, 3, seen.shape[-1]).nonzero(as_tuple=True)
    for ids, expected in zip((batch_ids, camera_ids, gaussian_ids), place):
        assert ids.dtype == torch.int64 and torch.equal(ids, expected)
    assert indptr.dtype == torch.int32 and indptr.shape == (images + 1,)
    counts = torch.bincount(batch_ids * 3 + camera_ids, minlength=images)
    assert torch.equal(indptr.diff().long(), counts)
    for p, d in zip(packed[4:], dense):
        assert torch.equal(p, d[seen])
    inputs = (s.means, s.quats, s.scales, s.viewmats)
    found = gradients(packed[5:], inputs), gradients([d[seen] for d in dense[1:]], inputs)
    for a, e in zip(*found):
        torch.testing.assert_close(a, e, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("batch", BATCHES)
def test_sparse_gradients_are_the_dense_ones(batch):
    s = Scene(cameras=2, batch=batch)
    inputs = (s.means, s.quats, s.scales)
    found = []
    for sparse in (False, True):
        out = ours.fully_fused_projection(
            s.means,
            None,
            s.quats,
            s.scales,
            s.viewmats,
            s.Ks,
            WIDTH,
            HEIGHT,
            packed=True,
            sparse_grad=sparse,
        )
        found.append(gradients(out[5:8], inputs))
    for d, p in zip(*found):
        assert p.is_sparse and p._nnz() < d.shape[-2] * math.prod(batch)
        torch.testing.assert_close(p.to_dense(), d)
    with pytest.raises(ValueError, match="packed"):
        ours.fully_fused_projection(*_call(s), sparse_grad=True)


def _call(s):
    return s.means, None, s.quats, s.scales, s.viewmats, s.Ks, WIDTH, HEIGHT


@pytest.mark.parametrize("camera_model", ["pinhole", "ortho", "fisheye"])
def test_culling_by_planes_radius_and_opacity(camera_model):
    s = Scene(cameras=1)

    def project(**options):
        return ours.fully_fused_projection(*_call(s), camera_model=camera_model, **options)

    radii, _, depths, *_ = project()
    seen = (radii > 0).all(-1)
    middle = float(depths[seen].median())
    for plane, kept in (("near_plane", depths > middle), ("far_plane", depths < middle)):
        assert torch.equal((project(**{plane: middle})[0] > 0).all(-1), seen & kept)
    largest = int(radii[seen].amax(-1).median())
    clipped = project(radius_clip=float(largest))[0]
    assert torch.equal((clipped > 0).all(-1), seen & (radii > largest).any(-1))
    assert not project(opacities=torch.full_like(s.opacities, 0.003))[0].any()
    tighter = project(opacities=torch.full_like(s.opacities, 0.05))[0]
    ratio = math.sqrt(2 * math.log(0.05 * 255)) / 3.33
    both = (tighter > 0).all(-1)
    assert (tighter[both] - radii[both] * ratio).abs().max() <= 1
    # Culled splats have no values.
    assert not depths[~seen].any()


@pytest.mark.parametrize("camera_model", ["pinhole", "ortho", "fisheye"])
def test_compensations_tighten_radii(camera_model):
    s = Scene()
    # Without compensation these are just visible; a compensated splat is fainter.
    call = dict(eps2d=1e6, opacities=torch.full_like(s.opacities, 0.005), camera_model=camera_model)
    assert ours.fully_fused_projection(*_call(s), **call)[0].any()
    assert not ours.fully_fused_projection(*_call(s), calc_compensations=True, **call)[0].any()


@pytest.mark.parametrize("degree", [0, 1, 2, 3, 4])
@pytest.mark.parametrize("batch", BATCHES)
def test_harmonics_of_directions(degree, batch):
    torch.manual_seed(3)
    dirs = torch.randn(batch + (40, 3), requires_grad=True)
    coeffs = torch.randn(batch + (40, 25, 3), requires_grad=True)
    masks = torch.rand(batch + (40,)) > 0.3
    actual = ours.spherical_harmonics(degree, dirs, coeffs, masks=masks)
    expected = reference._spherical_harmonics(degree, dirs, coeffs) * masks[..., None]
    torch.testing.assert_close(actual, expected, rtol=1e-4, atol=1e-4)
    found = [gradients([o], (dirs, coeffs)) for o in (actual, expected)]
    assert_close(found[0][1], found[1][1], "coeffs")
    if degree:
        assert_close(found[0][0], found[1][0], "dirs")


@pytest.mark.parametrize("channels", [1, 3, 7])
def test_harmonics_of_views(channels):
    s = Scene(cameras=2, batch=(2,))
    coeffs = torch.randn(60, 16, channels, requires_grad=True)
    masks = torch.rand(2, 2, 60) > 0.5
    actual = ours.spherical_harmonics(3, s.means, s.viewmats, coeffs, masks)
    centers = torch.inverse(s.viewmats.detach())[..., :3, 3]
    dirs = s.means[:, None] - centers[..., None, :]
    lower = ours.spherical_harmonics(3, dirs, coeffs, masks)
    assert actual.shape == (2, 2, 60, channels)
    torch.testing.assert_close(actual, lower, rtol=1e-4, atol=1e-4)
    if channels == 3:
        wide = coeffs.expand(2, 2, 60, 16, 3)
        expected = reference._spherical_harmonics(3, dirs, wide) * masks[..., None]
        torch.testing.assert_close(actual, expected, rtol=1e-4, atol=1e-4)
    scene, camera, splat = masks.nonzero(as_tuple=True)
    ids = dict(batch_ids=scene, camera_ids=camera, gaussian_ids=splat)
    for given in (coeffs[splat], coeffs):
        rows = ours.spherical_harmonics(3, s.means, s.viewmats, given, **ids)
        torch.testing.assert_close(rows, actual[masks])
    parts = ours.spherical_harmonics_l0(coeffs[:, :1]) + ours.spherical_harmonics_l1_plus(
        3, s.means, s.viewmats, coeffs[:, 1:]
    )
    whole = ours.spherical_harmonics(3, means=s.means, viewmats=s.viewmats, coeffs=coeffs)
    torch.testing.assert_close(parts, whole, rtol=1e-4, atol=1e-4)
    with pytest.raises(TypeError):
        ours.spherical_harmonics(3, s.means)


def test_degree_0_needs_no_higher_coefficients():
    none, dirs = torch.empty(9, 0, 3, requires_grad=True), torch.randn(2, 9, 3, requires_grad=True)
    rest = ours.spherical_harmonics_l1_plus(0, dirs, none)
    assert rest.shape == (2, 9, 3) and not rest.any()
    by_none, by_dirs = torch.autograd.grad(rest.sum(), (none, dirs))
    assert by_none.shape == none.shape and not by_dirs.any()


def test_harmonics_take_half_precision_and_strided_gradients():
    torch.manual_seed(6)
    coeffs = torch.randn(40, 26, 3).half().requires_grad_()
    dirs = torch.randn(40, 3, requires_grad=True)
    colors = ours.spherical_harmonics(3, dirs, coeffs)
    assert colors.dtype == torch.float32
    wide = torch.randn(40, 6)
    by_coeffs, by_dirs = torch.autograd.grad(colors, (coeffs, dirs), wide[:, :3])
    assert by_coeffs.dtype == torch.float16 and not by_coeffs[:, 16:].any()
    full = coeffs.detach().float().requires_grad_()
    again = ours.spherical_harmonics(3, dirs, full)
    expected = torch.autograd.grad(again, (full, dirs), wide[:, :3].contiguous())
    torch.testing.assert_close(by_coeffs.float(), expected[0], rtol=2e-3, atol=5e-4)
    torch.testing.assert_close(by_dirs, expected[1])


def test_a_batch_of_scenes_with_equal_cameras_keeps_its_gradients_apart():
    means = torch.tensor([0.0, 0, 2]).repeat(2, 8, 1).requires_grad_()
    covars = torch.tensor([0.01, 0, 0, 0.01, 0, 0.01]).repeat(2, 8, 1)
    viewmats = torch.eye(4).repeat(2, 2, 1, 1).requires_grad_()
    Ks = torch.tensor([[20.0, 0, 16], [0, 20, 16], [0, 0, 1]]).repeat(2, 2, 1, 1)
    for packed, model in itertools.product((False, True), ("pinhole", "ortho", "fisheye")):
        out = ours.fully_fused_projection(
            means, covars, None, None, viewmats, Ks, 32, 32, packed=packed, camera_model=model
        )
        depths = out[6] if packed else out[2]
        assert depths.numel() == 2 * 2 * 8
        by_means, by_views = torch.autograd.grad(depths.sum(), (means, viewmats))
        assert (by_means == torch.tensor([0.0, 0, 2])).all()
        assert (by_views[..., 2, :] == torch.tensor([0.0, 0, 16, 8])).all()


def _footprints(s):
    out = ours.fully_fused_projection(*_call(s))
    return [t.detach() for t in out[:4]]


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize("batch", BATCHES)
def test_tiles(dtype, batch):
    torch.manual_seed(4)
    means2d = (torch.randn(batch + (3, 50, 2)) * 40).to(dtype)
    radii = torch.randint(0, 40, batch + (3, 50, 2), dtype=torch.int32)
    depths = torch.rand(batch + (3, 50), dtype=dtype)
    expected = reference._isect_tiles(means2d, radii, depths.float(), 16, 3, 4)
    actual = ours.isect_tiles(means2d, radii, depths, 16, 3, 4)
    for a, e in zip(actual, expected):
        assert torch.equal(a, e) and a.dtype == e.dtype
    images = math.prod(batch) * 3
    offsets = ours.isect_offset_encode(actual[1], images, 3, 4)
    assert torch.equal(offsets, reference._isect_offset_encode(expected[1], images, 3, 4))
    image_ids = torch.arange(images).repeat_interleave(50)
    packed = ours.isect_tiles(
        means2d.reshape(-1, 2),
        radii.reshape(-1, 2),
        depths.reshape(-1),
        16,
        3,
        4,
        packed=True,
        n_images=images,
        image_ids=image_ids,
        gaussian_ids=torch.arange(50).repeat(images),
    )
    assert torch.equal(packed[1], actual[1]) and torch.equal(packed[2], actual[2])


def test_tiles_of_ellipses_hold_every_drawn_pixel():
    s = Scene(splats=200)
    radii, means2d, depths, conics = _footprints(s)
    box = ours.isect_tiles(means2d, radii, depths, 8, 8, 6)
    opacities = s.opacities.detach()[None]
    fine = ours.isect_tiles(means2d, radii, depths, 8, 8, 6, conics=conics, opacities=opacities)
    assert len(fine[1]) < len(box[1])
    light = torch.ones(1, HEIGHT, WIDTH)
    found = []
    for _, ids, splats in (box, fine):
        offsets = ours.isect_offset_encode(ids, 1, 8, 6)
        found.append(
            ours.rasterize_to_indices_in_range(
                0, 1e9, light, means2d, conics, opacities, WIDTH, HEIGHT, 8, offsets, splats
            )
        )
    assert len(found[0][0]) > 1000
    for a, b in zip(*found):
        assert torch.equal(a, b)


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("channels", [1, 3, 9])
def test_rasterize_to_pixels(channels, packed):
    s = Scene(cameras=2, channels=channels)
    radii, means2d, depths, conics = _footprints(s)
    colors = s.colors.detach().expand(2, -1, -1).clone()
    opacities = s.opacities.detach().expand(2, -1).clone()
    backgrounds = torch.rand(2, channels)
    image_ids = None
    splats = [means2d, conics, colors, opacities]
    if packed:
        seen = (radii > 0).all(-1)
        image_ids = seen.nonzero()[:, 0]
        splats, radii, depths = [t[seen] for t in splats], radii[seen], depths[seen]
    for t in splats + [backgrounds]:
        t.requires_grad_()
    _, ids, flatten = ours.isect_tiles(
        splats[0],
        radii,
        depths,
        16,
        4,
        3,
        packed=packed,
        n_images=2,
        image_ids=image_ids,
        gaussian_ids=image_ids,
    )
    offsets = ours.isect_offset_encode(ids, 2, 4, 3)
    actual = ours.rasterize_to_pixels(
        *splats, WIDTH, HEIGHT, 16, offsets, flatten, backgrounds, packed=packed, absgrad=True
    )
    expected = []
    for i in range(2):
        own = [t[image_ids == i] if packed else t[i] for t in (*splats, depths, radii)]
        m, c, f, o, z, r = own
        expected.append(blend(m, c, z, o, f, r, backgrounds[i]))
    expected = [torch.stack(t) for t in zip(*expected)]
    assert actual[0].shape == (2, HEIGHT, WIDTH, channels)
    for a, e in zip(actual, expected):
        assert_close(a, e)
    inputs = splats + [backgrounds]
    for a, e in zip(gradients(actual, inputs), gradients(expected, inputs)):
        assert_close(a, e)
    if not packed:
        _compare_accumulated(splats, offsets, flatten, actual, backgrounds)
    assert splats[0].absgrad.shape == splats[0].shape
    actual[0].sum().backward(retain_graph=True)
    actual[1].sum().backward()
    with pytest.raises(RuntimeError, match="second time"):
        actual[1].sum().backward()


def _compare_accumulated(splats, offsets, flatten, actual, backgrounds):
    means2d, conics, colors, opacities = splats
    light = torch.ones(2, HEIGHT, WIDTH)
    triples = ours.rasterize_to_indices_in_range(
        0, 1e9, light, means2d, conics, opacities, WIDTH, HEIGHT, 16, offsets, flatten
    )
    image, alpha = ours.accumulate(means2d, conics, opacities, colors, *triples, WIDTH, HEIGHT)
    image = image + (1 - alpha) * backgrounds[:, None, None]
    assert_close(image, actual[0])
    assert_close(alpha, actual[1])
    inputs = splats + [backgrounds]
    for a, e in zip(gradients((image, alpha), inputs), gradients(actual, inputs)):
        assert_close(a, e)


def test_masked_tiles_show_the_background():
    s = Scene()
    radii, means2d, depths, conics = _footprints(s)
    _, ids, flatten = ours.isect_tiles(means2d, radii, depths, 16, 4, 3)
    offsets = ours.isect_offset_encode(ids, 1, 4, 3)
    masks = torch.ones(1, 3, 4, dtype=torch.bool)
    masks[0, 1, 2] = False
    call = (means2d, conics, s.colors[None], s.opacities[None], WIDTH, HEIGHT, 16, offsets, flatten)
    background = torch.tensor([[0.2, 0.4, 0.6]])
    full, _ = ours.rasterize_to_pixels(*call, background)
    image, alpha = ours.rasterize_to_pixels(*call, background, masks)
    hole = torch.zeros(HEIGHT, WIDTH, dtype=torch.bool)
    hole[16:32, 32:48] = True
    assert (image[0][hole] == background).all() and not alpha[0][hole].any()
    assert torch.equal(image[0][~hole], full[0][~hole])
    assert (full[0][hole] - background).abs().max() > 0.1
    with pytest.raises(ValueError, match="multiple of 4"):
        ours.rasterize_to_pixels(*call[:6], 18, *call[7:])


@pytest.mark.parametrize("size", [4, 12, 16])
def test_tiles_of_any_multiple_of_four(size):
    """gsplat draws tiles of 4 and 16 pixels."""
    s = Scene(cameras=2)
    radii, means2d, depths, conics = _footprints(s)
    columns, rows = math.ceil(WIDTH / size), math.ceil(HEIGHT / size)
    _, ids, flatten = ours.isect_tiles(means2d, radii, depths, size, columns, rows)
    offsets = ours.isect_offset_encode(ids, 2, columns, rows)
    colors, opacities = (t.detach().expand(2, *t.shape).clone() for t in (s.colors, s.opacities))
    splats = [t.requires_grad_() for t in (means2d, conics, colors, opacities)]
    actual = ours.rasterize_to_pixels(*splats, WIDTH, HEIGHT, size, offsets, flatten, absgrad=True)
    m, c, f, o = splats
    expected = [blend(m[i], c[i], depths[i], o[i], f[i], radii[i]) for i in range(2)]
    expected = [torch.stack(t) for t in zip(*expected)]
    for a, e in zip(actual, expected):
        assert_close(a, e)
    for a, e in zip(gradients(actual, splats), gradients(expected, splats)):
        assert_close(a, e)
    light = torch.ones(2, HEIGHT, WIDTH)
    lists = (WIDTH, HEIGHT, size, offsets, flatten)
    triples = ours.rasterize_to_indices_in_range(0, 2**30, light, m, c, o, *lists)
    again = ours.accumulate(m, c, o, f, *triples, WIDTH, HEIGHT)
    for a, e in zip(again, actual):
        assert_close(a, e)


def test_a_listed_splat_of_opacity_zero_has_no_gradient():
    means2d, conics = torch.full((1, 2, 2), 4.5), torch.tensor([0.1, 0.0, 0.1]).expand(1, 2, 3)
    opacities = torch.tensor([[0.0, 0.5]], requires_grad=True)
    offsets, ids = torch.zeros(1, 1, 1, dtype=torch.int32), torch.arange(2, dtype=torch.int32)
    image, _ = ours.rasterize_to_pixels(
        means2d, conics, torch.ones(1, 2, 3), opacities, 8, 8, 8, offsets, ids
    )
    image.sum().backward()
    assert opacities.grad[0, 0] == 0 and opacities.grad[0, 1] > 0


@pytest.mark.parametrize("packed", [False, True])
def test_lists_with_wrong_ids_are_refused(packed):
    lead = (3,) if packed else (1, 3)
    splats = torch.full(lead + (2,), 4.0), torch.tensor([1.0, 0, 1]).expand(lead + (3,))
    splats += (torch.ones(lead + (3,)), torch.ones(lead))
    offsets, ids = torch.zeros(1, 1, 1, dtype=torch.int32), torch.arange(3)

    def draw(offsets, ids, size=(8, 8, 8)):
        return ours.rasterize_to_pixels(*splats, *size, offsets, ids, packed=packed)

    assert draw(offsets, ids)[1].any()
    for wrong in (ids - 1, ids + 1, ids * 0 - 5, ids + 2**32):
        with pytest.raises(ValueError, match="flatten_ids holds .* at least 0 and below 3"):
            draw(offsets, wrong)
    for wrong in (offsets - 1, offsets + 4):
        with pytest.raises(ValueError, match="isect_offsets holds .* at least 0 and below 4"):
            draw(wrong, ids)
    with pytest.raises(ValueError, match="isect_offsets has shape"):
        draw(offsets[0, 0], ids)
    for i, name in enumerate(("image_width", "image_height", "tile_size")):
        size = [8, 8, 8]
        size[i] = 2**31
        with pytest.raises(ValueError, match=f"{name} is 2147483648; expected 1 to 2147483647"):
            draw(offsets, ids, size)
    with pytest.raises(ValueError, match="colors has shape .* at least one channel"):
        ours.rasterize_to_pixels(
            *splats[:2], splats[2][..., :0], splats[3], 8, 8, 8, offsets, ids, packed=packed
        )


def test_splats_of_another_image_are_refused():
    splats = torch.full((2, 3, 2), 4.0), torch.tensor([1.0, 0, 1]).expand(2, 3, 3)
    splats += (torch.ones(2, 3, 3), torch.ones(2, 3))
    offsets = torch.tensor([0, 3], dtype=torch.int32).reshape(2, 1, 1)
    with pytest.raises(ValueError, match="flatten_ids holds values from 3 to 5; .* below 3"):
        ours.rasterize_to_pixels(*splats, 8, 8, 8, offsets, torch.tensor([3, 4, 5, 0, 1, 2]))


def test_alpha_is_at_most_0_99():
    """Behind an opaque splat, the next one still shows."""
    means2d = torch.full((1, 2, 2), 4.5)
    conics = torch.tensor([0.1, 0.0, 0.1]).expand(1, 2, 3)
    opacities, colors = torch.tensor([[1.0, 0.5]]), torch.tensor([[[1.0, 0.0], [0.0, 1.0]]])
    offsets, ids = torch.zeros(1, 1, 1, dtype=torch.int32), torch.arange(2, dtype=torch.int32)
    size = (8, 8, 8, offsets, ids)
    image, alpha = ours.rasterize_to_pixels(means2d, conics, colors, opacities, *size)
    torch.testing.assert_close(image[0, 4, 4], torch.tensor([0.99, 0.005]))
    light = torch.ones(1, 8, 8)
    splats, pixels, _ = ours.rasterize_to_indices_in_range(
        0, 9, light, means2d, conics, opacities, *size
    )
    assert splats[pixels == 4 * 8 + 4].tolist() == [0, 1]
    triples = splats, pixels, torch.zeros_like(splats)
    again = ours.accumulate(means2d, conics, opacities, colors, *triples, 8, 8)
    torch.testing.assert_close(again, (image, alpha))
