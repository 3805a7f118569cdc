// SPDX-License-Identifier: Apache-2.0
// The help text of a command line parser as a terminal of 80 columns shows it.
#pragma once
#include <string>
#include <string_view>

namespace ewa::core {

/// Breaks lines between words, and makes "-o, --output" of "-o,--output". column: where the descriptions of
/// options begin.
std::string help_text(std::string_view text, size_t column);

}  // namespace ewa::core
