// SPDX-License-Identifier: Apache-2.0
// The parsing of transforms of a scene, as users type them.
#pragma once
#include <functional>
#include <glm/mat4x4.hpp>
#include <string>
#include <vector>

#include "ewa/gaussians.h"

namespace ewa::edit {

/// Parses --transform and applies the steps in order: "move=x,y,z", "turn=x,y,z,degrees" about that axis,
/// "scale=s", or a matrix of 12 or 16 numbers, row by row. Throws InputError that begins with `what` and names the
/// step.
glm::dmat4 parse_transform(const std::vector<std::string>& steps, const std::string& what = "--transform");

/// Parses --scale-to, "x,y,z,X,Y,Z,LENGTH". Returns the factor of a scaling about the world's origin. After `transform` and this
/// scaling, the two points are LENGTH apart. Throws InputError.
double parse_scale_to(const std::string& text, const glm::dmat4& transform = glm::dmat4(1.0));

/// Changes the splats. Throws InputError, which begins with `what`, if `change` does or fewer splats are drawable afterwards.
void change_splats(Gaussians& gaussians, const std::string& what,
                   const std::function<void(Gaussians&)>& change);
/// Transforms the splats by change_splats().
void place_splats(Gaussians& gaussians, const glm::dmat4& matrix, const std::string& what);

}  // namespace ewa::edit
