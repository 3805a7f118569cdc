// SPDX-License-Identifier: Apache-2.0
// Kernels that are compiled before a training step needs them.
#include <gtest/gtest.h>

#include <memory>

#include "ewa/trainer.h"
#include "gpu/pipeline.h"
#include "gpu/test_device.h"
#include "run/first_kernels.h"
#include "run/option_table.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

TEST(CompileAhead, TheKernelsOfTheNextDegreeAreThereWhenItBegins) {
    const std::shared_ptr<gpu::Device> gpu = open_test_device(true);
    gpu::Limits limits = gpu->limits();
    limits.cpu = false;
    limits.max_storage_range = ~0u;
    gpu->pretend(limits);
    TrainOptions options = quick(30);
    options.sh_degree = 2;
    options.sh_degree_every = 10;
    const Gaussians start = shaken_start(small_capture(), 0.05, 1, 2);
    Trainer trainer(gpu, small_capture().dataset, all_frames(small_capture().dataset), start, options);
    const auto kernels_after = [&](int step) {
        while (trainer.step().step < step) {
        }
        return gpu->pipelines().count();
    };
    const size_t first = kernels_after(1), before = kernels_after(10), second = kernels_after(11);
    EXPECT_EQ(first, before);       // of degrees 0 and 1
    EXPECT_EQ(second, before + 2);  // project and update of degree 2
    EXPECT_EQ(second, kernels_after(30));
}

class FirstStep : public testing::TestWithParam<Strategy> {};

TEST_P(FirstStep, NeedsNoKernelThatIsNotThere) {
    const std::shared_ptr<gpu::Device> device = open_test_device(true);
    train::RunInput input;
    input.options.train = quick(30);
    input.options.train.strategy = GetParam();
    input.dataset = small_capture().dataset;
    input.split.train = all_frames(input.dataset);
    ASSERT_TRUE(train::has_plain_step(input.options));
    train::compile_kernels(*device, train::first_step(input));
    const size_t ahead = device->pipelines().count();
    EXPECT_GT(ahead, 15u);
    Trainer trainer(device, input.dataset, input.split.train, shaken_start(small_capture(), 0.05, 1, 2),
                    input.options.train);
    trainer.step();
    EXPECT_EQ(device->pipelines().count(), ahead);
}

INSTANTIATE_TEST_SUITE_P(Strategies, FirstStep,
                         testing::Values(Strategy::adc, Strategy::mcmc, Strategy::none),
                         [](const auto& strategy) { return std::string(train::name_of(strategy.param)); });

}  // namespace
}  // namespace ewa::test
