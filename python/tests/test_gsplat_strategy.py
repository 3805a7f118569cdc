# SPDX-License-Identifier: Apache-2.0
"""Strategies, relocation and SelectiveAdam of ewa.gsplat."""

import math

import pytest

torch = pytest.importorskip("torch")

from ewa import gsplat as ours
from ewa.gsplat.relocation import compute_relocation
from ewa.gsplat.strategy import ops
from gsplat_scenes import Scene

NAMES = ("means", "scales", "quats", "opacities", "colors")


class Training:
    """Parameters with one Adam each, whose moments are those of one step."""

    def __init__(self, splats=60, seed=1):
        torch.manual_seed(seed)
        self.scene = Scene(splats=splats, seed=seed)
        s = self.scene
        values = dict(
            means=s.means.detach(),
            scales=torch.log(s.scales.detach()),
            quats=s.quats.detach(),
            opacities=torch.logit(s.opacities.detach()),
            colors=s.colors.detach(),
            fixed=torch.arange(float(splats))[:, None],
        )
        self.params = torch.nn.ParameterDict(
            {k: torch.nn.Parameter(v.clone(), k != "fixed") for k, v in values.items()}
        )
        self.optimizers = {k: torch.optim.Adam([self.params[k]], lr=1e-3) for k in NAMES}

    def render(self, rasterize=ours.rasterization, **options):
        p = self.params
        return rasterize(
            **self.scene.arguments(
                means=p["means"],
                quats=p["quats"],
                scales=torch.exp(p["scales"]),
                opacities=torch.sigmoid(p["opacities"]),
                colors=p["colors"],
                **options,
            )
        )

    def step(self, strategy, state, step, packed=False, absgrad=False, **options):
        image, _, info = self.render(packed=packed, absgrad=absgrad)
        strategy.step_pre_backward(self.params, self.optimizers, state, step, info)
        (image - 0.3).square().sum().backward()
        if isinstance(strategy, ours.DefaultStrategy) and packed:
            options["packed"] = True
        strategy.step_post_backward(self.params, self.optimizers, state, step, info, **options)
        for optimizer in self.optimizers.values():
            optimizer.step()
            optimizer.zero_grad(set_to_none=True)
        return info

    def moments(self, name="means"):
        return self.optimizers[name].state[self.params[name]]["exp_avg"]

    def check(self):
        """All parameters and moments have one row a splat, and optimizers hold the parameters."""
        count = len(self.params["means"])
        for name, p in self.params.items():
            assert len(p) == count and p.requires_grad == (name != "fixed"), name
            if name == "fixed":
                continue
            assert self.optimizers[name].param_groups[0]["params"][0] is p
            state = self.optimizers[name].state
            assert set(state) <= {p}
            if state.get(p):
                assert state[p]["exp_avg"].shape == state[p]["exp_avg_sq"].shape == p.shape
        return count

    def warm(self):
        image, _, _ = self.render()
        (image - 0.3).square().sum().backward()
        for optimizer in self.optimizers.values():
            optimizer.step()
            optimizer.zero_grad(set_to_none=True)
        for name in NAMES:
            assert self.moments(name).any()
        return self


def originals(t):
    """For each splat, the number of the splat that it comes from."""
    return t.params["fixed"].detach()[:, 0].long()


def test_duplicate_appends_copies():
    t = Training().warm()
    mask = torch.zeros(60, dtype=torch.bool)
    mask[[3, 7]] = True
    before = {k: p.detach().clone() for k, p in t.params.items()}
    moments = t.moments().clone()
    state = {"grad2d": torch.arange(60.0), "scene_scale": 2.0}
    ops.duplicate(t.params, t.optimizers, state, mask)
    assert t.check() == 62 and originals(t)[60:].tolist() == [3, 7]
    for name, value in before.items():
        assert torch.equal(t.params[name], torch.cat((value, value[[3, 7]])))
    assert torch.equal(t.moments()[:60], moments) and not t.moments()[60:].any()
    assert state["grad2d"][60:].tolist() == [3.0, 7.0] and state["scene_scale"] == 2.0


@pytest.mark.parametrize("revised", [False, True])
def test_split_draws_two_smaller_splats(revised):
    t = Training(splats=1000).warm()
    mask = torch.arange(1000) % 2 == 0
    before = {k: p.detach().clone() for k, p in t.params.items()}
    moments = t.moments()[~mask].clone()
    state = {"count": torch.arange(1000.0)}
    ops.split(t.params, t.optimizers, state, mask, revised_opacity=revised)
    assert t.check() == 1500
    come_from = originals(t)
    assert torch.equal(come_from[500:1000], come_from[1000:])
    assert torch.equal(state["count"], come_from.float())
    assert torch.equal(t.moments()[:500], moments) and not t.moments()[500:].any()
    halves = come_from[500:]
    shrunk = before["scales"][halves] - t.params["scales"].detach()[500:]
    torch.testing.assert_close(shrunk, torch.full_like(shrunk, math.log(1.6)))
    moved = t.params["means"].detach()[500:] - before["means"][halves]
    covars, precis = ours.quat_scale_to_covar_preci(
        before["quats"][halves], torch.exp(before["scales"][halves])
    )
    distance = torch.einsum("ni,nij,nj->n", moved, precis, moved)
    assert 2.7 < distance.mean() < 3.3  # three deviations squared, as of a normal distribution
    old, new = (
        torch.sigmoid(o) for o in (before["opacities"][halves], t.params["opacities"][500:])
    )
    expected = 1 - torch.sqrt(1 - old) if revised else old
    torch.testing.assert_close(new.detach(), expected)


def test_remove_and_reset():
    t = Training().warm()
    mask = torch.arange(60) < 20
    moments = t.moments().clone()
    state = {"count": torch.arange(60.0)}
    ops.remove(t.params, t.optimizers, state, mask)
    assert t.check() == 40 and originals(t).tolist() == list(range(20, 60))
    assert torch.equal(t.moments(), moments[20:]) and state["count"][0] == 20
    old = torch.sigmoid(t.params["opacities"].detach())
    ops.reset_opa(t.params, t.optimizers, state, 0.3)
    new = torch.sigmoid(t.params["opacities"].detach())
    torch.testing.assert_close(new, old.clamp(max=0.3))
    assert (old > 0.3).any() and not t.moments("opacities").any() and t.moments().any()
    assert t.check() == 40


@pytest.mark.parametrize("packed", [False, True])
def test_default_strategy_splits_clones_and_prunes(packed):
    t = Training()
    with torch.no_grad():
        t.params["scales"][:30] = math.log(0.2)
        t.params["scales"][30:] = math.log(0.005)
        t.params["opacities"][[5, 45]] = -9.0
    strategy = ours.DefaultStrategy(
        grow_grad2d=1e-5, refine_start_iter=0, refine_every=3, prune_opa=0.01
    )
    strategy.check_sanity(t.params, t.optimizers)
    state = strategy.initialize_state(scene_scale=1.0)
    assert state["scene_scale"] == 1.0 and state["grad2d"] is None
    seen = torch.zeros(60, dtype=torch.long)
    pulls = torch.zeros(60)
    for step in (1, 2):
        info = t.step(strategy, state, step, packed)
        assert t.check() == 60
        if packed:
            seen += torch.bincount(info["gaussian_ids"], minlength=60)
            pulls[info["gaussian_ids"]] += _norms(info)
        else:
            seen += (info["radii"][0] > 0).all(-1)
            pulls += _norms(info)[0]
    torch.testing.assert_close(state["count"], seen.float())
    torch.testing.assert_close(state["grad2d"], pulls)
    t.step(strategy, state, 3, packed)
    t.check()
    counts = torch.bincount(originals(t), minlength=60)
    assert counts[5] == counts[45] == 0  # faint
    assert set(counts.tolist()) == {0, 1, 2}
    scales = t.params["scales"].detach()[:, 0]
    split = [i for i in range(30) if counts[i] == 2]
    cloned = [i for i in range(30, 60) if counts[i] == 2]
    assert split and cloned
    # Scales moved by a few learning rates since.
    for group, size in ((split, 0.2 / 1.6), (cloned, 0.005)):
        rows = torch.isin(originals(t), torch.tensor(group))
        torch.testing.assert_close(
            scales[rows].exp(), torch.full((2 * len(group),), size), rtol=0.05, atol=0
        )
    assert not state["count"].any() and len(state["count"]) == len(scales)


def _norms(info):
    scale = torch.tensor([info["width"], info["height"]]) / 2 * info["n_cameras"]
    return (info["means2d"].grad * scale).norm(dim=-1)


def test_default_strategy_with_absolute_gradients_and_sizes():
    t = Training()
    strategy = ours.DefaultStrategy(
        absgrad=True,
        refine_start_iter=0,
        refine_every=2,
        reset_every=4,
        refine_scale2d_stop_iter=100,
        grow_scale2d=0.1,
        verbose=True,
    )
    state = strategy.initialize_state()
    info = t.step(strategy, state, 1, absgrad=True)
    scale = torch.tensor([32.0, 24.0])
    torch.testing.assert_close(state["grad2d"], (info["means2d"].absgrad * scale).norm(dim=-1)[0])
    torch.testing.assert_close(state["radii"], info["radii"][0].amax(-1) / 64)
    assert (state["radii"] > 0.1).any()
    t.step(strategy, state, 2, absgrad=True)
    assert t.check() > 60
    before = torch.sigmoid(t.params["opacities"].detach())
    assert before.max() > 0.5
    for step in (3, 4):
        t.step(strategy, state, step, absgrad=True)
    t.check()
    assert torch.sigmoid(t.params["opacities"]).max() < 0.011  # reset to twice prune_opa
    # After a reset, splats larger than a tenth of the scene go.
    strategy.grow_grad2d, state["scene_scale"] = 1e9, 1.0
    strategy.refine_scale2d_stop_iter = 0
    with torch.no_grad():
        t.params["scales"][:] = math.log(0.09)
        t.params["scales"][7] = math.log(0.2)
    number = originals(t)[7]
    copies = (originals(t) == number).sum()
    t.step(strategy, state, 6, absgrad=True)
    assert (originals(t) == number).sum() == copies - 1


def test_missing_gradients_name_what_gives_them():
    t = Training()
    strategy = ours.DefaultStrategy(absgrad=True)
    with pytest.raises(ValueError, match=r"needs rasterization\(absgrad=True\)"):
        t.step(strategy, strategy.initialize_state(), 1)
    strategy = ours.DefaultStrategy()
    info = {"means2d": torch.zeros(1, 60, 2)}
    with pytest.raises(ValueError, match="needs step_pre_backward"):
        strategy.step_post_backward(t.params, t.optimizers, strategy.initialize_state(), 1, info)


def test_default_strategy_stops_and_pauses():
    t = Training()
    strategy = ours.DefaultStrategy(
        grow_grad2d=0.0,
        refine_start_iter=2,
        refine_every=1,
        refine_stop_iter=9,
        reset_every=6,
        pause_refine_after_reset=2,
    )
    state = strategy.initialize_state()
    for step, grows in ((2, False), (3, True), (6, False), (7, False), (8, True), (9, False)):
        before = len(t.params["means"])
        t.step(strategy, state, step)
        assert (t.check() != before) == grows, step


def test_sanity_is_checked():
    t = Training()
    for strategy in (ours.DefaultStrategy(), ours.MCMCStrategy()):
        strategy.check_sanity(t.params, t.optimizers)
        for error in (ValueError, AssertionError):
            with pytest.raises(error, match="colors"):
                less = {k: v for k, v in t.optimizers.items() if k != "colors"}
                strategy.check_sanity(t.params, less)
        named = {k: v for k, v in t.params.items() if k != "quats"}
        rest = {k: v for k, v in t.optimizers.items() if k != "quats"}
        with pytest.raises(ValueError, match="quats"):
            strategy.check_sanity(named, rest)
        t.optimizers["means"].add_param_group({"params": [torch.zeros(1)]})
        with pytest.raises(ValueError, match="means has 2"):
            strategy.check_sanity(t.params, t.optimizers)
        t = Training()


@pytest.mark.parametrize("column", [False, True])
def test_mcmc_moves_dead_splats_and_adds_some(column):
    t = Training(splats=100)
    with torch.no_grad():
        t.params["opacities"][:10] = -8.0
    if column:
        t.params["opacities"] = torch.nn.Parameter(t.params["opacities"].detach()[:, None])
        t.optimizers["opacities"] = torch.optim.Adam([t.params["opacities"]])
    else:
        t.warm()
        for name in NAMES:
            t.moments(name).fill_(1.0)
    strategy = ours.MCMCStrategy(cap_max=103, refine_start_iter=0, refine_every=1, noise_lr=0.0)
    state = strategy.initialize_state()
    assert state["binoms"].shape == (51, 51) and state["binoms"][5, 2] == 10
    before = {k: p.detach().clone() for k, p in t.params.items()}
    for p in t.params.values():
        p.grad = None
    strategy.step_post_backward(t.params, t.optimizers, state, step=1, info={}, lr=1e-3)
    assert t.check() == 103
    come_from = originals(t)
    assert not (come_from < 10).any()
    counts = torch.bincount(come_from, minlength=100)
    assert counts.sum() == 103 and (counts[10:] > 0).all() and counts.max() > 1
    new = {k: p.detach() for k, p in t.params.items()}
    assert torch.equal(new["means"], before["means"][come_from])
    alone = counts[come_from] == 1
    assert torch.equal(new["opacities"][alone], before["opacities"][come_from][alone])
    # Splats on one place look about as opaque together as the one did.
    left = (
        torch.ones(100).index_put(
            (come_from,), torch.log1p(-torch.sigmoid(new["opacities"].flatten())), accumulate=True
        )
        - 1
    )
    old = torch.log1p(-torch.sigmoid(before["opacities"].flatten()))
    torch.testing.assert_close(left[10:], old[10:], rtol=1e-3, atol=1e-3)
    if not column:
        several = counts[come_from] > 1
        for name in NAMES:
            assert not t.moments(name)[several].any() and t.moments(name)[alone].all()


def test_mcmc_noise():
    t = Training(splats=4000)
    with torch.no_grad():
        t.params["opacities"][:2000] = -9.0
        t.params["opacities"][2000:] = 3.0
    strategy = ours.MCMCStrategy(noise_injection_stop_iter=5, noise_lr=100.0)
    before = t.params["means"].detach().clone()
    torch.manual_seed(7)
    state = strategy.initialize_state()
    strategy.step_post_backward(t.params, t.optimizers, state, 5, {}, lr=0.1)
    assert torch.equal(t.params["means"], before)
    strategy.step_post_backward(t.params, t.optimizers, state, 4, {}, lr=0.1)
    moved = (t.params["means"] - before).detach()
    assert moved[2000:].abs().max() < 1e-6
    # Noise is covariance * normal * lr * noise_lr * sigmoid(k (t - opacity)).
    _, precis = ours.quat_scale_to_covar_preci(
        t.params["quats"].detach(), torch.exp(t.params["scales"].detach())
    )
    opacity = torch.sigmoid(torch.tensor(-9.0))
    strength = 10.0 * torch.sigmoid(100.0 * (0.005 - opacity))
    normal = (precis @ moved[..., None])[:2000, :, 0] / strength
    assert abs(normal.mean()) < 0.05 and abs(normal.std() - 1) < 0.05
    again = t.params["means"].detach().clone()
    with torch.no_grad():
        t.params["means"].copy_(before)
    torch.manual_seed(7)
    strategy.step_post_backward(t.params, t.optimizers, state, 4, {}, lr=0.1)
    assert torch.equal(t.params["means"], again)


@pytest.mark.parametrize("name", ["DefaultStrategy", "MCMCStrategy"])
def test_the_seed_decides(name):
    found = []
    for seed in (3, 3, 4):
        t = Training()
        torch.manual_seed(seed)
        strategy = getattr(ours, name)(refine_start_iter=0, refine_every=2)
        if name == "DefaultStrategy":
            strategy.grow_grad2d = 1e-6
        state = strategy.initialize_state()
        lr = {} if name == "DefaultStrategy" else {"lr": 1e-4}
        for step in range(1, 4):
            t.step(strategy, state, step, **lr)
        found.append(t.params["means"].detach())
        t.check()
    assert len(found[0]) > 60 and torch.equal(found[0], found[1])
    assert found[2].shape != found[0].shape or not torch.equal(found[0], found[2])


@pytest.mark.parametrize("packed", [False, True])
def test_the_strategies_of_gsplat_itself(packed):
    theirs = pytest.importorskip("gsplat.strategy")
    t = Training()
    strategy = theirs.DefaultStrategy(refine_start_iter=0, refine_every=2, grow_grad2d=1e-6)
    strategy.check_sanity(t.params, t.optimizers)
    mine = ours.DefaultStrategy(refine_start_iter=0, refine_every=2, grow_grad2d=1e-6)
    state, own = strategy.initialize_state(), mine.initialize_state()
    image, _, info = t.render(packed=packed)
    strategy.step_pre_backward(t.params, t.optimizers, state, 1, info)
    image.square().sum().backward()
    mine.step_post_backward(t.params, t.optimizers, own, 1, info, packed=packed)
    strategy.step_post_backward(t.params, t.optimizers, state, 1, info, packed=packed)
    for name in ("grad2d", "count"):
        torch.testing.assert_close(own[name], state[name])
    image, _, info = t.render(packed=packed)
    strategy.step_pre_backward(t.params, t.optimizers, state, 2, info)
    image.square().sum().backward()
    strategy.step_post_backward(t.params, t.optimizers, state, 2, info, packed=packed)
    assert t.check() > 60


def _equation_9(opacity, scale, ratio):
    """New opacity and scale in float64, term by term."""
    new = 1 - (1 - opacity) ** (1 / ratio)
    total = 0.0
    for i in range(1, ratio + 1):
        for k in range(i):
            total += math.comb(i - 1, k) * (-1) ** k * new ** (k + 1) / math.sqrt(k + 1)
    return new, scale * opacity / total


@pytest.mark.parametrize("most", [5, 51])
def test_relocation_is_equation_9(most):
    torch.manual_seed(2)
    opacities, scales = 0.05 + 0.9 * torch.rand(128), 0.1 + torch.rand(128, 3)
    ratios = torch.randint(1, most + 1, (128,)).float()
    ratios[0] = 1000.0
    binoms = ours.MCMCStrategy().initialize_state()["binoms"][:most, :most]
    given = ratios.clone()
    found = compute_relocation(opacities, scales, ratios, binoms)
    assert torch.equal(given, ratios)
    for i in range(128):
        expected = _equation_9(float(opacities[i]), scales[i].double(), min(int(ratios[i]), most))
        assert abs(found[0][i] - expected[0]) < 1e-6
        torch.testing.assert_close(found[1][i], expected[1].float(), rtol=1e-5, atol=0)
    faint = compute_relocation(opacities * 0 + 1e-4, scales, ratios, binoms, min_opacity=0.005)
    assert (faint[0] == 0.005).all()
    with pytest.raises(ValueError, match="ratios"):
        compute_relocation(opacities, scales, ratios[1:], binoms)


def test_selective_adam_moves_visible_rows():
    torch.manual_seed(1)
    param = torch.nn.Parameter(torch.randn(6, 3))
    start = param.detach().clone()
    optimizer = ours.SelectiveAdam([param], eps=1e-8, betas=(0.9, 0.999))
    optimizer.param_groups[0]["lr"] = 0.1
    seen = torch.tensor([True, False, True, False, False, True])
    first, second, moved = torch.zeros(6, 3), torch.zeros(6, 3), start.clone()
    for _ in range(3):
        optimizer.zero_grad()
        param.square().sum().backward()
        grad = param.grad.clone()
        optimizer.step(visibility=seen)
        first[seen] = 0.9 * first[seen] + 0.1 * grad[seen]
        second[seen] = 0.999 * second[seen] + 0.001 * grad[seen] ** 2
        moved[seen] -= 0.1 * first[seen] / (second[seen].sqrt() + 1e-8)
        torch.testing.assert_close(param.detach(), moved)
    assert torch.equal(param.detach()[~seen], start[~seen])
    assert (param.detach()[seen] != start[seen]).all()
