// SPDX-License-Identifier: Apache-2.0
// Characters of UTF-8.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace ewa::core {

/// The text with letters and their marks as one character where Unicode has it (NFC), as most systems write names. Apple's
/// file systems take them apart. Text that is not UTF-8 stays.
std::string composed(std::string_view text);

/// The first character in UTF-8 and its number of bytes, which is 0 if the bytes are not UTF-8. Not of an empty text.
std::pair<uint32_t, size_t> first_character(std::string_view text);

}  // namespace ewa::core
