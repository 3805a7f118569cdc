// SPDX-License-Identifier: Apache-2.0
// What ewa convert removes from a scene.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "ewa/gaussians.h"
#include "live/run_folder.h"

namespace CLI {
class App;
}

namespace ewa::cli {

struct Cleaning {
    bool floaters = false, largest_cluster = false, invalid = false;
    int min_views = 0;
    double min_opacity = 0;
    std::vector<std::string> ranges;  // COLUMN=LOW..HIGH
    std::string sphere, box;          // x,y,z,radius and x,y,z,X,Y,Z; empty: none
    std::filesystem::path picture;    // of what would be removed; empty: none

    bool any() const {
        return floaters || largest_cluster || invalid || min_views > 0 || min_opacity > 0 ||
               !ranges.empty() || !sphere.empty() || !box.empty();
    }
};

void add_cleaning_options(CLI::App& app, Cleaning& cleaning);

/// Throws InputError for a text that cannot be read.
void check_cleaning(const Cleaning& cleaning);

struct Removed {
    std::string option;
    size_t splats;
};

/// Removes splats in the order of the fields of Removed, which has an entry for each option that is used. run: of the splats, for
/// --min-views. Throws InputError that names the option.
std::vector<Removed> clean(Gaussians& gaussians, const Cleaning& cleaning,
                           const std::optional<live::Run>& run);

/// Draws `all` in grey with what `left` lacks in red, and writes the picture. left: splats of `all`, in order. Throws RunError.
void draw_removed(const std::filesystem::path& picture, const Gaussians& all, const Gaussians& left,
                  const std::optional<live::Run>& run);

}  // namespace ewa::cli
