// SPDX-License-Identifier: Apache-2.0
// The same bytes however a training is divided: by ranks, by parts that are streamed to the device, or both.
#include <gtest/gtest.h>

#include <cstdlib>

#include "train/divided.h"

namespace ewa::test {
namespace {

struct Change {
    const char* name;
    void (*apply)(TrainOptions&);
};
const Change kWide{"wide", [](TrainOptions& o) { o.moment_bits = 32; }};
const Change kAbsolute{"absolute_density", [](TrainOptions& o) {
                           o.absolute_gradients = true;
                           o.render.kernel = Footprint::density;
                           o.grow_gradient_absolute = 1e-5;
                       }};
const Change kDensity{"density", [](TrainOptions& o) { o.render.kernel = Footprint::density; }};
const Change kAntialiased{"antialiased", [](TrainOptions& o) {
                              o.render.kernel = Footprint::antialias;
                              o.random_background = true;
                          }};
const Change kFromDisk{"from_disk", [](TrainOptions& o) {
                           o.image_cache_bytes = 0;
                           o.halvings = 1;
                       }};
const Change kExposure{"exposure", [](TrainOptions& o) { o.appearance = AppearanceModel::affine; }};
const Change kPpisp{"ppisp", [](TrainOptions& o) { o.appearance = AppearanceModel::ppisp; }};
const Change kGrid{"grid", [](TrainOptions& o) { o.appearance = AppearanceModel::grid; }};
const Change kSky{"sky", [](TrainOptions& o) { o.sky = true; }};
const Change kSquares{"squares", [](TrainOptions& o) { o.loss = {0.5, 2, 0.1}; }};
const Change kWithoutSsim{"without_ssim", [](TrainOptions& o) { o.loss = {1, 0, 0}; }};
const Change kFewer{"fewer", [](TrainOptions& o) {
                        const bool tall = o.max_splats > 1000;
                        o.final_splats = !tall ? 250 : o.strategy == Strategy::mcmc ? 24000 : 18000;
                    }};
const Change kTwoBands{"bands2", [](TrainOptions& o) { o.bands = 2; }};
const Change kThreeBands{"bands3", [](TrainOptions& o) { o.bands = 3; }};
const Change kSeventeenSteps{"of_17", [](TrainOptions& o) { o.steps = 17; }};  // the last one is smaller

struct DividedCase {
    Strategy strategy;
    int batch;
    std::vector<Change> changes;
    std::vector<DividedBy> by;
};

std::string name_of_case(const testing::TestParamInfo<DividedCase>& tested) {
    const char* names[] = {"none", "adc", "mcmc"};
    std::string name = names[int(tested.param.strategy)];
    for (const Change& change : tested.param.changes) name += std::string("_") + change.name;
    return name + "_batch" + std::to_string(tested.param.batch);
}

TrainOptions with_changes(TrainOptions options, const DividedCase& what) {
    for (const Change& change : what.changes) change.apply(options);
    return options;
}

/// An undivided training, whose number of splats changes unless it is to stay.
DividedResult undivided(const TrainOptions& options, const Gaussians& start, const DividedBy& by,
                        const Dataset& dataset) {
    const DividedResult whole = train_divided(options, start, by, options.steps, dataset);
    EXPECT_EQ(whole.state.report.step, options.steps);
    const bool fewer = options.final_splats != 0 && options.final_splats != kAutomaticFinalSplats;
    EXPECT_EQ(whole.splats.size() == start.size(), options.strategy == Strategy::none && !fewer)
        << "the number of splats should change";
    return whole;
}

class ByRanks : public testing::TestWithParam<DividedCase> {};
class OfMaskedImages : public ByRanks {};

void expect_same_by_ranks(const DividedCase& what, const Dataset& dataset) {
    const TrainOptions options = with_changes(busy(what.strategy, what.batch), what);
    const DividedResult whole = undivided(options, divided_start(), {}, dataset);
    for (const DividedBy& by : what.by) {
        SCOPED_TRACE(std::to_string(by.ranks) + " ranks");
        expect_same(train_divided(options, divided_start(), by, options.steps, dataset), whole);
    }
}

TEST_P(ByRanks, HasTheBytesOfOneRank) {
    expect_same_by_ranks(GetParam(), seven_views().dataset);
}
TEST_P(OfMaskedImages, HasTheBytesOfOneRank) {
    expect_same_by_ranks(GetParam(), masked_capture());
}

constexpr Strategy kNone = Strategy::none, kAdc = Strategy::adc, kMcmc = Strategy::mcmc;

INSTANTIATE_TEST_SUITE_P(
    Divided, ByRanks,
    testing::Values(
        DividedCase{kAdc, 4, {}, {{2}, {3}}}, DividedCase{kAdc, 3, {}, {{5}}},
        DividedCase{kAdc, 1, {}, {{2}}}, DividedCase{kAdc, 2, {kWide}, {{2}}},
        DividedCase{kAdc, 1, {kAbsolute}, {{2}}}, DividedCase{kAdc, 2, {kAntialiased}, {{3}}},
        DividedCase{kMcmc, 4, {}, {{2}}}, DividedCase{kMcmc, 3, {}, {{4}}}, DividedCase{kMcmc, 1, {}, {{3}}},
        DividedCase{kMcmc, 2, {kWide}, {{2}}}, DividedCase{kMcmc, 2, {kAbsolute}, {{3}}},
        DividedCase{kNone, 2, {}, {{2}}}, DividedCase{kAdc, 4, {kExposure}, {{3}}},
        DividedCase{kMcmc, 1, {kExposure}, {{2}}}, DividedCase{kAdc, 3, {kPpisp}, {{2}}},
        DividedCase{kMcmc, 1, {kPpisp}, {{2}}}, DividedCase{kMcmc, 2, {kGrid}, {{3}}},
        DividedCase{kAdc, 2, {kSquares, kTwoBands}, {{3}}}, DividedCase{kMcmc, 2, {kWithoutSsim}, {{2}}},
        DividedCase{kAdc, 3, {kSky}, {{2}}}, DividedCase{kMcmc, 1, {kSky}, {{2}}},
        DividedCase{kMcmc, 2, {kSky, kPpisp}, {{3}}}, DividedCase{kNone, 1, {kWide}, {{4}}},
        DividedCase{kAdc, 1, {kFewer}, {{2}}}, DividedCase{kNone, 3, {kFewer}, {{3}}},
        DividedCase{kMcmc, 2, {kTwoBands, kDensity, kFewer}, {{4}}}, DividedCase{kAdc, 1, {kTwoBands}, {{2}}},
        DividedCase{kAdc, 2, {kTwoBands}, {{3}}}, DividedCase{kAdc, 1, {kThreeBands}, {{5}}},
        DividedCase{kAdc, 1, {kTwoBands, kAbsolute}, {{3}}}, DividedCase{kMcmc, 1, {kThreeBands}, {{4}}},
        DividedCase{kMcmc, 3, {kThreeBands}, {{2}}}, DividedCase{kMcmc, 4, {kTwoBands}, {{8}}},
        DividedCase{kNone, 7, {kSeventeenSteps}, {{2}}}),
    name_of_case);

INSTANTIATE_TEST_SUITE_P(Divided, OfMaskedImages, testing::Values(DividedCase{kAdc, 2, {kThreeBands}, {{4}}}),
                         name_of_case);

/// Of a scene that is larger than the device.
class ByChunks : public testing::TestWithParam<DividedCase> {};

constexpr uint64_t kQuarter = 1;  // as the limit: a quarter of the state

uint64_t state_bytes(const TrainerState& state) {
    uint64_t bytes = 0;
    for (const TrainerArray& array : state.arrays)
        if (!array.name.starts_with("exp") && !array.name.starts_with("app") &&
            !array.name.starts_with("sky"))
            bytes += array.bytes.size();
    return bytes;
}

TEST_P(ByChunks, HasTheBytesOfOneThatFits) {
    const DividedCase& what = GetParam();
    const TrainOptions options = with_changes(busy_chunks(what.strategy, what.batch), what);
    // One chunk holds all that mcmc adds until the chunks are level.
    const Gaussians start = tall_scene(what.strategy == kNone   ? 28000
                                       : what.strategy == kMcmc ? 26500
                                                                : 20000);
    // With kernels of a GPU, a step of one view that is not in chunks has a kernel that rounds in another order.
    const bool other_kernel = options.batch == 1 && options.bands == 1 && std::getenv("EWA_TEST_KERNELS");
    const DividedBy fits{.limit = other_kernel ? 9 * kMiB : 0};
    const DividedResult whole = undivided(options, start, fits, seven_views().dataset);
    EXPECT_EQ(bool(whole.chunks), other_kernel);
    for (DividedBy by : what.by) {
        SCOPED_TRACE(std::to_string(by.ranks) + " ranks, limit " + std::to_string(by.limit));
        const bool quarter = by.limit == kQuarter;
        if (quarter) by.limit = state_bytes(whole.state) / 4;
        const DividedResult divided = train_divided(options, start, by, options.steps);
        ASSERT_TRUE(divided.chunks);
        EXPECT_LE(divided.peak, by.limit);
        if (quarter) {
            EXPECT_GE(divided.chunks->chunks, 4);
            EXPECT_EQ(divided.chunks->state_bytes, state_bytes(whole.state));
            EXPECT_GT(divided.chunks->streamed_bytes, double(by.limit))
                << "no splats should have left the device";
        }
        expect_same(divided, whole);
    }
}

const DividedBy kStreamed{.limit = kQuarter}, kByTwoStreamed{.ranks = 2, .limit = 3 * kMiB};

INSTANTIATE_TEST_SUITE_P(
    Divided, ByChunks,
    testing::Values(DividedCase{kAdc, 1, {}, {kStreamed}}, DividedCase{kAdc, 3, {}, {kStreamed}},
                    DividedCase{kMcmc, 1, {}, {kStreamed}}, DividedCase{kMcmc, 3, {}, {kStreamed}},
                    DividedCase{kNone, 1, {}, {kStreamed}}, DividedCase{kMcmc, 2, {kWide}, {kStreamed}},
                    DividedCase{kAdc, 1, {kAbsolute}, {kStreamed}},
                    DividedCase{kAdc, 2, {kFromDisk}, {kStreamed}},
                    DividedCase{kAdc, 2, {kExposure}, {kStreamed}},
                    DividedCase{kAdc, 2, {kPpisp}, {kStreamed}}, DividedCase{kAdc, 2, {kSky}, {kStreamed}},
                    DividedCase{kAdc, 1, {kFewer}, {kStreamed}}, DividedCase{kMcmc, 2, {kFewer}, {kStreamed}},
                    DividedCase{kAdc, 1, {kTwoBands}, {kStreamed, kByTwoStreamed}},
                    DividedCase{kMcmc, 1, {kTwoBands}, {kByTwoStreamed}}),
    name_of_case);

}  // namespace
}  // namespace ewa::test
