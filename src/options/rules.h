// SPDX-License-Identifier: Apache-2.0
// Which typed options go together. Rules that also apply in Python are in libraries, such as src/train/exclusions.h.
#pragma once
#include <span>

#include "core/exclusion.h"

namespace ewa::options {

/// Each option of `options` excludes, or needs, each option of `others`. Both are lists of names, or of name=value|value.
struct Rule {
    const char* commands;
    const char* options;
    core::Relation relation;
    const char* others;
    const char* reason = "";
};

std::span<const Rule> rules();

}  // namespace ewa::options
