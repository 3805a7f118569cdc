// SPDX-License-Identifier: Apache-2.0
// Device memory in blocks that buffers share. A driver limits how many allocations there are at a time, often to
// 4,096, and training images alone may be more. Debian 12 has no package of a library for this.
#pragma once
#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <vulkan/vulkan.hpp>

namespace ewa::gpu {

/// How the host can access a memory fast. write: memory that the host does not cache, whose reads are a hundred times slower.
enum class HostAccess { none, write, read_write };

/// The free parts of one block.
class FreeRanges {
  public:
    explicit FreeRanges(uint64_t bytes) : bytes_(bytes), ranges_{{0, bytes}} {}
    /// Takes `bytes` bytes of the first range with room for them, and returns their offset. alignment: a power of
    /// two. Empty if no range has room.
    std::optional<uint64_t> take(uint64_t bytes, uint64_t alignment);
    /// Frees bytes that take() returned.
    void give_back(uint64_t offset, uint64_t bytes);
    bool all_free() const { return ranges_.size() == 1 && ranges_.begin()->second == bytes_; }

  private:
    uint64_t bytes_;
    std::map<uint64_t, uint64_t> ranges_;  // offset -> bytes; no two touch
};

/// The size of a new block, bytes: a whole number of buffers of `stride` bytes. It is about a sixteenth of the `held`
/// bytes in blocks of this type, so that unused memory stays a small share. A larger buffer gets a block of
/// its own.
uint64_t block_bytes(uint64_t stride, uint64_t held, uint64_t heap);

struct MemoryUse {
    uint64_t used = 0;       // bytes of all buffers
    uint64_t peak = 0;       // of used
    uint64_t held = 0;       // bytes of the blocks with a buffer in them
    uint32_t blocks = 0;     // their number
    uint64_t allocated = 0;  // the driver's allocations so far
};

class MemoryPool;

/// A part of a block. It goes back to its pool when it is destroyed, which is before its device is.
class Memory {
  public:
    Memory() = default;
    ~Memory() { give_back(); }
    Memory(Memory&& other) noexcept { *this = std::move(other); }
    Memory& operator=(Memory&& other) noexcept;

    explicit operator bool() const { return pool_; }
    vk::DeviceMemory handle() const;
    uint64_t offset() const { return offset_; }
    HostAccess access() const { return access_; }
    /// The host's address of the part. Null without access.
    std::byte* mapped() const;

  private:
    friend class MemoryPool;
    struct Block {
        vk::UniqueDeviceMemory memory;
        uint32_t type = 0;
        uint64_t bytes = 0;
        bool for_host = false;  // made for a buffer that the host sees
        std::byte* mapped = nullptr;
        FreeRanges free;
    };
    void give_back();

    MemoryPool* pool_ = nullptr;
    Block* block_ = nullptr;
    uint64_t offset_ = 0, bytes_ = 0;
    HostAccess access_ = HostAccess::none;
};

/// The blocks of one device. Calls may come from any thread.
class MemoryPool {
  public:
    /// mapped_is_fast: the host shares the device's memory, as with CPUs and integrated GPUs.
    MemoryPool(vk::PhysicalDevice physical, vk::Device device, bool mapped_is_fast)
        : device_(device), properties_(physical.getMemoryProperties()), mapped_is_fast_(mapped_is_fast) {}

    /// Empty if the driver has no such memory left, or allows no further allocation.
    std::optional<Memory> allocate(const vk::MemoryRequirements& requirements, bool host_visible);
    /// Limits the host access to device memory that is allocated from now on, to test on one device the code for others.
    void limit_host_access(HostAccess most) { most_access_ = most; }
    /// Limits the bytes of all blocks together, from now on. A small part of the limit is for memory that the host can see,
    /// through which it copies. 0: no limit.
    void limit_bytes(uint64_t bytes) { limit_ = bytes; }
    uint64_t limit() const { return limit_; }
    /// The part of the limit for memory that the host can see.
    static uint64_t host_part(uint64_t limit) { return limit / 32; }
    /// Bytes of the largest staging buffer.
    static constexpr uint64_t kStagingBytes = uint64_t(64) << 20;
    MemoryUse use() const;

  private:
    friend class Memory;
    using Block = Memory::Block;
    std::optional<Memory> take(const vk::MemoryRequirements& requirements, uint32_t type, uint64_t most,
                               bool for_host);
    Memory take_from(Block& block, uint64_t offset, uint64_t bytes);
    Block* new_block(const vk::MemoryRequirements& requirements, uint32_t type, uint64_t most);
    Block* try_block(uint64_t bytes, uint32_t type, uint64_t most);
    bool fits(uint64_t bytes, uint64_t most) const { return bytes <= most && use_.held <= most - bytes; }
    void count(const Block& block);
    bool becomes_spare(const Block& block) const;
    void free_spare();
    void give_back(Block* block, uint64_t offset, uint64_t bytes);

    vk::Device device_;
    vk::PhysicalDeviceMemoryProperties properties_;
    bool mapped_is_fast_;
    HostAccess most_access_ = HostAccess::read_write;
    uint64_t limit_ = 0;  // bytes of all blocks; 0: none
    mutable std::mutex mutex_;
    std::list<Block> blocks_;
    // An empty block of blocks_ for the next staging buffer, or null: an allocation of the driver takes longer than a copy of
    // a few megabytes.
    Block* spare_ = nullptr;
    MemoryUse use_;
};

}  // namespace ewa::gpu
