// SPDX-License-Identifier: Apache-2.0
// What the tests of divided trainings share: captures with first splats, and a training by ranks, within a limit of memory, or both.
#pragma once
#include <gtest/gtest.h>

#include <cstring>
#include <optional>

#include "ewa/trainer.h"
#include "gpu/test_device.h"
#include "support/thread_ranks.h"
#include "train/synthetic.h"

namespace ewa::test {

inline constexpr uint64_t kMiB = uint64_t(1) << 20;

/// 300 splats, moved from where they are, and some with little opacity.
inline Gaussians divided_start() {
    Gaussians splats = seven_views().truth;
    for (size_t i = 0; i < splats.size(); ++i) {
        splats.means[3 * i] += 0.05f;
        splats.opacity_logits[i] = i % 5 == 0 ? -3.0f : -1.0f;
    }
    return splats;
}

/// Splats of which the cameras see one in twenty: the others are far above and below.
inline Gaussians tall_scene(size_t splats) {
    Random random(5);
    Gaussians g;
    g.sh_degree = 3;
    g.resize(splats);
    for (size_t i = 0; i < splats; ++i) {
        const bool seen = i % 20 == 0;
        g.means[3 * i] = float(random.uniform(-1, 1));
        g.means[3 * i + 1] = float(random.uniform(-1, 1)) + (seen ? 0.0f : i % 2 == 0 ? 30.0f : -30.0f);
        g.means[3 * i + 2] = float(random.uniform(-1, 1));
        for (size_t k = 0; k < 3; ++k) g.log_scales[3 * i + k] = float(std::log(random.uniform(0.03, 0.1)));
        for (size_t k = 0; k < 4; ++k) g.quaternions[4 * i + k] = float(random.normal());
        for (size_t k = 0; k < g.sh_stride(); ++k) g.sh[g.sh_stride() * i + k] = float(random.uniform(-1, 1));
        g.opacity_logits[i] = i % 9 == 0 ? -3.0f : -1.0f;
    }
    return g;
}

/// Of a tall scene: densifies, resets and relocates within some tens of steps.
inline TrainOptions busy_chunks(Strategy strategy, int batch) {
    TrainOptions options = busy(strategy, batch);
    options.steps = 36;
    options.sh_degree = 3;
    options.max_splats = 28000;
    options.dead_opacity = 0.06;
    options.opacity_reset_every = 25;
    options.noise_rate = 2e4;  // as much as usual: the others stay out of sight
    // With mcmc the opacity of what no camera sees falls. It should not all die and move to where it is seen.
    if (strategy == Strategy::mcmc) options.opacity_rate = 0.02;
    return options;
}

/// The capture of seven_views() with a mask that excludes columns of each image, and rows of some.
inline const Dataset& masked_capture() {
    static const Dataset* const made = [] {
        static Synthetic data;
        make_synthetic(data, 300, 7, 64, 48, 11);
        std::filesystem::create_directories(data.folder / "masks");
        for (size_t i = 0; i < data.dataset.frames.size(); ++i) {
            Image mask(64, 48, 3);
            for (int y = 0; y < 48; ++y)
                for (int x = 0; x < 64; ++x)
                    for (int c = 0; c < 3; ++c)
                        mask.at(x, y)[c] = (x >= 18 && x < 28) || (i % 3 == 1 && y >= 20) ? 0.0f : 1.0f;
            save_image(data.folder / "masks" / data.dataset.frames[i].name, mask);
        }
        return new Dataset(load_dataset(data.folder.path(), {}));
    }();
    return *made;
}

struct DividedBy {
    int ranks = 1;
    uint64_t limit = 0;   // bytes of the device's memory; 0: none
    bool staged = false;  // the host cannot map the device's memory
};

struct DividedResult {
    TrainerState state;
    uint64_t peak = 0;  // bytes on the device of the first rank
    std::optional<ChunkFigures> chunks;
    Gaussians splats;
};

struct EditAt {
    int step;
    SplatEdit edit;
};

/// Trains so many steps. resume: where the training begins. edited: what is edited, and after which step.
inline DividedResult train_divided(TrainOptions options, const Gaussians& start, const DividedBy& by,
                                   int until, const Dataset& dataset = seven_views().dataset,
                                   const TrainerState* resume = nullptr, const EditAt* edited = nullptr) {
    options.device_memory_bytes = by.limit;
    DividedResult result;
    run_ranks(by.ranks, [&](std::shared_ptr<Ranks> group) {
        const auto device = open_test_device(false);
        if (by.staged) device->limit_host_access(gpu::HostAccess::none);
        Trainer trainer(device, dataset, all_frames(dataset), start, options, group);
        if (group->rank() != 0) return trainer.follow();
        if (resume) trainer.restore(*resume);
        while (trainer.steps_done() < until) {
            trainer.step();
            if (edited && trainer.steps_done() == edited->step) trainer.edit(edited->edit);
        }
        trainer.keep_waiting();
        result.state = trainer.state();
        result.peak = peak_device_bytes(*device);
        result.chunks = trainer.chunk_figures();
        result.splats = trainer.gaussians();
        EXPECT_EQ(result.splats.size(), trainer.splats());
        float first;
        std::memcpy(&first, result.state.arrays.front().bytes.data(), sizeof(first));
        EXPECT_EQ(result.splats.means.front(), first);
    });
    return result;
}

/// Every byte of the state, the report of the last step and the splats.
inline void expect_same(const DividedResult& a, const DividedResult& b) {
    EXPECT_EQ(a.state.report.step, b.state.report.step);
    EXPECT_EQ(a.state.report.splats, b.state.report.splats);
    EXPECT_EQ(a.state.report.loss, b.state.report.loss);
    EXPECT_EQ(a.state.report.psnr, b.state.report.psnr);
    EXPECT_EQ(a.state.report.limited_steps, b.state.report.limited_steps);
    EXPECT_EQ(a.state.report.dropped_updates, b.state.report.dropped_updates);
    EXPECT_EQ(a.state.report.skipped_nonfinite, b.state.report.skipped_nonfinite);
    ASSERT_EQ(a.state.arrays.size(), b.state.arrays.size());
    for (size_t i = 0; i < a.state.arrays.size(); ++i) {
        EXPECT_EQ(a.state.arrays[i].name, b.state.arrays[i].name);
        EXPECT_TRUE(a.state.arrays[i].bytes == b.state.arrays[i].bytes) << a.state.arrays[i].name;
    }
    EXPECT_EQ(a.splats.means, b.splats.means);
    EXPECT_EQ(a.splats.sh, b.splats.sh);
}

}  // namespace ewa::test
