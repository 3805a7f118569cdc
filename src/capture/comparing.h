// SPDX-License-Identifier: Apache-2.0
// Compares the features of photos in COLMAP's place, and leaves the matches in its database. COLMAP verifies them.
#pragma once
#include <filesystem>
#include <optional>
#include <vector>

#include "capture/matching.h"
#include "capture/steps.h"

namespace ewa::capture {

/// The pairs of so many photos to compare. In a sequence, each has the 10 that follow, and those 16, 32 ... 512 later, which
/// close the loop of a walk round an object. Otherwise all.
std::vector<ImagePair> pairs_of(int photos, Pairing pairing);

struct Comparison {
    std::vector<ImagePair> pairs;        // of places in `names`
    bool by_look = false;                // only those that probably show the same things
    std::vector<ImagePair> always = {};  // compared in any case
    /// Marks all other pairs, so that COLMAP's exhaustive matcher skips them.
    bool pass_over_others = false;
};

/// Compares pairs of photos on all cores, unless the database has their matches. names: of the images, in the order that the
/// pairs mean; those that the database lacks have no features. Returns the pairs that have been compared; nothing for a
/// database whose tables it does not know, which stays as it is. Throws RunError, Stopped.
std::optional<std::vector<ImagePair>> compare_photos(const std::filesystem::path& database,
                                                     const std::vector<std::filesystem::path>& names,
                                                     const Comparison& comparison,
                                                     const ProgressFunction& progress);

}  // namespace ewa::capture
