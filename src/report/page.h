// SPDX-License-Identifier: Apache-2.0
// The frame of a self-contained HTML page.
#pragma once
#include <string>

namespace ewa::report {

/// A page in the style of the report, with the script of its sliders and charts. It can be read without scripts.
/// Escapes the title; `body` is HTML.
std::string html_page(const std::string& title, const std::string& body);

}  // namespace ewa::report
