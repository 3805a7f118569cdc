// SPDX-License-Identifier: Apache-2.0
// What a training cannot do where its splats or its views are divided, and what it cannot do with points or rays. Errors print these
// rows, and docs/scale.md shows those of a division. src/scene/looks.cpp has the rows of renders, src/run/run_input.cpp those of
// whole runs.
#pragma once
#include <array>
#include <string>
#include <string_view>

#include "core/exclusion.h"
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

inline bool compares_depth_maps(const TrainOptions& options) {
    return options.loss.depth > 0;
}

inline bool compares_point_depths(const TrainOptions& options) {
    return options.loss.sfm_depth > 0;
}

inline constexpr std::array kExclusions{
    Exclusion{"--points",
              [](const TrainOptions& options) { return options.render.points; },
              {true, true, true, true},
              "spheres are listed and moved within the one picture that shows them"},
    Exclusion{"--integrator",
              [](const TrainOptions& options) { return options.render.integrator != Integrator::splat; },
              {true, true, true, true},
              "how rays meet a splat is gathered within the one picture that shows it"},
    Exclusion{"--refine-poses",
              [](const TrainOptions& options) { return options.refine_poses; },
              {true, true, true, true},
              "a camera learns while the splats of its own step are moved"},
    Exclusion{"--appearance",
              [](const TrainOptions& options) {
                  const AppearanceModel model = options.appearance;
                  return model != AppearanceModel::none && model != AppearanceModel::automatic;
              },
              {false, false, true, false},
              "an appearance learns from the whole picture of its view"},
    Exclusion{"--background sky",
              [](const TrainOptions& options) { return options.sky; },
              {false, false, true, false},
              "the sky learns from the whole picture of a view"}};

inline bool has_points(const TrainOptions& options) {
    return options.render.points;
}

inline constexpr std::array kPointExclusions{
    core::Exclusion<TrainOptions>{
        "--points", has_points, core::Relation::excludes, "--strategy mcmc",
        [](const TrainOptions& options) { return options.strategy == Strategy::mcmc; },
        "it moves splats of low opacity, and a sphere has none"},
    core::Exclusion<TrainOptions>{"--points", has_points, core::Relation::excludes, "--final-splats",
                                  [](const TrainOptions& options) { return options.final_splats > 0; },
                                  "a sphere has no weight at a pixel"},
    core::Exclusion<TrainOptions>{"--points", has_points, core::Relation::excludes, "--refine-poses",
                                  [](const TrainOptions& options) { return options.refine_poses; },
                                  "spheres have no gradient by the camera"}};

inline bool shoots_rays(const TrainOptions& options) {
    return options.render.integrator != Integrator::splat;
}

inline constexpr std::string_view kSphereDepthReason = "the depth of a sphere has no gradient",
                                  kRayDepthReason = "depths along rays have no gradient";

inline constexpr std::array kDepthExclusions{
    core::Exclusion<TrainOptions>{"--loss depth", compares_depth_maps, core::Relation::excludes, "--points",
                                  has_points, kSphereDepthReason},
    core::Exclusion<TrainOptions>{"--loss sfm-depth", compares_point_depths, core::Relation::excludes,
                                  "--points", has_points, kSphereDepthReason},
    core::Exclusion<TrainOptions>{"--loss depth", compares_depth_maps, core::Relation::excludes,
                                  "--integrator", shoots_rays, kRayDepthReason},
    core::Exclusion<TrainOptions>{"--loss sfm-depth", compares_point_depths, core::Relation::excludes,
                                  "--integrator", shoots_rays, kRayDepthReason}};

inline constexpr std::array kRayExclusions{
    core::Exclusion<TrainOptions>{"--integrator", shoots_rays, core::Relation::excludes, "--refine-poses",
                                  [](const TrainOptions& options) { return options.refine_poses; },
                                  "rays have no gradient by the camera"},
    core::Exclusion<TrainOptions>{"--integrator", shoots_rays, core::Relation::excludes, "--background sky",
                                  [](const TrainOptions& options) { return options.sky; },
                                  "rays have no gradient by the transmittance"},
    core::Exclusion<TrainOptions>{"--integrator", shoots_rays, core::Relation::excludes, "--absgrad",
                                  [](const TrainOptions& options) { return options.absolute_gradients; },
                                  "rays have no gradient of single pixels"},
    core::Exclusion<TrainOptions>{"--integrator", shoots_rays, core::Relation::excludes, "--final-splats",
                                  [](const TrainOptions& options) { return options.final_splats > 0; },
                                  "rays count no weights at a pixel"}};

inline constexpr std::array kSkyExclusions{core::Exclusion<TrainOptions>{
    "--background sky", [](const TrainOptions& options) { return options.sky; }, core::Relation::excludes,
    "--refine-poses", [](const TrainOptions& options) { return options.refine_poses; },
    "a camera has no gradient by the sky"}};

/// Throws InputError if options exclude what divides the training.
void check_exclusions(const TrainOptions& options, int ranks);

}  // namespace ewa::train
