// SPDX-License-Identifier: Apache-2.0
// Which typed options go together. Libraries check other pairs, of which Python needs to know: src/train/exclusions.h and others.
#pragma once
#include <span>

#include "core/exclusion.h"

namespace ewa::options {

/// Each of the options excludes, or needs, each of the others. One of these is a name, or name=value|value.
struct Rule {
    const char* commands;
    const char* options;
    core::Relation relation;
    const char* others;
    const char* reason = "";
};

std::span<const Rule> rules();

}  // namespace ewa::options
