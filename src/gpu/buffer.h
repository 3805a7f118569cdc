// SPDX-License-Identifier: Apache-2.0
// A buffer in device memory.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gpu/device.h"

namespace ewa::gpu {

/// The format of the texels that shaders fetch. none: the buffer is not for fetches.
enum class Texel { none, rgba32f, rgba32ui, rgba8 };

class Buffer {
  public:
    Buffer() = default;
    /// name: for errors, timings and tests. bytes: rounded up to whole texels of 16 bytes, at least one.
    /// uniform: the buffer may also be bound as a uniform block. The contents are undefined until they are
    /// written. Throws RunError if memory runs out, or if one binding cannot address that many bytes.
    Buffer(Device& device, std::string name, uint64_t bytes, Texel texel = Texel::none, bool uniform = false,
           bool host_visible = false);
    Buffer(Buffer&& other) noexcept { *this = std::move(other); }
    Buffer& operator=(Buffer&& other) noexcept;

    const std::string& name() const { return name_; }
    uint64_t bytes() const { return bytes_; }
    Texel texel() const { return texel_; }
    bool uniform() const { return uniform_; }
    vk::Buffer handle() const { return *buffer_; }
    vk::BufferView view() const { return *view_; }
    explicit operator bool() const { return bool(buffer_); }

    /// The host's address of the memory. Null if the host cannot map it.
    std::byte* mapped() const { return memory_.mapped(); }
    /// Blocking copies. They use a staging buffer if the host cannot map the memory. The device must be idle.
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
    uint64_t bytes_ = 0;
    Texel texel_ = Texel::none;
    bool uniform_ = false;
    Memory memory_;
    vk::UniqueBuffer buffer_;
    vk::UniqueBufferView view_;
};

}  // namespace ewa::gpu
