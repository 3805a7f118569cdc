// SPDX-License-Identifier: Apache-2.0
// printf into a string. The stand-alone program links no formatting library.
#pragma once
#include <string>

namespace ewa::bench {

[[gnu::format(printf, 1, 2)]] std::string text_of(const char* format, ...);

/// "850", "12.3 k", "4.56 M", "7.89 G".
std::string scaled(double value);

}  // namespace ewa::bench
