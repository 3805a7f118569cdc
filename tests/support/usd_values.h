// SPDX-License-Identifier: Apache-2.0
// The values of a .usda or .usdz that ewa wrote: ewa itself does not read them.
#pragma once
#include <cstdlib>
#include <glm/gtc/matrix_transform.hpp>
#include <string>
#include <vector>

#include "ewa/splat_edit.h"
#include "io/splats/splat_values.h"

namespace ewa::test {

/// The numbers of an array of the text; empty if there is no array of this name.
inline std::vector<float> usd_numbers(const std::string& bytes, const std::string& name) {
    const std::string before = "[] " + name + " = [";
    const size_t found = bytes.find(before);
    std::vector<float> numbers;
    if (found == std::string::npos) return numbers;
    const char* at = bytes.c_str() + found + before.size();
    while (*at != ']' && *at != '\0') {
        char* next = nullptr;
        const float number = std::strtof(at, &next);
        if (next != at) numbers.push_back(number);
        at = next == at ? at + 1 : next;
    }
    return numbers;
}

/// The splats of the file in the frame of a PLY. A .usdz has its text as it is.
inline Gaussians usd_splats(const std::string& bytes) {
    Gaussians g;
    g.means = usd_numbers(bytes, "positions");
    g.quaternions = usd_numbers(bytes, "orientations");
    for (const float scale : usd_numbers(bytes, "scales")) g.log_scales.push_back(io::log_of_scale(scale));
    for (const float opacity : usd_numbers(bytes, "opacities"))
        g.opacity_logits.push_back(float(io::logit_of_opacity(opacity)));
    g.sh = usd_numbers(bytes, "radiance:sphericalHarmonicsCoefficients");
    while (g.sh_degree < kMaxShDegree && g.sh_stride() * g.size() < g.sh.size()) ++g.sh_degree;
    transform_splats(g, glm::scale(glm::dmat4(1.0), glm::dvec3(1, -1, -1)));
    return g;
}

}  // namespace ewa::test
