// SPDX-License-Identifier: Apache-2.0
// Makes arrays of the host available to a device.
#pragma once
#include <algorithm>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/text.h"
#include "gpu/buffer.h"

namespace ewa::operators {

/// A buffer that later calls use again, and that grows as needed. A large array of the host takes its place for one call where
/// the device can read it as it is.
class Array {
  public:
    explicit Array(const char* name, gpu::Texel texel = gpu::Texel::none) : name_(name), texel_(texel) {}

    /// Room for `bytes` bytes, whose contents are undefined.
    const gpu::Buffer& reserve(gpu::Device& device, uint64_t bytes) {
        host_.reset();
        if (!buffer_ || buffer_.bytes() < bytes) {
            buffer_ = gpu::Buffer();
            buffer_ = gpu::Buffer(device, name_, bytes + bytes / 4, texel_);
        }
        return buffer_;
    }
    template <class T>
    const gpu::Buffer& upload(gpu::Device& device, std::span<const T> values) {
        reserve(device, values.size_bytes());
        buffer_.upload(values);
        return buffer_;
    }
    /// As upload(), without a copy if the device can read host memory. The values must stay until the last use in this call.
    template <class T>
    const gpu::Buffer& lend(gpu::Device& device, std::span<const T> values) {
        constexpr size_t kWorthIt = size_t(64) << 10;  // bytes; fewer are copied in the time that this takes
        host_.reset();
        if (values.size_bytes() >= kWorthIt)
            host_ = gpu::Buffer::in_host_memory(device, name_, std::as_bytes(values));
        return host_ ? *host_ : upload(device, values);
    }
    /// Ends a call: the buffer no longer refers to the host's array.
    void give_back() { host_.reset(); }
    template <class T>
    std::vector<T> download(size_t count) const {
        return buffer_.download<T>(count);
    }
    const gpu::Buffer& buffer() const { return host_ ? *host_ : buffer_; }

  private:
    const char* name_;
    gpu::Texel texel_;
    gpu::Buffer buffer_;
    std::optional<gpu::Buffer> host_;
};

/// Throws InputError unless an array has the size that its shape says. shape: for the text, such as "[N, 3]".
inline void check_size(const char* argument, size_t size, size_t expected, const char* shape) {
    if (size != expected)
        throw core::wrong_length(argument, size, std::string("its shape ") + shape + " needs", expected);
}

}  // namespace ewa::operators
