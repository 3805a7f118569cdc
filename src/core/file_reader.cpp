// SPDX-License-Identifier: Apache-2.0
#include "core/file_reader.h"

#include <algorithm>

#include "core/text.h"
#include "ewa/error.h"

namespace ewa::core {

namespace {
constexpr size_t kBufferBytes = size_t(1) << 20;
constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";  // of Windows' editors, before text in UTF-8
}  // namespace

FileReader::FileReader(const std::filesystem::path& path) : name_(one_line(path.string())) {
    std::error_code error;
    // Checked before it is opened, because opening a named pipe would wait for a writer.
    const auto status = std::filesystem::status(path, error);
    if (error) throw InputError(name_ + ": cannot be read: " + error.message());
    if (!std::filesystem::is_regular_file(status)) throw InputError(name_ + ": is not a regular file");
    error = file_.open(path, platform::Open::read);
    if (error) throw InputError(name_ + ": cannot be opened: " + error.message());
    check(file_.size(size_));
    buffer_.resize(static_cast<size_t>(std::min<uint64_t>(size_, kBufferBytes)));
}

FileReader::FileReader(std::string name, std::vector<std::byte> bytes)
    : name_(std::move(name)), size_(bytes.size()), buffer_(std::move(bytes)), end_(buffer_.size()) {}

void FileReader::check(const std::error_code& error) const {
    if (error) fail("cannot be read: " + error.message());
}

void FileReader::fail(std::string_view text) const {
    throw InputError(name_ + ": byte " + std::to_string(offset_) + ": " + one_line(text));
}

void FileReader::fill(size_t n) {
    if (end_ - begin_ >= n) return;
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
    if (buffer_.size() < n) buffer_.resize(n);
    while (end_ < n) {
        size_t got = 0;
        check(file_.read(buffer_.data() + end_, buffer_.size() - end_, got));
        if (got == 0) fail("the file became shorter while it was read");
        end_ += got;
    }
}

void FileReader::require_bytes(uint64_t n, std::string_view what) const {
    if (n > remaining())
        fail("the file ends inside " + std::string(what) + " (" + std::to_string(n) + " bytes needed, " +
             std::to_string(remaining()) + " left)");
}

const std::byte* FileReader::take(size_t n, std::string_view what) {
    require_bytes(n, what);
    fill(n);
    const std::byte* bytes = buffer_.data() + begin_;
    begin_ += n;
    offset_ += n;
    return bytes;
}

void FileReader::skip(uint64_t n, std::string_view what) {
    require_bytes(n, what);
    const size_t buffered = static_cast<size_t>(std::min<uint64_t>(n, end_ - begin_));
    begin_ += buffered;
    if (n > buffered) check(file_.skip(n - buffered));
    offset_ += n;
}

void FileReader::go_to(uint64_t offset, std::string_view what) {
    if (offset > size_)
        fail("the file ends before " + std::string(what) + ", which is said to be at byte " +
             std::to_string(offset) + " of " + std::to_string(size_));
    offset_ = offset;
    if (!file_.is_open()) {  // all bytes are in the buffer
        begin_ = static_cast<size_t>(offset);
        return;
    }
    check(file_.go_to(offset));
    begin_ = end_ = 0;
}

std::string FileReader::read_zero_terminated(size_t limit, std::string_view what) {
    std::string text;
    while (const char c = read<char>(what)) {
        if (text.size() == limit)
            fail(std::string(what) + " is longer than " + std::to_string(limit) + " bytes");
        text += c;
    }
    return text;
}

void refuse_utf16(std::string_view text, const std::string& name) {
    if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff"))
        throw InputError(name + ": is UTF-16; save it as UTF-8");
}

bool FileReader::read_line(std::string& line, size_t limit) {
    line.clear();
    if (offset_ == 0 && remaining() >= 2) {
        fill(2);
        refuse_utf16({reinterpret_cast<const char*>(buffer_.data()) + begin_, 2}, name_);
    }
    if (offset_ == 0 && remaining() >= kByteOrderMark.size()) {
        fill(kByteOrderMark.size());
        if (std::memcmp(buffer_.data() + begin_, kByteOrderMark.data(), kByteOrderMark.size()) == 0)
            take(kByteOrderMark.size(), "the mark");
    }
    if (remaining() == 0) return false;
    while (remaining() > 0) {
        fill(1);
        const auto* begin = reinterpret_cast<const char*>(buffer_.data()) + begin_;
        const size_t available = end_ - begin_;
        const auto* feed = static_cast<const char*>(std::memchr(begin, '\n', available));
        const size_t length = feed ? static_cast<size_t>(feed - begin) : available;
        if (line.size() + length > limit) fail("a line is longer than " + std::to_string(limit) + " bytes");
        line.append(begin, length);
        begin_ += length + (feed != nullptr);
        offset_ += length + (feed != nullptr);
        if (feed) break;
    }
    if (line.ends_with('\r')) line.pop_back();
    return true;
}

void FileReader::require_room(uint64_t count, uint64_t bytes_each, std::string_view what) const {
    if (bytes_each != 0 && count > remaining() / bytes_each)
        fail("the file claims " + std::to_string(count) + " " + std::string(what) + " of at least " +
             std::to_string(bytes_each) + " bytes each, but only " + std::to_string(remaining()) +
             " bytes follow; it is truncated or damaged");
}

std::string read_text_file(const std::filesystem::path& path) {
    FileReader reader(path);
    const size_t size = static_cast<size_t>(reader.size());
    const std::string_view text(reinterpret_cast<const char*>(reader.take(size, "the text")), size);
    return std::string(text.substr(text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0));
}

}  // namespace ewa::core
