// SPDX-License-Identifier: Apache-2.0
// The layout: records of TFRecord (length, its checksum, bytes, their checksum), each an Event in the encoding of protocol
// buffers. The numbers below are those of TensorFlow's event.proto and summary.proto.
#include "report/tensorboard.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "core/atomic_file.h"
#include "ewa/error.h"

namespace ewa::report {
namespace {

enum Wire : uint8_t { kVarint = 0, kFixed64 = 1, kBytes = 2, kFixed32 = 5 };

/// CRC-32C, rotated and shifted as TFRecord wants it.
uint32_t masked_checksum(std::string_view bytes) {
    uint32_t crc = 0xffffffff;
    for (const char byte : bytes) {
        crc ^= static_cast<uint8_t>(byte);
        for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) ? (crc >> 1) ^ 0x82f63b78 : crc >> 1;
    }
    crc = ~crc;
    return ((crc >> 15) | (crc << 17)) + 0xa282ead8;
}

template <class T>
std::string bytes_of(T value) {
    std::string bytes(sizeof(T), '\0');
    std::memcpy(bytes.data(), &value, sizeof(T));
    return bytes;
}

std::string varint(uint64_t value) {
    std::string bytes;
    for (; value >= 128; value >>= 7) bytes += static_cast<char>(value | 128);
    return bytes + static_cast<char>(value);
}

std::string key(int field, Wire wire) {
    return varint(uint64_t(field) << 3 | wire);
}

std::string message(int field, std::string_view bytes) {
    return key(field, kBytes) + varint(bytes.size()) + std::string(bytes);
}

std::string record(const std::string& event) {
    const std::string length = bytes_of(uint64_t(event.size()));
    return length + bytes_of(masked_checksum(length)) + event + bytes_of(masked_checksum(event));
}

std::string scalar(const std::string& tag, double value) {
    return std::isfinite(value) ? message(1, message(1, tag) + key(2, kFixed32) + bytes_of(float(value)))
                                : "";
}

}  // namespace

EventsLog::EventsLog(const std::filesystem::path& path, const std::vector<MetricsLine>& earlier, double begin)
    : path_(path), begin_(begin) {
    std::string text = record(key(1, kFixed64) + bytes_of(begin) + message(3, "brain.Event:2"));
    for (const MetricsLine& line : earlier) text += records_of(line);
    core::write_text_file(path, text);
    file_.open(path, std::ios::app | std::ios::binary);
    if (!file_) throw RunError("cannot create " + path_.string() + ": " + std::strerror(errno));
}

std::string EventsLog::records_of(const MetricsLine& line) {
    std::string scalars = scalar("train/loss", line.loss) + scalar("train/splats", line.splats);
    if (line.train_psnr) scalars += scalar("train/psnr", *line.train_psnr);
    if (line.step > last_.step && line.seconds > last_.seconds)
        scalars +=
            scalar("train/steps_per_second", (line.step - last_.step) / (line.seconds - last_.seconds));
    if (line.test_psnr) scalars += scalar("test/psnr", *line.test_psnr);
    if (line.test_ssim) scalars += scalar("test/ssim", *line.test_ssim);
    for (const Figure& figure : line.test_figures) scalars += scalar("test/" + figure.name, figure.value);
    last_ = line;
    const double wall = std::isfinite(line.wall_seconds) ? line.wall_seconds : 0;
    return record(key(1, kFixed64) + bytes_of(begin_ + wall) + key(2, kVarint) +
                  varint(uint64_t(std::max(0, line.step))) + message(5, scalars));
}

void EventsLog::append(const MetricsLine& line) {
    file_ << records_of(line) << std::flush;
    if (!file_) throw RunError("cannot write " + path_.string() + ": " + std::strerror(errno));
}

}  // namespace ewa::report
