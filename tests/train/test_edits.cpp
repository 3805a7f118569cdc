// SPDX-License-Identifier: Apache-2.0
// Edits of the splats of a training that runs: removed ones, frozen ones, and what the others keep.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "portions/portions.h"
#include "train/checkpoint.h"
#include "train/divided.h"
#include "train/state_edit.h"

namespace ewa::test {
namespace {

using Bytes = std::vector<std::byte>;

std::unique_ptr<Trainer> edited_trainer(const TrainOptions& options) {
    return std::make_unique<Trainer>(device(), seven_views().dataset, all_frames(seven_views().dataset),
                                     divided_start(), options);
}

void train_until(Trainer& trainer, int steps) {
    while (trainer.steps_done() < steps) trainer.step();
}

const Bytes& bytes_of(const TrainerState& state, const std::string& name) {
    const auto found = std::ranges::find(state.arrays, name, &TrainerArray::name);
    EXPECT_NE(found, state.arrays.end()) << name;
    return found->bytes;
}

/// The texels of splat i in an array with the layout of the parameters.
Bytes texels_of(const TrainerState& state, const std::string& name, size_t i) {
    const uint32_t planes = pipeline::parameter_planes(state.sh_degree);
    Bytes texels(planes * portions::kTexelBytes);
    portions::pack_splat(bytes_of(state, name).data(), planes, i, texels.data());
    return texels;
}

/// The parameters of all splats that are frozen, or of all others, in order.
Bytes params_of(const TrainerState& state, bool frozen) {
    const uint32_t planes = pipeline::parameter_planes(state.sh_degree);
    Bytes all;
    for (size_t i = 0; i < state.report.splats; ++i) {
        if (train::is_frozen(bytes_of(state, "moments1"), planes, i) != frozen) continue;
        const Bytes texels = texels_of(state, "params", i);
        all.insert(all.end(), texels.begin(), texels.end());
    }
    return all;
}

void expect_same_arrays(const TrainerState& a, const TrainerState& b) {
    EXPECT_EQ(a.report.splats, b.report.splats);
    EXPECT_EQ(a.report.dropped_updates, b.report.dropped_updates);
    ASSERT_EQ(a.arrays.size(), b.arrays.size());
    for (size_t k = 0; k < a.arrays.size(); ++k) {
        EXPECT_EQ(a.arrays[k].name, b.arrays[k].name);
        EXPECT_TRUE(a.arrays[k].bytes == b.arrays[k].bytes) << a.arrays[k].name;
    }
}

/// Every n-th of the first 200 splats, from `first` on.
std::vector<uint32_t> every_nth(uint32_t n, uint32_t first) {
    std::vector<uint32_t> indices;
    for (uint32_t i = first; i < 200; i += n) indices.push_back(i);
    return indices;
}

struct EditCase {
    Strategy strategy;
    int bits;
};
class Edits : public testing::TestWithParam<EditCase> {
  protected:
    static TrainOptions options() {
        TrainOptions options = busy(GetParam().strategy, 1);
        options.steps = 70;
        options.moment_bits = GetParam().bits;
        return options;
    }
};
std::string name_of_edit(const testing::TestParamInfo<EditCase>& tested) {
    constexpr const char* kNames[] = {"none", "adc", "mcmc"};
    return std::string(kNames[int(tested.param.strategy)]) + std::to_string(tested.param.bits);
}
INSTANTIATE_TEST_SUITE_P(All, Edits,
                         testing::Values(EditCase{Strategy::none, 16}, EditCase{Strategy::adc, 16},
                                         EditCase{Strategy::adc, 32}, EditCase{Strategy::mcmc, 16},
                                         EditCase{Strategy::mcmc, 32}),
                         name_of_edit);

TEST_P(Edits, LeaveTheOthersAsTheyAre) {
    const auto trainer = edited_trainer(options());
    train_until(*trainer, 15);
    const TrainerState before = trainer->state();
    Gaussians expected = trainer->gaussians();
    std::vector<uint32_t> removed = every_nth(4, 1), kept;
    const std::set<uint32_t> gone(removed.begin(), removed.end());
    for (uint32_t i = 0; i < before.report.splats; ++i)
        if (!gone.contains(i)) kept.push_back(i);
    std::ranges::reverse(removed);
    removed.push_back(removed.front());
    EXPECT_EQ(trainer->edit({.remove = removed}).removed, gone.size());

    const TrainerState after = trainer->state();
    ASSERT_EQ(after.report.splats, kept.size());
    EXPECT_EQ(trainer->splats(), kept.size());
    EXPECT_EQ(trainer->report().splats, kept.size());
    ASSERT_EQ(after.arrays.size(), before.arrays.size());
    for (const TrainerArray& array : after.arrays) {
        const Bytes& old = bytes_of(before, array.name);
        for (size_t i = 0; i < kept.size(); ++i) {
            if (array.name == "statistics") {
                ASSERT_TRUE(
                    std::equal(&array.bytes[8 * i], &array.bytes[8 * i] + 8, &old[8 * size_t(kept[i])]));
            } else {
                ASSERT_EQ(texels_of(after, array.name, i), texels_of(before, array.name, kept[i]));
            }
        }
    }
    keep_splats(expected, kept);
    EXPECT_EQ(trainer->gaussians().means, expected.means);
    EXPECT_EQ(trainer->gaussians().sh, expected.sh);

    // A trainer that restores the state goes on in the same way.
    const auto other = edited_trainer(options());
    other->restore(after);
    train_until(*trainer, 70);
    train_until(*other, 70);
    expect_same_arrays(trainer->state(), other->state());
    EXPECT_NE(params_of(trainer->state(), false), params_of(after, false));
}

TEST_P(Edits, FrozenSplatsKeepTheirBytes) {
    const auto trainer = edited_trainer(options());
    train_until(*trainer, 12);
    const EditCounts counts = trainer->edit({.remove = {0}, .freeze = every_nth(3, 1)});
    EXPECT_EQ(counts.removed, 1u);
    EXPECT_EQ(counts.frozen, every_nth(3, 1).size());
    EXPECT_EQ(trainer->frozen_splats(), counts.frozen);
    const std::vector<bool> frozen = trainer->frozen();
    ASSERT_EQ(frozen.size(), trainer->splats());
    for (size_t i = 0; i < frozen.size(); ++i)
        EXPECT_EQ(frozen[i], i < 199 && i % 3 == 0) << "a splat before it was removed: " << i;
    const TrainerState begin = trainer->state();
    const uint32_t planes = pipeline::parameter_planes(begin.sh_degree);
    ASSERT_EQ(params_of(begin, true).size(), counts.frozen * planes * portions::kTexelBytes);

    train_until(*trainer, 40);
    TempFolder folder;
    write_checkpoint(folder / "c.ewa", train::Checkpoint{"{}", "", 0, trainer->state()});
    const auto resumed = edited_trainer(options());
    resumed->restore(train::read_checkpoint(folder / "c.ewa").state);
    EXPECT_EQ(resumed->frozen_splats(), counts.frozen);

    train_until(*trainer, 70);  // after refinements and an opacity reset
    train_until(*resumed, 70);
    const TrainerState end = trainer->state();
    EXPECT_TRUE(params_of(end, true) == params_of(begin, true));
    EXPECT_EQ(train::count_frozen(bytes_of(end, "moments1"), planes), counts.frozen);
    EXPECT_FALSE(params_of(end, false) == params_of(begin, false));
    if (GetParam().strategy != Strategy::none) {
        EXPECT_NE(end.report.splats, begin.report.splats);
    }
    EXPECT_EQ(end.report.dropped_updates, 0u);
    expect_same_arrays(resumed->state(), end);
}

TEST(EditedTrainer, UnfrozenSplatsLearnAgain) {
    const auto trainer = edited_trainer(busy(Strategy::none, 1));
    train_until(*trainer, 5);
    const std::vector<uint32_t> some = every_nth(2, 0);
    EXPECT_TRUE(trainer->frozen().empty());
    EXPECT_EQ(trainer->edit({.freeze = some}).frozen, some.size());
    EXPECT_EQ(trainer->edit({.freeze = some}).frozen, 0u) << "they are already";
    train_until(*trainer, 10);
    const TrainerState frozen = trainer->state();
    const EditCounts counts = trainer->edit({.freeze = {4}, .unfreeze = {2, 4, 6, 7}});
    EXPECT_EQ(counts.unfrozen, 2u) << "7 is not frozen, and 4 stays so";
    EXPECT_EQ(counts.frozen, 0u);
    EXPECT_EQ(trainer->frozen_splats(), some.size() - 2);
    EXPECT_EQ(texels_of(trainer->state(), "moments1", 2), Bytes(texels_of(frozen, "moments1", 2).size()));
    train_until(*trainer, 20);
    const TrainerState after = trainer->state();
    for (const size_t i : {2, 6}) EXPECT_NE(texels_of(after, "params", i), texels_of(frozen, "params", i));
    for (const size_t i : {0, 4}) EXPECT_EQ(texels_of(after, "params", i), texels_of(frozen, "params", i));
    EXPECT_EQ(after.report.dropped_updates, 0u);
}

TEST(EditedTrainer, RefusesWhatDoesNotFit) {
    const auto trainer = edited_trainer(busy(Strategy::mcmc, 1));
    train_until(*trainer, 3);
    const TrainerState before = trainer->state();
    const uint32_t splats = trainer->splats();
    std::vector<uint32_t> all(splats);
    for (uint32_t i = 0; i < splats; ++i) all[i] = i;
    expect_error<InputError>([&] { trainer->edit({.remove = all}); }, {"would remove all 300 splats"});
    expect_error<InputError>([&] { trainer->edit({.freeze = {1, splats}}); }, {"splat 300 of 300"});
    expect_same_arrays(trainer->state(), before);
    trainer->edit({});
    expect_same_arrays(trainer->state(), before);
    train_until(*trainer, 5);
}

/// Those that no camera sees would be the first to go.
TEST(EditedTrainer, FinalSplatsKeepsFrozenOnes) {
    TrainOptions options = quick(60);
    options.final_splats = 20;
    Gaussians start = shaken_start(small_capture(), 0.05, 1, 0);
    for (size_t i = 0; i < 5; ++i) start.means[3 * i + 1] += 50;
    const auto far_at_end = [&](bool freeze) {
        Trainer trainer(device(), small_capture().dataset, all_frames(small_capture().dataset), start,
                        options);
        train_until(trainer, 10);
        const auto far = [&] {
            std::vector<uint32_t> indices;
            const Gaussians now = trainer.gaussians();
            for (uint32_t i = 0; i < now.size(); ++i)
                if (now.world_mean(i).y > 40) indices.push_back(i);
            return indices;
        };
        EXPECT_EQ(far().size(), 5u);
        if (freeze) trainer.edit({.freeze = far()});
        train_until(trainer, 60);
        EXPECT_EQ(trainer.splats(), 20u);
        return far().size();
    };
    EXPECT_EQ(far_at_end(false), 0u);
    EXPECT_EQ(far_at_end(true), 5u);
}

/// An edit after step 14, of a training that is divided or not.
const EditAt kDividedEdit{14, {.remove = every_nth(4, 1), .freeze = every_nth(3, 0)}};

TEST(EditsByRanks, HaveTheBytesOfOneRank) {
    for (const Strategy strategy : {Strategy::adc, Strategy::mcmc}) {
        const TrainOptions options = busy(strategy, 2);
        const auto run = [&](int ranks) {
            return train_divided(options, divided_start(), {ranks}, options.steps, seven_views().dataset,
                                 nullptr, &kDividedEdit);
        };
        const DividedResult whole = run(1);
        EXPECT_GT(params_of(whole.state, true).size(), 0u);
        expect_same(run(3), whole);
    }
}

TEST(EditsByChunks, HaveTheBytesOfOneThatFits) {
    for (const Strategy strategy : {Strategy::adc, Strategy::mcmc}) {
        const TrainOptions options = busy_chunks(strategy, 2);
        // One chunk holds all that mcmc adds until the chunks are level.
        const Gaussians start = tall_scene(strategy == Strategy::mcmc ? 26500 : 20000);
        const auto run = [&](uint64_t limit) {
            return train_divided(options, start, {.limit = limit}, options.steps, seven_views().dataset,
                                 nullptr, &kDividedEdit);
        };
        const DividedResult whole = run(0), divided = run(9 * kMiB);
        EXPECT_TRUE(divided.chunks);
        EXPECT_GT(params_of(whole.state, true).size(), 0u);
        expect_same(divided, whole);
    }
}

}  // namespace
}  // namespace ewa::test
