// SPDX-License-Identifier: Apache-2.0
// One frame or training step of a scene on the device, again and again.
#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "bench/scene.h"
#include "ewa/device.h"
#include "gpu/executor.h"
#include "pipeline/backward.h"
#include "pipeline/capacity.h"

namespace ewa::bench {

class FrameRun {
  public:
    /// Uploads the scene and runs once, which settles how much room the instances need and compiles the
    /// kernels. Without options: before black, of the scene's SH degree.
    FrameRun(std::shared_ptr<gpu::Device> device, const Scene& scene, bool train,
             const std::optional<RenderOptions>& options = {});

    /// One more. Records, submits and waits.
    void run();
    /// The same work, but every command is a submission of its own with each(name, submit) around it.
    void run_apart(const std::function<void(const std::string&, const std::function<void()>&)>& each);
    /// Runs the projection's gradient and Adam alone, on the slots the last run left.
    void run_update();
    /// Adam's learning rates; zero at first, so that every run meets the same parameters and does the same
    /// work.
    void set_rates(const pipeline::Rates& rates) { rates_ = rates; }

    const std::vector<gpu::Timing>& timings() const { return executor_.timings(); }
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

}  // namespace ewa::bench
