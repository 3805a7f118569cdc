// SPDX-License-Identifier: Apache-2.0
// Matches the features of photos instead of COLMAP, and writes the matches to COLMAP's database. COLMAP then verifies them.
#pragma once
#include <filesystem>
#include <optional>
#include <vector>

#include "capture/matching.h"
#include "capture/steps.h"

namespace ewa::capture {

/// The pairs of photos to compare. Pairing::in_sequence pairs each photo with the next 10, and with those 16, 32 ... 512 later:
/// these close the loop of a walk round an object. Other pairings give all pairs. photos: their number.
std::vector<ImagePair> pairs_of(int photos, Pairing pairing);

struct Comparison {
    std::vector<ImagePair> pairs;        // indices into `names`
    bool by_look = false;                // of `pairs`, only those that probably show the same things
    std::vector<ImagePair> always = {};  // compared in any case
    /// Marks all pairs that are not compared, so that COLMAP's exhaustive matcher skips them.
    bool pass_over_others = false;
};

/// Compares pairs of photos on all cores. Skips pairs whose matches the database has. names: the photos that the pairs index;
/// a photo that the database lacks has no features. Returns the compared pairs. Returns nothing if the database has
/// unknown tables, and leaves it unchanged. Throws RunError, Stopped.
std::optional<std::vector<ImagePair>> compare_photos(const std::filesystem::path& database,
                                                     const std::vector<std::filesystem::path>& names,
                                                     const Comparison& comparison,
                                                     const ProgressFunction& progress);

}  // namespace ewa::capture
