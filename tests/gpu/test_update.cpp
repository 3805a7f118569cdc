// SPDX-License-Identifier: Apache-2.0
// The gradient of the projection and Adam, on slots from the CPU reference.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "core/random.h"
#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "passes/passes.h"
#include "pipeline/adam.h"
#include "pipeline/backward.h"
#include "reference/training.h"
#include "support/gradient_check.h"

namespace ewa::test {
namespace {

constexpr uint32_t kGradient = 1, kStatistics = 2, kRegularised = 4, kAbsolute = 8, kPacked = 16,
                   kMotion = 32;

/// A scene's way back up to the instances by the CPU reference, in the device's buffers.
struct Slots {
    Scene scene;
    reference::ReferenceGradient cpu;
    std::vector<float> slots;
    std::vector<uint32_t> tile_counts, first, places;  // places run against the instances

    explicit Slots(const Scene& s) : scene(s) {
        const Image target = random_target(31, s.camera.width, s.camera.height);
        cpu = reference::loss_gradient(s.gaussians, s.camera, target, s.options,
                                       reference_tiles(rig().config()));
        const auto& sorted = cpu.rendered.instances.sorted;
        const size_t splats = s.gaussians.size();
        tile_counts.resize(splats);
        for (const auto& instance : sorted) ++tile_counts[instance.splat];
        uint32_t sum = 0;
        for (const uint32_t n : tile_counts) {
            first.push_back(sum);
            sum += n;
        }
        for (uint32_t e = 0; e < std::max(sum, 1u); ++e) places.push_back(std::max(sum, 1u) - 1 - e);
        slots.resize(std::max<size_t>(sum, 1) * shared::SLOT_FLOATS, std::nanf(""));
        std::vector<uint32_t> next = first;
        for (size_t k = 0; k < sorted.size(); ++k) {
            const auto slot = slot_of(cpu.blend.instances[k], cpu.rendered.projected[sorted[k].splat]);
            for (size_t j = 0; j < slot.size(); ++j)
                slots[size_t(places[next[sorted[k].splat]]) * shared::SLOT_FLOATS + j] = float(slot[j]);
            ++next[sorted[k].splat];
        }
    }
};

/// What the pass reads and writes besides the model.
struct Bench {
    gpu::Buffer camera, values{*device(), "values", sizeof(shared::UpdateBlock), gpu::Texel::none, true};
    Guarded records, slots, tile_counts, first, places, counts, statistics, motion_sums;

    explicit Bench(const Slots& s)
        : camera(camera_buffer(s.scene.camera, rig().config())),
          records("records", pack_records(s.cpu.rendered.projected), gpu::Texel::rgba32f),
          slots("slots", s.slots, gpu::Texel::rgba32f),
          tile_counts("tile counts", s.tile_counts),
          first("first instances", s.first),
          places("places", s.places),
          counts(zero_counts()),
          statistics("statistics", std::vector<float>(2 * s.scene.gaussians.size())),
          motion_sums("motion sums", std::vector<float>(kMotionRows * subgroups(s.scene.gaussians.size()))) {}

    static constexpr size_t kMotionRows = shared::MOTION_VALUES;
    static size_t subgroups(size_t splats) {
        const passes::KernelConfig& config = rig().config();
        return (splats + config.element_group - 1) / config.element_group *
               (config.element_group / config.subgroup);
    }
    /// dL/d(each value of the camera's motion).
    std::vector<double> by_motion() const {
        const std::vector<float> sums = motion_sums.read<float>();
        std::vector<double> rows(kMotionRows);
        const size_t count = sums.size() / kMotionRows;
        for (size_t i = 0; i < kMotionRows * count; ++i) rows[i / count] += sums[i];
        return rows;
    }

    void run(const Scene& scene, const pipeline::Model& model, const gpu::Buffer& moments1,
             const gpu::Buffer& moments2, uint32_t mode, const shared::UpdateBlock& push,
             int evaluated_degree = -1) {
        Rig& r = rig();
        const int degree = evaluated_degree < 0 ? scene.gaussians.sh_degree : evaluated_degree;
        r.run([&](gpu::Recording& recording) {
            recording.write(values, 0, std::as_bytes(std::span(&push, 1)));
            r.cache
                .get<passes::Update>({{shared::SPEC_SH_DEGREE, uint32_t(degree)},
                                      {shared::SPEC_KERNEL, uint32_t(scene.options.kernel)},
                                      {shared::SPEC_MODE, mode}})
                .record(recording,
                        {{.params = model.params,
                          .camera = camera,
                          .records = records,
                          .slots = slots,
                          .moments1 = moments1,
                          .moments2 = moments2,
                          .tile_counts = tile_counts,
                          .first_instances = first,
                          .counts = counts,
                          .params_out = model.params,
                          .moments1_out = moments1,
                          .moments2_out = moments2,
                          .statistics = statistics,
                          .sorted_indices = places,
                          .values = values},
                         motion_sums},
                        push);
        });
        expect_intact({&records, &slots, &tile_counts, &first, &places, &counts, &statistics, &motion_sums});
    }
};

shared::UpdateBlock push_for(const Scene& scene, uint32_t step, bool nesterov = false) {
    const pipeline::AdamShares shares = pipeline::adam_shares(nesterov, step);
    const uint32_t n = uint32_t(scene.gaussians.size());
    return {n,
            pipeline::parameter_planes(scene.gaussians.sh_degree),
            1000000,
            1e-3f,
            2e-2f,
            3e-3f,
            4e-3f,
            5e-3f,
            6e-4f,
            shares.moment,
            shares.gradient,
            float(1 / (1 - std::pow(shared::ADAM_BETA2, step))),
            {0.5f * float(scene.camera.width), 0.5f * float(scene.camera.height)},
            0,
            0,
            {0x12345678u, 0x9abcdef0u},
            step};
}

/// A model whose moment buffers are guarded.
struct GuardedModel {
    pipeline::Model model;
    Guarded moments1, moments2;
    explicit GuardedModel(const Gaussians& g)
        : model(pipeline::upload_model(*device(), g, 0, false)),
          moments1("moments1", zeros(g), gpu::Texel::rgba32ui),
          moments2("moments2", zeros(g), gpu::Texel::rgba32ui) {}
    static std::vector<float> zeros(const Gaussians& g) {
        return std::vector<float>(pipeline::parameter_bytes(uint32_t(g.size()), g.sh_degree) / 4);
    }
    Gaussians read(const gpu::Buffer& buffer) const { return download_model(model, buffer); }
};

struct UpdateCase {
    SplatKind kind;
    size_t splats;
    int sh_degree;
    Footprint kernel;
};

class UpdatePass : public testing::TestWithParam<UpdateCase> {};

TEST_P(UpdatePass, GradientMatchesTheReference) {
    const UpdateCase& c = GetParam();
    const Slots slots(random_scene(1800 + c.splats, c.splats, c.kind, 61, 47, c.sh_degree, c.kernel));
    GuardedModel model(slots.scene.gaussians);
    Bench bench(slots);
    bench.run(slots.scene, model.model, model.moments1, model.moments2, kGradient, push_for(slots.scene, 1));
    expect_intact({&model.moments1});
    for (const double sum : bench.by_motion()) EXPECT_EQ(sum, 0);  // not asked for
    const Gaussians actual = model.read(model.moments1);
    // float32 along one chain of products; a needle's axes differ by 1000, and so do the terms that cancel.
    GradientTolerance tolerance;
    tolerance.cosine = 1e-8;
    tolerance.norm = 5e-5;
    tolerance.element_relative = 1e-3;
    tolerance.element_absolute = 2e-5;
    EXPECT_TRUE(splat_gradients_agree(actual, slots.cpu.gradient, tolerance));
    EXPECT_EQ(bench.counts.read<shared::Counts>()[0].dropped_updates, 0u);
    for (const float value : bench.statistics.read<float>()) EXPECT_EQ(value, 0);  // not asked for
    const Gaussians params = model.read(model.model.params);
    EXPECT_EQ(params.means, slots.scene.gaussians.means);  // a gradient moves nothing
    EXPECT_EQ(params.sh, slots.scene.gaussians.sh);
}

INSTANTIATE_TEST_SUITE_P(All, UpdatePass,
                         testing::Values(UpdateCase{SplatKind::ordinary, 200, 0, Footprint::peak},
                                         UpdateCase{SplatKind::ordinary, 201, 3, Footprint::antialias},
                                         UpdateCase{SplatKind::ordinary, 202, 2, Footprint::density},
                                         UpdateCase{SplatKind::mixed, 300, 1, Footprint::peak},
                                         UpdateCase{SplatKind::mixed, 301, 3, Footprint::antialias},
                                         UpdateCase{SplatKind::needles, 150, 2, Footprint::peak},
                                         UpdateCase{SplatKind::ordinary, 1, 3, Footprint::peak}),
                         [](const testing::TestParamInfo<UpdateCase>& tested) {
                             const UpdateCase& c = tested.param;
                             return std::string(name_of(c.kind)) + "_" + std::to_string(c.splats) + "_sh" +
                                    std::to_string(c.sh_degree) + "_kernel" + std::to_string(int(c.kernel));
                         });

TEST_P(UpdatePass, GradientByTheCamerasMotionMatchesTheReference) {
    const UpdateCase& c = GetParam();
    const Slots slots(random_scene(1800 + c.splats, c.splats, c.kind, 61, 47, c.sh_degree, c.kernel));
    GuardedModel model(slots.scene.gaussians);
    Bench bench(slots);
    bench.run(slots.scene, model.model, model.moments1, model.moments2, kGradient | kMotion,
              push_for(slots.scene, 1));
    const CameraMotion& cpu = slots.cpu.camera;
    const std::vector<double> actual = bench.by_motion();
    GradientTolerance tolerance;
    tolerance.cosine = 1e-8;
    tolerance.norm = 1e-4;
    const std::span<const double> all = actual;
    EXPECT_TRUE(gradients_agree(all.subspan(0, 3),
                                std::vector{cpu.rotation.x, cpu.rotation.y, cpu.rotation.z}, tolerance));
    EXPECT_TRUE(gradients_agree(all.subspan(3, 1), std::vector{cpu.log_focal}, tolerance));
    EXPECT_TRUE(
        gradients_agree(all.subspan(4, 3), std::vector{cpu.shift.x, cpu.shift.y, cpu.shift.z}, tolerance));
}

/// Nothing of a splat whose gradient is not finite reaches the camera, and nothing of a frame whose instances did not fit.
TEST(UpdateMotion, LeavesOutWhatIsNotFinite) {
    const Scene scene = random_scene(1906, 40, SplatKind::ordinary, 61, 47, 1);
    Slots slots(scene);
    GuardedModel model(scene.gaussians);
    const auto sums_of = [&](const Slots& s, const shared::UpdateBlock& push, uint32_t instances) {
        Bench bench(s);
        shared::Counts counts{};
        counts.instances = instances;
        bench.counts = Guarded("counts", std::vector{counts});
        bench.run(scene, model.model, model.moments1, model.moments2, kGradient | kMotion, push);
        return bench.by_motion();
    };
    auto push = push_for(scene, 1);
    const std::vector<double> all = sums_of(slots, push, 0);
    size_t spoilt = 0;
    while (slots.tile_counts[spoilt] == 0) ++spoilt;
    slots.slots[size_t(slots.places[slots.first[spoilt]]) * shared::SLOT_FLOATS] = std::nanf("");
    slots.slots[size_t(slots.places[slots.first[spoilt]]) * shared::SLOT_FLOATS + 1] = std::nanf("");
    const std::vector<double> others = sums_of(slots, push, 0);
    for (size_t k = 0; k < all.size(); ++k) {
        EXPECT_TRUE(std::isfinite(others[k]));
        EXPECT_NE(others[k], all[k]);
    }
    push.instance_capacity = 5;
    for (const double sum : sums_of(slots, push, 6)) EXPECT_EQ(sum, 0);
}

std::vector<double> wide(const std::vector<float>& values) {
    return {values.begin(), values.end()};
}

/// One of the groups that a learning rate belongs to, followed through several steps by the CPU reference's
/// Adam.
struct Followed {
    const char* name;
    std::vector<double> values;
    reference::AdamState state;
    Followed(const char* n, const std::vector<float>& start)
        : name(n), values(wide(start)), state(start.size()) {}
};

class UpdateAdam : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Momentum, UpdateAdam, testing::Bool(), [](const auto& asked) {
    return asked.param ? std::string("Nesterov") : std::string("Plain");
});

TEST_P(UpdateAdam, FollowsTheReferencesAdamOverSeveralSteps) {
    const bool nesterov = GetParam();
    const Scene scene = random_scene(1900, 150, SplatKind::mixed, 61, 47, 2);
    const Slots slots(scene);
    GuardedModel model(scene.gaussians), gradient(scene.gaussians);
    Bench bench(slots);
    const Gaussians& start = scene.gaussians;
    Followed means("means", start.means), quaternions("quaternions", start.quaternions),
        scales("log scales", start.log_scales), opacities("opacities", start.opacity_logits),
        sh("sh", start.sh);
    for (int step = 1; step <= 6; ++step) {
        SCOPED_TRACE("step " + std::to_string(step));
        const auto push = push_for(scene, uint32_t(step), nesterov);
        bench.run(scene, model.model, gradient.moments1, gradient.moments2, kGradient, push);
        const Gaussians g = gradient.read(gradient.moments1);
        bench.run(scene, model.model, model.moments1, model.moments2, kStatistics, push);
        const Gaussians now = model.read(model.model.params);
        const auto compare = [&](Followed& f, const std::vector<float>& by, const std::vector<float>& actual,
                                 double rate) {
            adam_step(f.values, wide(by), f.state, rate, step, nesterov);
            double worst = 0;
            for (size_t i = 0; i < actual.size(); ++i) {
                // A step of Adam is the rate times a quotient of float32 moments; and each step rounds the
                // value once.
                const double bound = step * (2e-5 * rate + 1.2e-7 * std::abs(f.values[i]));
                worst = std::max(worst, std::abs(actual[i] - f.values[i]) / bound);
            }
            EXPECT_LT(worst, 1) << f.name;
        };
        compare(means, g.means, now.means, push.mean_rate);
        compare(quaternions, g.quaternions, now.quaternions, push.quaternion_rate);
        compare(scales, g.log_scales, now.log_scales, push.scale_rate);
        compare(opacities, g.opacity_logits, now.opacity_logits, push.opacity_rate);
        // Two rates: the CPU reference takes them one after the other from the same state.
        const size_t stride = start.sh_stride();
        reference::AdamState rest_state = sh.state;
        std::vector<double> rest = sh.values;
        adam_step(rest, wide(g.sh), rest_state, push.sh_rest_rate, step, nesterov);
        adam_step(sh.values, wide(g.sh), sh.state, push.sh0_rate, step, nesterov);
        for (size_t i = 0; i < rest.size(); ++i) {
            if (i % stride >= 3) sh.values[i] = rest[i];
            const double rate = i % stride >= 3 ? push.sh_rest_rate : push.sh0_rate;
            EXPECT_NEAR(now.sh[i], sh.values[i], step * (2e-5 * rate + 1.2e-7 * std::abs(sh.values[i])));
        }
    }
    EXPECT_EQ(bench.counts.read<shared::Counts>()[0].dropped_updates, 0u);
    expect_intact({&model.moments1, &model.moments2});

    // Six steps of statistics from the same slots: six views each for what was drawn.
    reference::DensifyStatistics expected(start.size());
    accumulate(expected, slots.cpu.blend.splats, slots.cpu.in_view, scene.camera);
    const auto statistics = bench.statistics.read<float>();
    for (size_t i = 0; i < start.size(); ++i) {
        EXPECT_EQ(statistics[2 * i + 1], 6 * expected.views[i]) << i;
        if (expected.views[i] == 0) {
            EXPECT_EQ(statistics[2 * i], 0);
        }
    }
}

class UpdateStatistics : public testing::TestWithParam<bool> {};

TEST_P(UpdateStatistics, MatchTheReference) {
    const bool absolute = GetParam();
    const Scene scene = random_scene(1901, 200, SplatKind::mixed, 61, 47);
    const Slots slots(scene);
    GuardedModel model(scene.gaussians);
    Bench bench(slots);
    bench.run(scene, model.model, model.moments1, model.moments2,
              kGradient | kStatistics | (absolute ? kAbsolute : 0), push_for(scene, 1));
    reference::DensifyStatistics expected(scene.gaussians.size());
    accumulate(expected, slots.cpu.blend.splats, slots.cpu.in_view, scene.camera, absolute);
    const auto actual = bench.statistics.read<float>();
    double largest = 0;
    for (const double sum : expected.gradient_sum) largest = std::max(largest, sum);
    for (size_t i = 0; i < scene.gaussians.size(); ++i) {
        EXPECT_EQ(actual[2 * i + 1], float(expected.views[i])) << i;
        EXPECT_NEAR(actual[2 * i], expected.gradient_sum[i],
                    1e-5 * largest + 1e-4 * expected.gradient_sum[i]);
    }
}

INSTANTIATE_TEST_SUITE_P(SignedAndAbsolute, UpdateStatistics, testing::Bool());

/// d(opacity) / d(logit) and d(scale) / d(log scale), on top of the loss's gradient, for what is not drawn
/// too.
class UpdateRegularisers : public testing::TestWithParam<Footprint> {};

TEST_P(UpdateRegularisers, PullAtEveryOpacityAndScale) {
    const Scene scene = random_scene(1905, 150, SplatKind::mixed, 61, 47, 1, GetParam());
    const Slots slots(scene);
    GuardedModel plain(scene.gaussians), pulled(scene.gaussians);
    Bench bench(slots);
    auto push = push_for(scene, 1);
    push.opacity_weight = 0.7f;
    push.scale_weight = 0.3f;
    bench.run(scene, plain.model, plain.moments1, plain.moments2, kGradient, push);
    bench.run(scene, pulled.model, pulled.moments1, pulled.moments2, kGradient | kRegularised, push);
    const Gaussians a = plain.read(plain.moments1), b = pulled.read(pulled.moments1);
    const auto near = [](double actual, double loss, double pull) {
        // 1 - opacity has float32's absolute error.
        EXPECT_NEAR(actual, loss + pull, 2e-6 * (std::abs(loss) + std::abs(pull)) + 1e-7);
    };
    for (size_t i = 0; i < scene.gaussians.size(); ++i) {
        const double o = 1 / (1 + std::exp(-double(scene.gaussians.opacity_logits[i])));
        near(b.opacity_logits[i], a.opacity_logits[i], push.opacity_weight * o * (1 - o));
        for (size_t k = 3 * i; k < 3 * i + 3; ++k)
            near(b.log_scales[k], a.log_scales[k],
                 push.scale_weight * std::exp(double(scene.gaussians.log_scales[k])));
    }
    EXPECT_EQ(a.means, b.means);
    EXPECT_EQ(a.quaternions, b.quaternions);
    EXPECT_EQ(a.sh, b.sh);
}

INSTANTIATE_TEST_SUITE_P(PeakAndDensity, UpdateRegularisers,
                         testing::Values(Footprint::peak, Footprint::density));

TEST(UpdateEdges, AnUpdateThatIsNotFiniteIsDroppedAndCounted) {
    const Scene scene = random_scene(1902, 40, SplatKind::ordinary, 61, 47, 1);
    Slots slots(scene);
    size_t poisoned = 0;
    while (slots.tile_counts[poisoned] == 0) ++poisoned;
    slots.slots[size_t(slots.places[slots.first[poisoned]]) * shared::SLOT_FLOATS] = std::nanf("");  // sum g
    GuardedModel model(scene.gaussians);
    Bench bench(slots);
    bench.run(scene, model.model, model.moments1, model.moments2, 0, push_for(scene, 1));
    const Gaussians now = model.read(model.model.params);
    // The sum g alone reaches the opacity, which shares its texel with the mean.
    EXPECT_EQ(bench.counts.read<shared::Counts>()[0].dropped_updates, 1u);
    EXPECT_EQ(now.opacity_logits[poisoned], scene.gaussians.opacity_logits[poisoned]);
    EXPECT_EQ(now.means[3 * poisoned], scene.gaussians.means[3 * poisoned]);
    EXPECT_NE(now.log_scales[3 * poisoned], scene.gaussians.log_scales[3 * poisoned]);
    for (const auto* values : {&now.means, &now.quaternions, &now.log_scales, &now.opacity_logits, &now.sh})
        for (const float value : *values) EXPECT_TRUE(std::isfinite(value));
    for (const float value : model.moments1.read<float>()) EXPECT_TRUE(std::isfinite(value));
}

/// What is not finite already is no update that was dropped; a gradient that is merely huge moves as any
/// does.
TEST(UpdateEdges, FrozenSplatsStayAndAreNotCounted) {
    const Scene scene = random_scene(1912, 90, SplatKind::ordinary, 61, 47, 1);
    const Slots slots(scene);
    for (const uint32_t mode : {0u, kPacked}) {
        GuardedModel model(scene.gaussians);
        const uint32_t planes = model.model.planes();
        std::vector<uint32_t> words(GuardedModel::zeros(scene.gaussians).size());
        for (uint32_t f = 0; f < 4 * planes; ++f)
            for (size_t i = 0; i < 90; i += 3)
                words[pipeline::parameter_index(planes, f, i)] = shared::FROZEN_MOMENT;
        model.moments1 = Guarded("moments1", words, gpu::Texel::rgba32ui);
        model.moments2 = Guarded("moments2", words, gpu::Texel::rgba32ui);
        Bench bench(slots);
        for (uint32_t step = 1; step <= 3; ++step)
            bench.run(scene, model.model, model.moments1, model.moments2, mode, push_for(scene, step));
        const Gaussians after = model.read(model.model.params);
        const auto moments1 = model.moments1.read<uint32_t>();
        size_t moved = 0;
        for (size_t i = 0; i < 90; ++i) {
            const bool frozen = i % 3 == 0;
            EXPECT_EQ(moments1[pipeline::parameter_index(planes, 5, i)] == shared::FROZEN_MOMENT, frozen);
            moved += after.means[3 * i] != scene.gaussians.means[3 * i];
            if (!frozen) continue;
            EXPECT_EQ(after.means[3 * i], scene.gaussians.means[3 * i]);
            EXPECT_EQ(after.opacity_logits[i], scene.gaussians.opacity_logits[i]);
            for (size_t k = 0; k < after.sh_stride(); ++k)
                EXPECT_EQ(after.sh[after.sh_stride() * i + k], scene.gaussians.sh[after.sh_stride() * i + k]);
        }
        EXPECT_GT(moved, 30u);
        EXPECT_EQ(bench.counts.read<shared::Counts>()[0].dropped_updates, 0u);
    }
}

TEST(UpdateEdges, HugeGradientsMoveAndBrokenValuesAreNotCounted) {
    Scene scene = random_scene(1907, 40, SplatKind::ordinary, 61, 47, 1);
    Slots slots(scene);
    size_t pushed = 0;
    while (slots.tile_counts[pushed] == 0) ++pushed;
    slots.slots[size_t(slots.places[slots.first[pushed]]) * shared::SLOT_FLOATS] = 1e25f;  // sum g
    GuardedModel model(scene.gaussians);
    Bench bench(slots);
    bench.run(scene, model.model, model.moments1, model.moments2, 0, push_for(scene, 1));
    EXPECT_EQ(bench.counts.read<shared::Counts>()[0].dropped_updates, 0u);
    EXPECT_NE(model.read(model.model.params).opacity_logits[pushed], scene.gaussians.opacity_logits[pushed]);

    Gaussians broken = scene.gaussians;
    for (size_t k = 0; k < 3; ++k) broken.log_scales[3 * pushed + k] = std::nanf("");
    GuardedModel other(broken);
    slots.tile_counts[pushed] = 0;  // so it is not drawn
    Bench again(slots);
    again.run(scene, other.model, other.moments1, other.moments2, 0, push_for(scene, 1));
    const Gaussians now = other.read(other.model.params);
    EXPECT_TRUE(std::isnan(now.log_scales[3 * pushed]));
    EXPECT_EQ(again.counts.read<shared::Counts>()[0].dropped_updates, 0u);
    EXPECT_NE(now.log_scales[3 * pushed + 3], broken.log_scales[3 * pushed + 3]);
}

TEST(UpdateEdges, NothingMovesWhereTheInstancesDidNotFit) {
    const Scene scene = random_scene(1903, 40, SplatKind::ordinary, 61, 47);
    const Slots slots(scene);
    GuardedModel model(scene.gaussians);
    Bench bench(slots);
    shared::Counts needed{};
    needed.instances = 1001;
    bench.counts = Guarded("counts", std::vector<shared::Counts>{needed});
    auto push = push_for(scene, 1);
    push.instance_capacity = 1000;
    bench.run(scene, model.model, model.moments1, model.moments2, kStatistics, push);
    EXPECT_EQ(model.read(model.model.params).means, scene.gaussians.means);
    for (const float value : model.moments2.read<float>()) EXPECT_EQ(value, 0);
    for (const float value : bench.statistics.read<float>()) EXPECT_EQ(value, 0);

    needed.instances = 1000;  // they just fit
    bench.counts = Guarded("counts", std::vector<shared::Counts>{needed});
    bench.run(scene, model.model, model.moments1, model.moments2, kStatistics, push);
    EXPECT_NE(model.read(model.model.params).means, scene.gaussians.means);
}

/// The words that a step from zero moments packs, by the CPU reference.
std::vector<uint32_t> packed_words(const GuardedModel& exact, const shared::UpdateBlock& push) {
    const auto m = exact.moments1.read<float>(), v = exact.moments2.read<float>();
    std::vector<uint32_t> words(m.size());
    for (uint32_t i = 0; i < push.splats; ++i)
        for (uint32_t plane = 0; plane < push.planes; ++plane) {
            const auto random =
                core::pcg4d({i, push.step, push.seed[0], push.seed[1] ^ (shared::MOMENT_STREAM + plane)});
            for (uint32_t c = 0; c < 4; ++c) {
                const size_t at = pipeline::parameter_index(push.planes, 4 * plane + c, i);
                words[at] = reference::packed_moments(m[at], v[at], random[c]);
            }
        }
    return words;
}

/// Moments in 16 bits: the first step moves the parameters as with float32, and rounds the same moments.
TEST(PackedUpdate, RoundsTheMomentsAsTheReferenceDoes) {
    for (const int degree : {0, 3}) {
        const Scene scene = random_scene(1910 + uint64_t(degree), 200, SplatKind::mixed, 61, 47, degree);
        const Slots slots(scene);
        const auto push = push_for(scene, 7);
        GuardedModel exact(scene.gaussians), packed(scene.gaussians);
        Bench bench(slots);
        bench.run(scene, exact.model, exact.moments1, exact.moments2, 0, push);
        bench.run(scene, packed.model, packed.moments1, packed.moments2, kPacked, push);
        expect_intact({&packed.moments1, &packed.moments2});
        for (const uint32_t word : packed.moments2.read<uint32_t>()) ASSERT_EQ(word, 0u);
        const Gaussians a = exact.read(exact.model.params), b = packed.read(packed.model.params);
        EXPECT_EQ(a.means, b.means);
        EXPECT_EQ(a.sh, b.sh);
        const auto words = packed.moments1.read<uint32_t>(), expected = packed_words(exact, push);
        size_t other = 0, set = 0;
        for (size_t f = 0; f < words.size(); ++f) {
            ASSERT_EQ(words[f] >> 16, expected[f] >> 16) << f;
            // A device's square root may be off by some units of float32.
            ASSERT_LE(std::abs(int(words[f] & 0xffffu) - int(expected[f] & 0xffffu)), 1) << f;
            other += words[f] != expected[f];
            set += words[f] != 0;
        }
        EXPECT_LE(other, words.size() / 200);
        EXPECT_GT(set, words.size() / 4);
    }
}

/// Over many steps with one gradient, packed moments follow those in float32, with no bias.
TEST(PackedUpdate, FollowsTheFloatMomentsOverManySteps) {
    const Scene scene = random_scene(1912, 150, SplatKind::ordinary, 61, 47);
    const Slots slots(scene);
    GuardedModel exact(scene.gaussians), packed(scene.gaussians);
    Bench bench(slots);
    for (uint32_t step = 1; step <= 40; ++step) {
        auto push = push_for(scene, step);
        for (float* rate : {&push.mean_rate, &push.opacity_rate, &push.quaternion_rate, &push.scale_rate,
                            &push.sh0_rate, &push.sh_rest_rate})
            *rate = 0;  // the gradient stays as it is
        bench.run(scene, exact.model, exact.moments1, exact.moments2, 0, push);
        bench.run(scene, packed.model, packed.moments1, packed.moments2, kPacked, push);
    }
    const auto m = exact.moments1.read<float>(), v = exact.moments2.read<float>();
    const auto words = packed.moments1.read<uint32_t>();
    double first = 0, root = 0, first_squares = 0, root_squares = 0;
    size_t count = 0;
    for (size_t f = 0; f < words.size(); ++f) {
        if (v[f] < 1e-34f) continue;  // no gradient, or one whose root is rounded to zero
        const reference::AdamMoments back = reference::unpacked_moments(words[f]);
        const double a = back.first / double(m[f]) - 1, b = std::sqrt(back.second / double(v[f])) - 1;
        first += a;
        root += b;
        first_squares += a * a;
        root_squares += b * b;
        ++count;
    }
    ASSERT_GT(count, 500u);
    const double n = double(count);
    printf("    first moment: mean error %.1e, rms %.1e; root of the second: %.1e, %.1e\n", first / n,
           std::sqrt(first_squares / n), root / n, std::sqrt(root_squares / n));
    // Steps of 2^-7 and 2^-9; each step adds an error of up to half of them, and forgets 0.1 or 0.001 of the old ones.
    EXPECT_LT(std::sqrt(first_squares / n), std::ldexp(1.5, -7));
    EXPECT_LT(std::sqrt(root_squares / n), std::ldexp(4.0, -9));
    EXPECT_LT(std::abs(first), 5 * std::sqrt(first_squares));
    EXPECT_LT(std::abs(root), 5 * std::sqrt(root_squares));
}

TEST(PackedUpdate, RoundsOtherwiseInAnotherStepAndSeedAndTheSameAgain) {
    const Scene scene = random_scene(1913, 60, SplatKind::ordinary, 61, 47);
    const Slots slots(scene);
    const auto words = [&](const shared::UpdateBlock& push) {
        GuardedModel model(scene.gaussians);
        Bench bench(slots);
        bench.run(scene, model.model, model.moments1, model.moments2, kPacked, push);
        return model.moments1.read<uint32_t>();
    };
    const auto push = push_for(scene, 3);
    auto step = push, low = push, high = push;
    ++step.step;
    ++low.seed[0];
    ++high.seed[1];
    EXPECT_EQ(words(push), words(push));
    for (const auto& other : {step, low, high}) EXPECT_NE(words(push), words(other));
}

/// A lower degree evaluated than stored: the coefficients above stay as they are.
TEST(UpdateEdges, CoefficientsAboveTheDegreeInUseStay) {
    Scene scene = random_scene(1904, 60, SplatKind::ordinary, 61, 47, 3);
    scene.options.sh_degree = 1;
    const Slots slots(scene);
    GuardedModel model(scene.gaussians), gradient(scene.gaussians);
    Bench bench(slots);
    bench.run(scene, model.model, gradient.moments1, gradient.moments2, kGradient, push_for(scene, 1), 1);
    GradientTolerance tolerance{1e-8, 5e-5, 1e-3, 2e-5};  // as above
    EXPECT_TRUE(splat_gradients_agree(gradient.read(gradient.moments1), slots.cpu.gradient, tolerance));
    bench.run(scene, model.model, model.moments1, model.moments2, 0, push_for(scene, 1), 1);
    const Gaussians now = model.read(model.model.params);
    const size_t stride = now.sh_stride();
    size_t moved = 0;
    for (size_t i = 0; i < now.sh.size(); ++i) {
        const bool changed = now.sh[i] != scene.gaussians.sh[i];
        EXPECT_FALSE(changed && i % stride >= 12) << i;
        moved += changed;
    }
    EXPECT_GT(moved, 100u);
}

/// What the CPU reference's Adam and the rule of docs/numerics.md ("Steps") make of one value's texel.
struct Limited {
    std::array<double, 4> value{};
    bool limited = false;
};
Limited limited_step(const std::array<double, 4>& from, const std::array<double, 4>& to, int used,
                     double most) {
    double square = 0;
    for (size_t k = 0; k < size_t(used); ++k) square += (to[k] - from[k]) * (to[k] - from[k]);
    const double longest = std::sqrt(square);
    if (!(longest > most)) return {to, false};
    Limited result{from, true};
    for (size_t k = 0; k < size_t(used); ++k) result.value[k] += (to[k] - from[k]) * most / longest;
    return result;
}

/// Steps of all sizes about the bound: half a splat's depth for its mean, half a quaternion's norm.
TEST(UpdateLimits, StepsEndWhereTheRuleSays) {
    const Scene scene = random_scene(1905, 120, SplatKind::ordinary, 61, 47);
    const Slots slots(scene);
    const Gaussians& start = scene.gaussians;
    GuardedModel model(start), gradient(start);
    Bench bench(slots);
    auto push = push_for(scene, 1);
    push.mean_rate = 2.0f;  // depths are about 4: some steps are within half of them, some not
    push.quaternion_rate = 0.4f;
    bench.run(scene, model.model, gradient.moments1, gradient.moments2, kGradient, push);
    const Gaussians g = gradient.read(gradient.moments1);
    bench.run(scene, model.model, model.moments1, model.moments2, 0, push);
    const Gaussians now = model.read(model.model.params);
    reference::AdamState of_means(start.means.size()), of_quaternions(start.quaternions.size());
    std::vector<double> means = wide(start.means), quaternions = wide(start.quaternions);
    adam_step(means, wide(g.means), of_means, push.mean_rate, 1);
    adam_step(quaternions, wide(g.quaternions), of_quaternions, push.quaternion_rate, 1);
    uint32_t limited = 0, free = 0;
    for (size_t i = 0; i < start.size(); ++i) {
        if (slots.tile_counts[i] == 0) continue;
        std::array<double, 4> from{}, to{}, turned{}, turned_to{};
        double largest = 0;
        for (size_t k = 0; k < 3; ++k) from[k] = start.means[3 * i + k], to[k] = means[3 * i + k];
        for (size_t k = 0; k < 4; ++k) {
            turned[k] = start.quaternions[4 * i + k];
            turned_to[k] = quaternions[4 * i + k];
            largest = std::max(largest, std::abs(turned[k]));
        }
        const double depth = slots.cpu.rendered.projected[i].z;
        const Limited mean = limited_step(from, to, 3, 0.5 * depth),
                      quaternion = limited_step(turned, turned_to, 4, 0.5 * largest);
        limited += mean.limited + quaternion.limited;
        free += !mean.limited + !quaternion.limited;
        for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(now.means[3 * i + k], mean.value[k], 1e-4 * depth) << i;
        for (size_t k = 0; k < 4; ++k)
            EXPECT_NEAR(now.quaternions[4 * i + k], quaternion.value[k], 1e-4 * largest) << i;
    }
    EXPECT_EQ(bench.counts.read<shared::Counts>()[0].limited_steps, limited);
    EXPECT_GT(limited, 20u);
    EXPECT_GT(free, 20u);
}

/// A scale ends at the borders; one that is outside already goes no further, and is not brought in.
TEST(UpdateLimits, ScalesStayWithinTheirBorders) {
    Scene scene = random_scene(1906, 120, SplatKind::ordinary, 61, 47);
    for (size_t k = 0; k < 3; ++k) scene.gaussians.log_scales[k] = -80;
    const Slots slots(scene);
    const Gaussians& start = scene.gaussians;
    GuardedModel model(start);
    Bench bench(slots);
    auto push = push_for(scene, 1);
    push.scale_rate = 200;
    bench.run(scene, model.model, model.moments1, model.moments2, 0, push);
    const Gaussians now = model.read(model.model.params);
    std::set<float> ends;
    for (size_t i = 1; i < start.size(); ++i)
        for (size_t k = 0; k < 3; ++k)
            if (const float s = now.log_scales[3 * i + k]; s != start.log_scales[3 * i + k]) ends.insert(s);
    EXPECT_EQ(ends, (std::set<float>{float(shared::LOG_SCALE_MIN), float(shared::LOG_SCALE_MAX)}));
    for (size_t k = 0; k < 3; ++k) EXPECT_EQ(now.log_scales[k], -80);
    uint32_t limited = 0;
    for (size_t i = 1; i < start.size(); ++i) limited += slots.tile_counts[i] > 0;
    EXPECT_EQ(bench.counts.read<shared::Counts>()[0].limited_steps, limited);

    // Each border alone.
    Scene one_way = scene;
    for (const float sign : {1.0f, -1.0f}) {
        GuardedModel pulled(start);
        Bench again(slots);
        push.scale_weight = sign * 1e9f;  // down, or up
        again.run(one_way, pulled.model, pulled.moments1, pulled.moments2, kRegularised, push);
        const Gaussians after = pulled.read(pulled.model.params);
        for (size_t i = 3; i < after.log_scales.size(); ++i)
            EXPECT_EQ(after.log_scales[i],
                      sign > 0 ? float(shared::LOG_SCALE_MIN) : float(shared::LOG_SCALE_MAX))
                << i;
    }
}

}  // namespace
}  // namespace ewa::test
