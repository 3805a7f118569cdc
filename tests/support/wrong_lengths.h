// SPDX-License-Identifier: Apache-2.0
// Splats whose arrays do not fit together, and what the error of each names.
#pragma once
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "ewa/gaussians.h"
#include "support/splat_scenes.h"

namespace ewa::test {

inline std::vector<std::pair<Gaussians, std::string>> wrong_splats() {
    using Floats = std::vector<float> Gaussians::*;
    std::vector<std::pair<Gaussians, std::string>> all;
    const Gaussians right = storable_splats(3, 1234, 1);
    const std::array<std::pair<Floats, const char*>, 5> arrays{
        {{&Gaussians::means, "means"},
         {&Gaussians::quaternions, "quaternions"},
         {&Gaussians::log_scales, "log_scales"},
         {&Gaussians::opacity_logits, "opacity_logits"},
         {&Gaussians::sh, "sh"}}};
    for (const auto& [array, name] : arrays)
        for (const size_t size :
             {size_t(0), size_t(3), (right.*array).size() - 1, (right.*array).size() + 4}) {
            Gaussians wrong = right;
            (wrong.*array).resize(size);
            all.emplace_back(wrong, std::string(name) + " has ");
        }
    for (const int degree : {-1, 0, 2, 3, 7, 1 << 20}) {
        Gaussians wrong = right;
        wrong.sh_degree = degree;
        all.emplace_back(wrong, degree < 0 || degree > 3 ? "sh_degree is " : "sh has ");
    }
    return all;
}

}  // namespace ewa::test
