// SPDX-License-Identifier: Apache-2.0
// Bounds-checked reading of files.
#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "platform/file.h"

namespace ewa::core {

/// Buffered sequential reader of a regular file. Every read is checked against the remaining bytes, and
/// throws InputError "path: byte N: ..." if it fails. So a claim inside a file cannot cause an allocation for
/// missing data. The file is read, not mapped, so a file that shrinks meanwhile is an error and not a SIGBUS.
class FileReader {
  public:
    /// Throws InputError if the file does not exist, is not a regular file or cannot be opened.
    explicit FileReader(const std::filesystem::path& path);
    /// Reads bytes in memory as if they were a file. name: what errors begin with.
    FileReader(std::string name, std::vector<std::byte> bytes);
    FileReader(const FileReader&) = delete;
    FileReader& operator=(const FileReader&) = delete;

    const std::string& name() const { return name_; }
    uint64_t size() const { return size_; }
    uint64_t offset() const { return offset_; }  // of the next byte
    uint64_t remaining() const { return size_ - offset_; }

    /// The next n bytes, valid until the next call. `what` names them in the error.
    const std::byte* take(size_t n, std::string_view what);

    /// The next value, little endian, of an arithmetic type.
    template <class T>
    T read(std::string_view what) {
        static_assert(std::is_arithmetic_v<T> && std::endian::native == std::endian::little);
        T value;
        std::memcpy(&value, take(sizeof(T), what), sizeof(T));
        return value;
    }

    void skip(uint64_t n, std::string_view what);

    /// Makes the byte at this offset the next one to read. `what` names it in the error if the file has no such byte.
    void go_to(uint64_t offset, std::string_view what);

    /// The text before a zero byte, at most `limit` bytes. The zero byte is consumed.
    std::string read_zero_terminated(size_t limit, std::string_view what);

    /// The text before a line feed or the end of the file, at most `limit` bytes. A carriage return before
    /// the line feed is removed. False at the end of the file.
    bool read_line(std::string& line, size_t limit);

    /// Throws unless the rest of the file can hold `count` items of at least `bytes_each` bytes.
    void require_room(uint64_t count, uint64_t bytes_each, std::string_view what) const;

    /// Throws InputError "path: byte N: text".
    [[noreturn]] void fail(std::string_view text) const;

  private:
    void check(const std::error_code& error) const;
    void require_bytes(uint64_t n, std::string_view what) const;
    void fill(size_t n);  // makes at least n bytes available in the buffer

    std::string name_;
    platform::File file_;
    uint64_t size_ = 0, offset_ = 0;
    std::vector<std::byte> buffer_;
    size_t begin_ = 0, end_ = 0;  // the part of the buffer that was read from the file but not taken
};

/// Throws InputError for a text with the byte order mark of UTF-16, which Windows' programs write.
void refuse_utf16(std::string_view text, const std::string& name);

/// The whole file as text. Throws InputError.
std::string read_text_file(const std::filesystem::path& path);

}  // namespace ewa::core
