// SPDX-License-Identifier: Apache-2.0
// A buffer in device memory.
#pragma once
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gpu/device.h"

namespace ewa::gpu {

/// The format of the texels that shaders fetch. none: the buffer is not for fetches. any: only for memory that
/// buffers of every format share.
enum class Texel { none, rgba32f, rgba32ui, rgba8, any };

class Buffer {
  public:
    Buffer() = default;
    /// name: for errors, timings and tests. bytes: rounded up to whole texels of 16 bytes, at least one.
    /// uniform: the buffer may also be bound as a uniform block. The contents are undefined until they are
    /// written. Throws RunError if memory runs out, or if one binding cannot address that many bytes.
    Buffer(Device& device, std::string name, uint64_t bytes, Texel texel = Texel::none, bool uniform = false,
           bool host_visible = false);
    /// A buffer in the memory of another, which is of Texel::any, from byte `offset` on, a multiple of kPlacement.
    /// The memory stays as long as a buffer in it.
    Buffer(const Buffer& memory, uint64_t offset, std::string name, uint64_t bytes, Texel texel);
    static constexpr uint64_t kPlacement = 4096;  // bytes
    /// A buffer on these bytes of host memory, without a copy. They must exist until the device is done with the buffer. Empty if the
    /// device cannot use them.
    static std::optional<Buffer> in_host_memory(Device& device, std::string name,
                                                std::span<const std::byte> bytes);
    Buffer(Buffer&& other) noexcept { *this = std::move(other); }
    Buffer& operator=(Buffer&& other) noexcept;

    const std::string& name() const { return name_; }
    uint64_t bytes() const { return bytes_; }
    Texel texel() const { return texel_; }
    bool uniform() const { return uniform_; }
    vk::Buffer handle() const { return *buffer_; }
    /// Differs between all buffers of a process; 0 for none.
    uint64_t serial() const { return buffer_ ? serial_ : 0; }
    /// The serial of the last buffer that this process has made.
    static uint64_t last_serial();
    vk::BufferView view() const { return *view_; }
    /// Offset of the buffer in its handle, bytes. It is not 0 if an address of the host has to be aligned.
    uint64_t begin() const { return begin_; }
    explicit operator bool() const { return bool(buffer_); }
    /// Whether the buffer was made of this memory, from byte `offset` on, for that many bytes.
    bool lies_at(const Buffer& memory, uint64_t offset, uint64_t bytes) const;
    /// Whether a byte of the two is the same memory.
    bool overlaps(const Buffer& other) const;

    /// The host's address of the memory. Null if the host cannot map it.
    std::byte* mapped() const {
        return memory_ && memory_->mapped() ? memory_->mapped() + memory_offset_ : nullptr;
    }
    /// The host's address, if the host reads this memory fast; else null.
    const std::byte* readable() const {
        return memory_ && memory_->access() == HostAccess::read_write ? mapped() : nullptr;
    }
    /// Blocking copies. They use a staging buffer if the host cannot map the memory. The device must be idle.
    void upload(std::span<const std::byte> data, uint64_t offset = 0);
    void download(std::span<std::byte> data, uint64_t offset = 0) const;

    template <class T>
    void upload(std::span<const T> data, uint64_t offset = 0) {
        upload(std::as_bytes(data), offset);
    }
    template <class T>
    std::vector<T> download(size_t count, uint64_t offset = 0) const {
        if (const std::byte* bytes = readable()) {  // one pass over the result in place of two
            assert(offset + count * sizeof(T) <= bytes_);
            const T* first = reinterpret_cast<const T*>(bytes + offset);
            return std::vector<T>(first, first + count);
        }
        std::vector<T> result(count);
        download(std::as_writable_bytes(std::span<T>(result)), offset);
        return result;
    }

  private:
    template <class FindMemory>
    void create(FindMemory find_memory);
    void copy_through_staging(std::span<const std::byte> source, std::span<std::byte> target,
                              uint64_t offset) const;

    Device* device_ = nullptr;
    std::string name_;
    uint64_t serial_ = 0;
    uint64_t bytes_ = 0;
    Texel texel_ = Texel::none;
    bool uniform_ = false;
    std::shared_ptr<Memory> memory_;
    uint64_t memory_offset_ = 0;
    vk::UniqueDeviceMemory host_memory_;  // in place of memory_: pages of the host
    uint64_t begin_ = 0;
    vk::UniqueBuffer buffer_;
    vk::UniqueBufferView view_;
};

}  // namespace ewa::gpu
