// SPDX-License-Identifier: Apache-2.0
// Work that the benchmark repeats on the device: a frame or training step of a scene, and a sort. Checks
// compare its results with the CPU reference, and with the rules of sorts and scans.
#pragma once
#include <algorithm>
#include <cfloat>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "bench/result.h"
#include "ewa/device.h"
#include "gpu/executor.h"
#include "pipeline/backward.h"
#include "pipeline/frame_buffers.h"
#include "pipeline/sorting.h"

namespace ewa::bench {

class FrameRun {
  public:
    /// Uploads the scene and runs once, which sizes the instance buffers and compiles the kernels. Default
    /// options: a black background and the SH degree of the scene. Default config: that of the device.
    /// moment_bits: as in TrainOptions.
    FrameRun(std::shared_ptr<gpu::Device> device, const BenchScene& scene, bool train,
             const std::optional<RenderOptions>& options = {},
             const std::optional<passes::KernelConfig>& config = {}, int moment_bits = 16);

    /// Records, submits and waits for one more run.
    void run();
    /// The forward part of a run alone: later passes reuse the memory of sort buffers.
    void run_forward();
    /// The same work with one submission per command, each through each(name, submit).
    void run_apart(const std::function<void(const std::string&, const std::function<void()>&)>& each);
    /// Runs only the backward projection and Adam, on the gradient slots of the last run.
    void run_update();
    /// Sets Adam's learning rates. They start at zero, so that all runs do the same work.
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
    void record(const passes::Recorder& recorder);
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
    gpu::Buffer camera_buffer_, image_;
    pipeline::FrameInputs inputs_;
    pipeline::Sorted sorted_;
    shared::Counts counts_{};
    bool train_ = false;
};

/// The radix sort of random 32-bit keys, each with its index as value.
class SortRun {
  public:
    SortRun(std::shared_ptr<gpu::Device> device, uint32_t items, const passes::KernelConfig& config);

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

/// Adds checks of the last run to result.checks. The CPU reference blends pixel by pixel in float64. It
/// checks image, gradient and update of small cases only; result.note names what was skipped.
void check_frame(CaseResult& result, const std::shared_ptr<gpu::Device>& device, FrameRun& run,
                 const BenchScene& scene);

/// visit(name, member of a, of b) for each of the five arrays of parameters.
template <class A, class B, class Visit>
void for_each_group(const A& a, const B& b, Visit visit) {
    visit("means", a.means, b.means);
    visit("quaternions", a.quaternions, b.quaternions);
    visit("log scales", a.log_scales, b.log_scales);
    visit("opacity logits", a.opacity_logits, b.opacity_logits);
    visit("SH", a.sh, b.sh);
}

/// |a - b| / max(|b|, least), with values clamped to the range of float32 and squares that cannot overflow.
/// Infinite if only b is zero, NaN if a has a NaN.
template <class A>
double relative_distance(const std::vector<A>& a, const std::vector<double>& b, double least = 0) {
    double largest = 0, apart = 0, length = 0;
    const auto limited = [](double v) { return std::clamp(v, -double(FLT_MAX), double(FLT_MAX)); };
    for (const double v : b) largest = std::max(largest, std::abs(limited(v)));
    if (largest == 0) {
        for (const A v : a)
            if (!(v == A(0))) return INFINITY;
        return 0;
    }
    for (size_t i = 0; i < b.size(); ++i) {
        apart += std::pow((limited(double(a[i])) - limited(b[i])) / largest, 2);
        length += std::pow(limited(b[i]) / largest, 2);
        if (std::isnan(double(a[i]))) return NAN;
    }
    return std::sqrt(apart) / std::max(std::sqrt(length), least / largest);
}

}  // namespace ewa::bench
