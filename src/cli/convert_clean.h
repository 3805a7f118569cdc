// SPDX-License-Identifier: Apache-2.0
// What ewa convert removes from a scene.
#pragma once
#include <filesystem>
#include <optional>
#include <vector>

#include "ewa/gaussians.h"
#include "folders/run.h"
#include "scene/cleaning.h"

namespace CLI {
class App;
}

namespace ewa::cli {

struct Cleaning : scene::Cleaning {
    std::filesystem::path picture;  // of what would be removed; empty: none
};

void add_cleaning_options(CLI::App& app, Cleaning& cleaning);

/// scene::clean with the cameras of a run. run: of the splats, for --min-views. Throws InputError that names the option.
std::vector<scene::Removed> clean(Gaussians& gaussians, const Cleaning& cleaning,
                                  const std::optional<folders::Run>& run);

/// Draws `all` in grey with what `left` lacks in red, and writes the picture. left: splats of `all`, in order. Throws RunError.
void draw_removed(const std::filesystem::path& picture, const Gaussians& all, const Gaussians& left,
                  const std::optional<folders::Run>& run);

}  // namespace ewa::cli
