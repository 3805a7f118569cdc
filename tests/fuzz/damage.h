// SPDX-License-Identifier: Apache-2.0
// Damage to a file: what a bad disk, a broken transfer or a hostile hand makes of it.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <string>

#include "core/random.h"

namespace ewa::fuzz {

/// `bytes` after one to six changes, which depend on the seed alone. `other` lends parts.
class Damage {
  public:
    explicit Damage(uint32_t seed) : seed_(seed) {}

    std::string of(std::string bytes, const std::string& other) {
        for (uint32_t n = 1 + below(6); n > 0; --n) change(bytes, other);
        return bytes;
    }

  private:
    uint32_t below(size_t limit) {
        return limit == 0 ? 0 : core::pcg4d({seed_, next_++, 1, 2})[0] % uint32_t(limit);
    }

    void change(std::string& bytes, const std::string& other) {
        const size_t at = below(bytes.size() + 1),
                     length = below(std::min<size_t>(64, bytes.size() - at) + 1);
        switch (below(9)) {
            case 0:
                bytes.resize(at);
                return;
            case 1:
                if (at < bytes.size()) bytes[at] = char(bytes[at] ^ (1 << below(8)));
                return;
            case 2:
                if (at < bytes.size()) bytes[at] = char(below(256));
                return;
            case 3: {
                constexpr std::array<uint32_t, 6> kWords = {0,          0xffffffff, 0x7fffffff,
                                                            0x80000000, 0x10000,    1};
                const uint32_t word = kWords[below(kWords.size())];
                std::memcpy(&bytes[at], &word, std::min<size_t>(1 + below(4), bytes.size() - at));
                return;
            }
            case 4:
                bytes.erase(at, length);
                return;
            case 5:
                bytes.insert(at, bytes.substr(at, length));
                return;
            case 6:
                bytes.insert(below(bytes.size() + 1), bytes.substr(at, length));
                return;
            case 7:
                bytes.replace(at, length, other.substr(below(other.size() + 1), below(200)));
                return;
            default:
                return change_number(bytes, at);
        }
    }

    /// The first number in digits from `at`.
    void change_number(std::string& bytes, size_t at) {
        constexpr const char* kDigits = "0123456789.";
        constexpr std::array<const char*, 8> kNumbers = {
            "0", "-1", "4294967296", "99999999", "1e999", "nan", "-0.5", "18446744073709551616"};
        const size_t begin = bytes.find_first_of(kDigits, at);
        if (begin == std::string::npos) return;
        const size_t end = bytes.find_first_not_of(kDigits, begin);
        bytes.replace(begin, (end == std::string::npos ? bytes.size() : end) - begin,
                      kNumbers[below(kNumbers.size())]);
    }

    uint32_t seed_, next_ = 0;
};

}  // namespace ewa::fuzz
