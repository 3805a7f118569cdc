// SPDX-License-Identifier: Apache-2.0
// The edits of ewa convert between reading and writing.
#pragma once
#include <array>
#include <glm/mat4x4.hpp>
#include <optional>
#include <string>
#include <vector>

#include "ewa/splat_files.h"

namespace ewa::cli {

struct Edits {
    glm::dmat4 transform{1.0};
    std::optional<std::array<double, 6>> crop;  // a box: x, y, z of the low corner, then of the high one
    double min_opacity = 0;
    int max_sh = kMaxShDegree;
    bool morton = false;
};

/// Parses --transform and applies the steps in order: "move=x,y,z", "turn=x,y,z,degrees" about that axis,
/// "scale=s", or a matrix of 12 or 16 numbers, row by row. Throws InputError that names the step.
glm::dmat4 parse_transform(const std::vector<std::string>& steps);

/// Parses --crop. Empty: no box. Throws InputError.
std::optional<std::array<double, 6>> parse_crop(const std::string& text);

/// Applies the user's edits, then those that the format needs. The result is the scene that the file will
/// hold. Returns a line if splats were dropped for the format. Throws InputError if the transform makes a
/// splat undrawable.
std::optional<std::string> apply_edits(Gaussians& gaussians, const Edits& edits, SplatFormat format);

}  // namespace ewa::cli
