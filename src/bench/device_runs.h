// SPDX-License-Identifier: Apache-2.0
// Work that the benchmark repeats on the device: a frame or training step of a scene, and a sort.
#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "bench/result.h"
#include "bench/scene.h"
#include "ewa/device.h"
#include "gpu/executor.h"
#include "pipeline/backward.h"
#include "pipeline/frame_buffers.h"
#include "pipeline/sorting.h"

namespace ewa::bench {

class FrameRun {
  public:
    /// Uploads the scene and runs once, which sizes the instance buffers and compiles the kernels. options:
    /// by default a black background and the SH degree of the scene.
    FrameRun(std::shared_ptr<gpu::Device> device, const BenchScene& scene, bool train,
             const std::optional<RenderOptions>& options = {});

    /// Records, submits and waits for one more run.
    void run();
    /// The same work with one submission per command, each through each(name, submit).
    void run_apart(const std::function<void(const std::string&, const std::function<void()>&)>& each);
    /// Runs only the backward projection and Adam, on the gradient slots of the last run.
    void run_update();
    /// Sets Adam's learning rates. They start at zero, so that all runs do the same work on the same
    /// parameters.
    void set_rates(const pipeline::Rates& rates) { rates_ = rates; }

    const std::vector<PassTime>& timings() const { return executor_.timings(); }
    const passes::PassCache& cache() const { return cache_; }
    const pipeline::Plan& plan() const { return plan_; }
    const pipeline::Model& model() const { return model_; }
    const pipeline::FrameBuffers& frame() const { return frame_; }
    const pipeline::Sorted& sorted() const { return sorted_; }
    const Camera& camera() const { return camera_; }
    const RenderOptions& options() const { return options_; }
    const shared::Counts& counts() const { return counts_; }

    /// The splat of each sorted instance.
    std::vector<uint32_t> sorted_splats() const;
    std::vector<uint32_t> tile_starts() const;
    std::vector<float> records() const;

  private:
    void record(gpu::Recording& recording);
    gpu::Recording only(const gpu::Command& command) const;

    std::shared_ptr<gpu::Device> device_;
    passes::PassCache cache_;
    gpu::Executor executor_;
    RenderOptions options_;
    pipeline::Plan plan_;
    pipeline::Model model_;
    pipeline::FrameBuffers frame_;
    pipeline::Rates rates_;
    Camera camera_;
    gpu::Buffer camera_buffer_, photo_;
    pipeline::FrameInputs inputs_;
    pipeline::Sorted sorted_;
    shared::Counts counts_{};
    bool train_ = false;
};

/// The radix sort of random 32-bit keys, each with its index as value.
class SortRun {
  public:
    SortRun(std::shared_ptr<gpu::Device> device, uint32_t items);

    /// Copies the input and sorts the copy.
    void run();
    const pipeline::RadixCut& cut() const { return cut_; }
    const std::vector<PassTime>& timings() const { return executor_.timings(); }
    /// Compares with a stable sort on the host.
    Check check() const;

  private:
    std::shared_ptr<gpu::Device> device_;
    passes::PassCache cache_;
    gpu::Executor executor_;
    pipeline::RadixCut cut_;
    uint32_t items_;
    std::vector<uint32_t> input_;
    gpu::Buffer source_, keys_[2], values_[2], counters_, counter_prefix_, digit_totals_, counts_;
    uint32_t result_ = 0;
};

}  // namespace ewa::bench
