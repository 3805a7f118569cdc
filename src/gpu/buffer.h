// SPDX-License-Identifier: Apache-2.0
// A buffer in device memory. It knows nothing of what it holds.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "gpu/device.h"

namespace ewa::gpu {

/// How texelFetch sees the buffer; none: storage only.
enum class Texel { none, rgba32f, rgba32ui, rgba8 };

class Buffer {
  public:
    Buffer() = default;
    /// name: for errors, timing and tests. bytes >= 1 is rounded up to whole 16 byte texels. uniform: may
    /// also be bound as a uniform block. The contents are undefined until written. Throws RunError when
    /// memory runs out or the device cannot address that many bytes through one binding.
    Buffer(Device& device, std::string name, uint64_t bytes, Texel texel = Texel::none, bool uniform = false,
           bool host_visible = false);
    ~Buffer();
    Buffer(Buffer&& other) noexcept;
    Buffer& operator=(Buffer&& other) noexcept;

    const std::string& name() const { return name_; }
    uint64_t bytes() const { return bytes_; }
    Texel texel() const { return texel_; }
    bool uniform() const { return uniform_; }
    vk::Buffer handle() const { return *buffer_; }
    vk::BufferView view() const { return *view_; }
    explicit operator bool() const { return bool(buffer_); }

    /// Host address where the memory is host visible, else nullptr.
    std::byte* mapped() const { return mapped_; }
    /// Blocking copies, by a staging buffer where the memory is not host visible. The device must be idle.
    void upload(std::span<const std::byte> data, uint64_t offset = 0);
    void download(std::span<std::byte> data, uint64_t offset = 0) const;

    template <class T>
    void upload(std::span<const T> data, uint64_t offset = 0) {
        upload(std::as_bytes(data), offset);
    }
    template <class T>
    std::vector<T> download(size_t count, uint64_t offset = 0) const {
        std::vector<T> result(count);
        download(std::as_writable_bytes(std::span<T>(result)), offset);
        return result;
    }

  private:
    void copy_through_staging(std::span<const std::byte> source, std::span<std::byte> target,
                              uint64_t offset) const;

    Device* device_ = nullptr;
    std::string name_;
    uint64_t bytes_ = 0, allocated_ = 0;
    Texel texel_ = Texel::none;
    bool uniform_ = false;
    vk::UniqueDeviceMemory memory_;
    vk::UniqueBuffer buffer_;
    vk::UniqueBufferView view_;
    std::byte* mapped_ = nullptr;
};

}  // namespace ewa::gpu
