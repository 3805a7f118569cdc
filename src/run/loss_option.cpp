// SPDX-License-Identifier: Apache-2.0
#include "run/loss_option.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>
#include <vector>

#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"

namespace ewa::train {
namespace {

constexpr double kMostWeight = 1e6;

constexpr std::array kTerms{
    std::pair{"l1", &LossWeights::l1},       std::pair{"l2", &LossWeights::l2},
    std::pair{"ssim", &LossWeights::ssim},   std::pair{"alpha", &LossWeights::alpha},
    std::pair{"depth", &LossWeights::depth}, std::pair{"sfm-depth", &LossWeights::sfm_depth}};

std::vector<std::string> term_names() {
    std::vector<std::string> names;
    for (const auto& [name, member] : kTerms) names.emplace_back(name);
    return names;
}

}  // namespace

LossWeights parse_loss(const std::string& text) {
    LossWeights weights;
    bool colors = false;
    std::vector<std::string> named;
    for (const std::string_view part : core::split_list(text)) {
        const size_t equals = part.find('=');
        const std::string name = core::lower(core::trim(part.substr(0, equals)));
        const auto term = std::ranges::find_if(kTerms, [&](const auto& each) { return name == each.first; });
        if (term == kTerms.end())
            throw InputError("'" + name +
                             "' is no term of the loss; l1, l2, ssim, alpha, depth and sfm-depth are" +
                             core::did_you_mean(name, term_names()));
        if (equals == std::string::npos)
            throw InputError("'" + name + "' has no weight; " + name + "=0.5 has one");
        if (std::ranges::find(named, name) != named.end()) throw InputError("'" + name + "' is named twice");
        named.push_back(name);
        std::string weight(core::trim(part.substr(equals + 1)));
        const std::string problem = core::settle_number(weight, 0.0, kMostWeight);
        if (!problem.empty()) throw InputError(name + ": " + problem);
        const bool color = name != "alpha" && name != "depth" && name != "sfm-depth";
        if (color && !std::exchange(colors, true))
            weights = {0, 0, 0, weights.alpha, weights.depth, weights.sfm_depth};
        weights.*(term->second) = core::parse_number(weight).value();
    }
    if (weights.l1 == 0 && weights.l2 == 0 && weights.ssim == 0)
        throw InputError("'" + text + "' has no weight above 0; l1=0.8,ssim=0.2 is the usual loss");
    if (weights.depth > 0 && weights.sfm_depth > 0)
        throw InputError("'" + text + "' has depth and sfm-depth, which exclude each other");
    return weights;
}

std::string loss_text(const LossWeights& weights) {
    std::string text;
    const LossWeights absent{0, 0, 0, kAutomaticAlphaWeight};
    for (const auto& [name, member] : kTerms)
        if (weights.*member != absent.*member)
            text += fmt::format("{}{}={}", text.empty() ? "" : ",", name, weights.*member);
    return text;
}

}  // namespace ewa::train
