// SPDX-License-Identifier: Apache-2.0
// What a training cannot do where its splats or its pictures are divided. Errors print these rows, and docs/scale.md shows them.
#pragma once
#include <array>
#include <string>
#include <string_view>

#include "ewa/train_options.h"

namespace ewa::train {

/// What divides a training, in the order of the documents.
enum Division : size_t { by_ranks, by_batch, by_bands, by_memory, divisions };
inline constexpr std::array<std::string_view, divisions> kDivisions{"several ranks", "--batch", "--bands",
                                                                    "--device-memory"};

struct Exclusion {
    std::string_view option;
    bool (*used)(const TrainOptions&);
    std::array<bool, divisions> excludes;
    std::string_view reason;
};

inline constexpr std::array kExclusions{
    Exclusion{"--points",
              [](const TrainOptions& options) { return options.render.points; },
              {true, true, true, true},
              "spheres are listed and moved within the one picture that shows them"},
    Exclusion{"--refine-poses",
              [](const TrainOptions& options) { return options.refine_poses; },
              {true, true, true, true},
              "a camera learns while the splats of its own step are moved"},
    Exclusion{"--exposure",
              [](const TrainOptions& options) { return options.exposure; },
              {false, false, true, false},
              "an exposure learns from the whole picture of its view"}};

/// Throws InputError if options exclude what divides the training.
void check_exclusions(const TrainOptions& options, int ranks);

}  // namespace ewa::train
