// SPDX-License-Identifier: Apache-2.0
// A hash that distinguishes contents. It does not resist deliberate collisions.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <type_traits>

namespace ewa::core {

/// FNV-1a (Fowler, Noll, Vo) over 64 bits.
class Hash {
  public:
    void add(const void* data, size_t bytes) {
        const auto* p = static_cast<const unsigned char*>(data);
        for (size_t i = 0; i < bytes; ++i) value_ = (value_ ^ p[i]) * 0x100000001b3ull;
    }
    template <class T>
    void add(const T& value) {
        static_assert(std::is_arithmetic_v<T>);
        add(&value, sizeof(value));
    }
    void add(const std::string& text) {
        add(uint64_t(text.size()));
        add(text.data(), text.size());
    }
    uint64_t value() const { return value_; }

  private:
    uint64_t value_ = 0xcbf29ce484222325ull;
};

/// Adds the file's size and its first 64 KiB. Throws InputError.
void add_file(Hash& hash, const std::filesystem::path& path);

/// The value as 16 hexadecimal digits.
std::string digits_of(const Hash& hash);

}  // namespace ewa::core
