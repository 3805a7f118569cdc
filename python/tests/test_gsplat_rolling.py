# SPDX-License-Identifier: Apache-2.0
"""Rolling shutters in ewa.gsplat and in ewa.render: rows of cameras at rest, and each other."""

import numpy as np
import pytest

import ewa

torch = pytest.importorskip("torch")

from ewa import gsplat as ours
from gsplat_scenes import HEIGHT, WIDTH, Scene

Type = ours.RollingShutterType
ORDERS = {
    Type.ROLLING_TOP_TO_BOTTOM: "top-to-bottom",
    Type.ROLLING_BOTTOM_TO_TOP: "bottom-to-top",
    Type.ROLLING_LEFT_TO_RIGHT: "left-to-right",
    Type.ROLLING_RIGHT_TO_LEFT: "right-to-left",
}


FOOTPRINT = (("means2d", 2), ("conics", 3), ("depths", 1))


def turned(turn, viewmats):
    """The view matrices of cameras that turn by axis times angle, in their own axes."""
    cross = torch.zeros(4, 4)
    x, y, z = turn
    cross[:3, :3] = torch.tensor([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return torch.matrix_exp(cross) @ viewmats


def rolling_scene(shift=(0.2, -0.1, 0.3), turn=(0.08, -0.06, 0.15), cameras=1):
    s = Scene(splats=80, cameras=cameras, seed=3)
    with torch.no_grad():
        s.scales *= 0.5
    ends = turned(turn, s.viewmats.detach()).clone()
    ends[..., :3, 3] += torch.tensor(shift)
    return s, ends.requires_grad_()


def draw(s, order, ends, **more):
    return ours.rasterization(
        **s.arguments(rolling_shutter=order, viewmats_rs=ends, packed=False, **more)
    )


@pytest.mark.parametrize("order", ORDERS)
def test_each_row_is_that_of_a_camera_at_rest(order):
    s, ends = rolling_scene(cameras=2)
    rolled, _, meta = draw(s, order, ends)
    assert meta["radii"].shape == (2, 80, 2) and meta["means2d"].shape == (2, 80, 2)
    rows = "TOP" in order.name
    count = HEIGHT if rows else WIDTH
    start, end = s.viewmats.detach(), ends.detach()
    turn = end[:, :3, :3] @ start[:, :3, :3].transpose(1, 2)
    backward = order in (Type.ROLLING_BOTTOM_TO_TOP, Type.ROLLING_RIGHT_TO_LEFT)
    first = ours.rasterization(**s.arguments())[0]
    squares = of_first = 0.0
    for line in range(count):
        share = line / (count - 1)
        share = 1 - share if backward else share
        values, vectors = torch.linalg.eig(turn)
        part = (vectors @ torch.diag_embed(values**share) @ torch.linalg.inv(vectors)).real
        at = start.clone()
        at[:, :3, :3] = part @ start[:, :3, :3]
        at[:, :3, 3] = (1 - share) * start[:, :3, 3] + share * end[:, :3, 3]
        own = ours.rasterization(**s.arguments(viewmats=at))[0]
        line = (slice(None), line) if rows else (slice(None), slice(None), line)
        squares += float(((rolled[line] - own[line]) ** 2).sum())
        of_first += float(((rolled[line] - first[line]) ** 2).sum())
    # A splat of some pixels bends a little across its rows, which a footprint does not.
    assert (squares / rolled.numel()) ** 0.5 < 0.012
    assert (of_first / rolled.numel()) ** 0.5 > 0.05


def test_a_camera_at_rest_has_the_image_of_a_global_shutter():
    s = Scene(cameras=2)
    expected = ours.rasterization(**s.arguments())[0]
    image = draw(s, Type.ROLLING_TOP_TO_BOTTOM, s.viewmats.detach().clone())[0]
    assert (image - expected).abs().max() < 2e-5


@pytest.mark.parametrize("shift, turn", [((0.3, -0.2, 0.4), (0, 0, 0)), ((0, 0, 0), (0.1, -0.2, 0.3))])
@pytest.mark.parametrize("order", ORDERS)
def test_the_operators_and_the_renderer_agree(order, shift, turn):
    """gsplat's matrices are those of the outer rows' centres, ewa's those of the borders."""
    s, _ = rolling_scene()
    start = torch.eye(4)[None]
    rows = "TOP" in order.name
    margin = 0.5 / ((HEIGHT if rows else WIDTH) - 1)

    def at(share):
        matrix = turned(share * torch.tensor(turn, dtype=torch.float), start).clone()
        matrix[..., :3, 3] += share * torch.tensor(shift)
        return matrix

    image = ours.rasterization(
        **s.arguments(
            viewmats=start, rolling_shutter=order, viewmats_rs=at(1.0), packed=False, near_plane=0.2
        )
    )[0]
    with torch.no_grad():
        splats = ewa.Splats(
            means=s.means.numpy(),
            quats=s.quats.numpy(),
            log_scales=torch.log(s.scales).numpy(),
            opacity_logits=torch.logit(s.opacities).numpy(),
            sh=((s.colors - 0.5) / 0.28209479177387814)[:, None].numpy(),
        )
    expected = ewa.render(
        splats,
        at(-margin)[0].double().numpy(),
        s.Ks[0].numpy(),
        WIDTH,
        HEIGHT,
        rolling_shutter=ORDERS[order],
        viewmats_end=at(1 + margin)[0].double().numpy(),
    ).color
    # A weight near 1/255 may count in one of them alone.
    difference = np.abs(image[0].detach().numpy() - expected)
    assert (difference > 5e-4).mean() < 0.005 and (difference**2).mean() ** 0.5 < 3e-4


@pytest.mark.parametrize("order", [Type.ROLLING_TOP_TO_BOTTOM, Type.ROLLING_RIGHT_TO_LEFT])
def test_the_gradient_is_the_slope_of_the_footprints(order):
    """An image has steps, where a weight passes 1/255. The footprints have none."""
    s, ends = rolling_scene(cameras=2)
    make = torch.Generator().manual_seed(8)
    weights = {name: torch.randn(2, 80, size, generator=make) for name, size in FOOTPRINT}
    seen = draw(s, order, ends)[2]["radii"].amin(-1, keepdim=True) > 0

    def loss():
        meta = draw(s, order, ends)[2]
        values = dict(means2d=meta["means2d"], conics=10 * meta["conics"], depths=meta["depths"][..., None])
        return sum((values[n].double() * weights[n] * seen).sum() for n, _ in FOOTPRINT)

    tensors = {"means": s.means, "quats": s.quats, "scales": s.scales, "viewmats": s.viewmats}
    tensors["viewmats_rs"] = ends
    found = torch.autograd.grad(loss(), list(tensors.values()))
    for (name, values), gradient in zip(tensors.items(), found):
        direction = gradient / gradient.norm()
        step = 1e-3
        with torch.no_grad():
            values += step * direction
            up = loss()
            values -= 2 * step * direction
            down = loss()
            values += step * direction
        slope = float((up - down) / (2 * step))
        assert abs(slope - float(gradient.norm())) < 0.005 * float(gradient.norm()), name


def test_harmonics_and_covariances_are_seen_from_each_row():
    s, ends = rolling_scene(cameras=2)
    order = Type.ROLLING_BOTTOM_TO_TOP
    make = torch.Generator().manual_seed(4)
    colors = 0.5 * torch.rand(80, 9, 3, generator=make)
    image = draw(s, order, ends, colors=colors, sh_degree=2)[0]
    covars, _ = ours.quat_scale_to_covar_preci(s.quats, s.scales, True, False, False)
    other = draw(s, order, ends, colors=colors, sh_degree=2, quats=None, scales=None, covars=covars)[0]
    assert (image - other).abs().max() < 1e-4
    batched = ours.rasterization(
        **{
            name: value[None] if isinstance(value, torch.Tensor) and name != "colors" else value
            for name, value in s.arguments(
                colors=colors, sh_degree=2, rolling_shutter=order, viewmats_rs=ends, packed=False
            ).items()
        }
    )[0]
    assert (image - batched[0]).abs().max() < 1e-6


def test_a_splat_that_is_not_finite_spoils_no_gradient():
    s, ends = rolling_scene()
    with torch.no_grad():
        s.means[3, 1] = float("nan")
        s.scales[4, 0] = float("inf")
        s.means[5] = torch.tensor([0.0, 0.0, -3.0])
    image = draw(s, Type.ROLLING_TOP_TO_BOTTOM, ends)[0]
    assert image.isfinite().all()
    found = torch.autograd.grad(image.sum(), [s.means, s.viewmats, ends])
    assert all(g.isfinite().all() for g in found)


@pytest.mark.parametrize(
    "change, text",
    [
        (dict(viewmats_rs=None), "rolling_shutter ROLLING_TOP_TO_BOTTOM needs viewmats_rs"),
        (dict(rolling_shutter=Type.GLOBAL), "viewmats_rs needs a rolling_shutter other than GLOBAL"),
        (dict(rolling_shutter=None), "viewmats_rs needs a rolling_shutter other than GLOBAL"),
        (dict(rolling_shutter=9), "rolling_shutter 9 is no RollingShutterType"),
        (dict(packed=True), "rolling_shutter needs packed=False"),
        (dict(camera_model="fisheye"), "rolling_shutter with camera_model 'fisheye'"),
        (dict(radial_coeffs=torch.zeros(1, 6)), "rolling_shutter with radial_coeffs"),
        (dict(viewmats_rs=torch.zeros(2, 4, 4)), r"viewmats_rs has shape \(2, 4, 4\)"),
    ],
)
def test_what_does_not_go_with_it_says_so(change, text):
    s, ends = rolling_scene()
    arguments = dict(rolling_shutter=Type.ROLLING_TOP_TO_BOTTOM, viewmats_rs=ends, packed=False)
    arguments.update(change)
    with pytest.raises((ValueError, NotImplementedError), match=text):
        ours.rasterization(**s.arguments(**arguments))
