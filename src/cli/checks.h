// SPDX-License-Identifier: Apache-2.0
// Checks of option values. Apart from arguments.h, so that only files that define options parse CLI11.
#pragma once
#include <CLI/CLI.hpp>

namespace ewa::cli {

/// Accepts a number from low to high. The help shows the option's type name instead of the range.
template <typename T>
CLI::Validator in_range(T low, T high) {
    return CLI::Range(low, high).description("");
}

/// Refuses a sign: CLI11 reads -1 into an unsigned number as its largest value.
CLI::Validator without_sign();

}  // namespace ewa::cli
