// SPDX-License-Identifier: Apache-2.0
// Warnings on standard error. Standard output stays free for what a program prints as its result.
#pragma once
#include <string>

namespace ewa::core {

/// One line on standard error, through the spdlog logger named "ewa" (set its level to silence it).
void warn(const std::string& text);

}  // namespace ewa::core
