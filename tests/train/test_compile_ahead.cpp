// SPDX-License-Identifier: Apache-2.0
// Kernels that a GPU compiles before a training step needs them.
#include <gtest/gtest.h>

#include <memory>

#include "ewa/trainer.h"
#include "gpu/pipeline.h"
#include "gpu/test_device.h"
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

}  // namespace
}  // namespace ewa::test
