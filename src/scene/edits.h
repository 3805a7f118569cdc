// SPDX-License-Identifier: Apache-2.0
// Edits of a whole scene as people name them: those of ewa convert, but for what it removes (cleaning.h).
#pragma once
#include <glm/mat4x4.hpp>
#include <optional>
#include <string>
#include <vector>

#include "ewa/splat_scene.h"

namespace ewa::scene {

/// How many splats to leave: a number, or a part of those that are there.
struct Decimation {
    double part = 0;  // above 0: of the splats
    size_t count = 0;
};

struct Edits {
    glm::dmat4 transform{1.0};
    int max_sh = kMaxShDegree;
    std::optional<Decimation> decimation = {};
    bool morton = false;
};

/// Parses --transform and applies the steps in order: "move=x,y,z", "turn=x,y,z,degrees" about that axis,
/// "scale=s", or a matrix of 12 or 16 numbers, row by row. Throws InputError that begins with `what` and names the
/// step.
glm::dmat4 parse_transform(const std::vector<std::string>& steps, const std::string& what = "--transform");

/// Parses --scale-to, "x,y,z,X,Y,Z,LENGTH". Returns the factor by which the scene grows about the world's origin, so that the two points
/// are LENGTH apart after `transform` and it. Throws InputError.
double parse_scale_to(const std::string& text, const glm::dmat4& transform = glm::dmat4(1.0));

/// Transforms the splats. Throws InputError, which begins with `what`, if fewer of them could be drawn afterwards.
void place_splats(Gaussians& gaussians, const glm::dmat4& matrix, const std::string& what);

/// Parses --decimate: N, or P% with 0 < P <= 100. Empty: none. Throws InputError.
std::optional<Decimation> parse_decimation(const std::string& text);

/// The number of splats that `decimation` leaves of `count`.
size_t left_of(size_t count, const Decimation& decimation);

/// Applies the user's edits. Returns lines on splats that were merged. Throws InputError if the transform makes a splat undrawable.
std::vector<std::string> apply_edits(Gaussians& gaussians, const Edits& edits);

}  // namespace ewa::scene
