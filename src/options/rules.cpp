// SPDX-License-Identifier: Apache-2.0
#include "options/rules.h"

#include <array>

namespace ewa::options {
namespace {

using enum core::Relation;

constexpr std::array kRules{
    Rule{"train", "force", excludes, "resume"},
    Rule{"train", "verbose", excludes, "quiet"},
    Rule{"render", "size orbit look-at up views film-seconds", excludes, "cameras"},
    Rule{"render", "views", excludes, "orbit look-at"},
    Rule{"render", "film-seconds", needs, "views"},
    Rule{"render", "focus", needs, "aperture"},
    Rule{"render", "aperture shutter", needs, "mode=color|alpha", "such renders average colours"},
    Rule{"render", "transparent", needs, "mode=color"},
    Rule{"render", "mode=depth", excludes, "integrator=march",
         "the integrator march draws no depth; the others do"},
    Rule{"compare",
         "frames test-every background kernel points nearest sh-degree integrator samples downscale "
         "max-width lens device validation",
         needs, "cameras"},
    Rule{"ewa-view", "output", needs, "train"},
    Rule{"ewa-view", "connect", excludes, "train"},
    Rule{"ewa-view", "token-file", excludes, "token"}};

}  // namespace

std::span<const Rule> rules() {
    return kRules;
}

}  // namespace ewa::options
