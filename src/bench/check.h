// SPDX-License-Identifier: Apache-2.0
// The device's results against the float64 twin and against the rules that sorts and scans follow.
#pragma once
#include <vector>

#include "bench/frame_run.h"
#include "bench/result.h"

namespace ewa::bench {

/// Depth order, scan, instances, tile order and tile starts of the last run: how many entries are wrong, and
/// the projected records against the twin's. At any size.
std::vector<Check> check_lists(const FrameRun& run, const Scene& scene);

/// Whether the twin can do the whole chain in a reasonable time: it walks pixel by pixel in double precision.
bool within_twins_reach(const Case& one);

/// The picture of the last run. Pixels in which a contribution stands on the 1/255 threshold may go either
/// way in float32, hence a bound on their share and one on the worst.
std::vector<Check> check_picture(const FrameRun& run, const Scene& scene);

/// Loss and gradient of the whole chain.
std::vector<Check> check_gradient(std::shared_ptr<gpu::Device> device, const Scene& scene);

/// One step of Adam from fresh moments against the twin's, on the gradient that the moments hold.
std::vector<Check> check_update(std::shared_ptr<gpu::Device> device, const Scene& scene);

}  // namespace ewa::bench
