// SPDX-License-Identifier: Apache-2.0
// The words for how a scene is drawn or read, and which of the options of a render go together.
#pragma once
#include "core/words.h"
#include "ewa/dataset.h"
#include "ewa/render_options.h"

namespace ewa::scene {

inline const core::Words<Footprint> kKernelWords{{"peak", Footprint::peak},
                                                 {"antialias", Footprint::antialias},
                                                 {"density", Footprint::density},
                                                 {"ewa", Footprint::density}};
inline const core::Words<Integrator> kIntegratorWords{{"splat", Integrator::splat},
                                                      {"ray", Integrator::ray},
                                                      {"fast-ray", Integrator::fast_ray},
                                                      {"march", Integrator::march}};
inline const core::Words<MaskUse> kMaskWords{{"auto", MaskUse::automatic},
                                             {"ignore", MaskUse::ignore},
                                             {"cut", MaskUse::cut},
                                             {"none", MaskUse::none}};
inline const core::Words<LensUse> kLensWords{
    {"auto", LensUse::automatic}, {"native", LensUse::native}, {"undistort", LensUse::undistort}};

/// The options of a render, and which of them are given, be it with the usual value.
struct Look {
    RenderOptions render = {};
    bool nearest = false, samples = false;
};

/// Throws InputError for options that exclude each other, or need another one.
void check_look(const Look& look);

/// Throws InputError where splats cannot be drawn so through the camera's lens, and what check() of the options throws.
void check_lens(const RenderOptions& render, const Camera& camera);

}  // namespace ewa::scene
