// SPDX-License-Identifier: Apache-2.0
// What cleaning removes from a scene: the options of ewa convert.
#pragma once
#include <string>
#include <vector>

#include "ewa/camera.h"
#include "ewa/gaussians.h"

namespace ewa::scene {

struct Cleaning {
    bool floaters = false, largest_cluster = false, invalid = false;
    int min_views = 0;
    double min_opacity = 0;
    std::vector<std::string> ranges = {};  // COLUMN=LOW..HIGH
    std::string sphere = {}, box = {};     // x,y,z,radius and x,y,z,X,Y,Z; empty: none

    bool any() const {
        return floaters || largest_cluster || invalid || min_views > 0 || min_opacity > 0 ||
               !ranges.empty() || !sphere.empty() || !box.empty();
    }
};

/// Throws InputError for a text that cannot be read.
void check_cleaning(const Cleaning& cleaning);

struct Removed {
    std::string option;
    size_t splats;
};

/// Removes splats in the order of the fields of Removed, which has an entry for each option that is used. cameras: for
/// --min-views. Throws InputError that names the option.
std::vector<Removed> clean(Gaussians& gaussians, const Cleaning& cleaning,
                           const std::vector<Camera>& cameras = {});

/// The scene in grey, with what `left` lacks in red. left: splats of `all`, in order.
Gaussians with_removed_in_red(const Gaussians& all, const Gaussians& left);

}  // namespace ewa::scene
