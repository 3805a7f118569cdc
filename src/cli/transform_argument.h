// SPDX-License-Identifier: Apache-2.0
// The option --transform.
#pragma once
#include <glm/mat4x4.hpp>
#include <string>
#include <vector>

namespace ewa::cli {

/// The steps one after the other: "move=x,y,z", "turn=x,y,z,degrees" (round that axis), "scale=s", or a
/// matrix of 12 or 16 numbers, row after row. Throws InputError that names the step.
glm::dmat4 parse_transform(const std::vector<std::string>& steps);

/// Numbers separated by commas; all finite. Throws InputError that names the option.
std::vector<double> parse_numbers(const std::string& option, const std::string& text);

}  // namespace ewa::cli
