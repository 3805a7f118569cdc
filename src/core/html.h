// SPDX-License-Identifier: Apache-2.0
// Encodes texts and bytes for HTML files.
#pragma once
#include <span>
#include <string>
#include <string_view>

namespace ewa::core {

/// The text as HTML or attribute content: escapes & < > " ' and drops control characters.
std::string escape_html(std::string_view text);

std::string base64(std::span<const unsigned char> bytes);

}  // namespace ewa::core
