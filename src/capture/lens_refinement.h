// SPDX-License-Identifier: Apache-2.0
// The last adjustment of a model, with more terms of the lens than the search had.
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

/// An observation that an adjustment does not get: the feature of an image, and the point that it shows.
struct HeldOut {
    uint32_t image = 0, feature = 0;
    uint64_t point = 0;

    bool operator==(const HeldOut&) const = default;
};

/// Takes every tenth observation out of the model, in an order that is the same each time. Each point keeps three or more.
std::vector<HeldOut> hold_out(SparseModel& model);

/// The errors of observations that an adjustment did not get, px, each at most some px. Those whose point the model has lost have
/// the most.
std::vector<double> errors_of(const SparseModel& adjusted, const std::vector<HeldOut>& observations);

/// Whether the errors of the same observations have fallen, by twice what chance gives.
bool have_fallen(const std::vector<double>& before, const std::vector<double>& after);

/// The model with this lens (COLMAP's number: RADIAL or OPENCV) for cameras with one radial term that enough photos share.
/// Returns how many there are.
int give_lens(SparseModel& model, int32_t lens);

/// Frees the lens of a model by bundle adjustments, and replaces the model by what is better. work: for files. expected: focal
/// lengths by EXIF, by the photos' names. Returns the lens that it has now; empty: as it was.
std::string refine_lens(const Colmap& colmap, const std::filesystem::path& model,
                        const std::map<std::string, double>& expected, const std::filesystem::path& work);

}  // namespace ewa::capture
