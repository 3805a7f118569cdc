// SPDX-License-Identifier: Apache-2.0
// The last bundle adjustment of a model, with more distortion terms of the lens than the search for cameras had.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "capture/colmap_program.h"
#include "capture/sparse_model.h"

namespace ewa::capture {

/// An observation that is held out of a bundle adjustment: the feature of an image, and the point that it shows.
struct HeldOut {
    uint32_t image = 0, feature = 0;
    uint64_t point = 0;

    bool operator==(const HeldOut&) const = default;
};

/// Removes every tenth observation from the model, the same ones each time. Each point keeps three or more observations.
std::vector<HeldOut> hold_out(SparseModel& model);

/// The reprojection errors of held-out observations, px, clamped to a few px. An observation whose point the model has lost gets
/// the largest value.
std::vector<double> errors_of(const SparseModel& adjusted, const std::vector<HeldOut>& observations);

/// Whether the errors of the same observations are smaller after than before, by more than twice what chance explains.
bool have_fallen(const std::vector<double>& before, const std::vector<double>& after);

/// Sets the lens (COLMAP's model id of RADIAL or OPENCV) of all cameras that have one radial term and that enough photos share.
/// Returns the number of these cameras.
int give_lens(SparseModel& model, int32_t lens);

/// Optimises more lens terms by bundle adjustments, and replaces the model if held-out errors fall. work: folder for files.
/// expected: focal lengths by EXIF, px, by photo name. Returns the new lens; empty if the model has not changed.
std::string refine_lens(const Colmap& colmap, const std::filesystem::path& model,
                        const std::map<std::string, double>& expected, const std::filesystem::path& work);

}  // namespace ewa::capture
