// SPDX-License-Identifier: Apache-2.0
// Options that exclude a training whose splats or views are divided, and options that the method of drawing splats must support.
// Errors print these rows. docs/scale.md shows the rows on division, after the methods that exclude division. src/scene/looks.cpp
// has the rows of renders, src/run/run_input.cpp those of whole runs.
#pragma once
#include <array>
#include <string>
#include <string_view>

#include "core/exclusion.h"
#include "ewa/train_options.h"
#include "scene/methods.h"

namespace ewa::train {

/// What divides a training's splats or views, in the order of docs/scale.md.
enum Division : size_t { by_ranks, by_batch, by_bands, by_memory, divisions };
inline constexpr std::array<std::string_view, divisions> kDivisions{"several ranks", "--batch", "--bands",
                                                                    "--device-memory"};

using Demand = scene::Demand<TrainOptions>;

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

inline bool refines_poses(const TrainOptions& options) {
    return options.refine_poses;
}

inline bool learns_sky(const TrainOptions& options) {
    return options.sky;
}

inline constexpr std::array kExclusions{
    Exclusion{"--refine-poses",
              refines_poses,
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
              learns_sky,
              {false, false, true, false},
              "the sky learns from the whole picture of a view"}};

/// Options with the ability that each needs of the method of drawing splats (scene/methods.h).
inline constexpr std::array kDemands{
    Demand{"--strategy mcmc", [](const TrainOptions& options) { return options.strategy == Strategy::mcmc; },
           &scene::Method::no_relocation},
    Demand{"--refine-poses", refines_poses, &scene::Method::no_camera_gradient},
    Demand{"--loss depth", compares_depth_maps, &scene::Method::no_depth_gradient, true},
    Demand{"--loss sfm-depth", compares_point_depths, &scene::Method::no_depth_gradient, true},
    Demand{"--background sky", learns_sky, &scene::Method::no_sky_gradient},
    Demand{"--absgrad", [](const TrainOptions& options) { return options.absolute_gradients; },
           &scene::Method::no_pixel_gradient},
    Demand{"--final-splats",
           [](const TrainOptions& options) {
               return options.final_splats > 0 && options.final_splats != kAutomaticFinalSplats;
           },
           &scene::Method::no_weight}};

inline constexpr std::array kSkyExclusions{
    core::Exclusion<TrainOptions>{"--background sky", learns_sky, core::Relation::excludes, "--refine-poses",
                                  refines_poses, "a camera has no gradient by the sky"}};

/// Throws InputError if an option excludes a way in which the training is divided. ranks: number of processes.
void check_exclusions(const TrainOptions& options, int ranks);

}  // namespace ewa::train
