// SPDX-License-Identifier: Apache-2.0
// The words of options for rendering and reading a scene, and the options of a render that exclude each other.
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

/// The options of a render. nearest, samples: whether the user set the option of this name, even to its default value.
struct Look {
    RenderOptions render = {};
    bool nearest = false, samples = false;
};

/// Throws InputError for options that exclude each other, or need another one.
void check_look(const Look& look);

/// Throws InputError if these options cannot draw through the camera's lens, and what check() of the options throws.
void check_lens(const RenderOptions& render, const Camera& camera);

}  // namespace ewa::scene
