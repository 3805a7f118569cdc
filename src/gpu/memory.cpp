// SPDX-License-Identifier: Apache-2.0
#include "gpu/memory.h"

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

namespace ewa::gpu {
namespace {

using Flag = vk::MemoryPropertyFlagBits;
constexpr vk::MemoryPropertyFlags kHost = Flag::eHostVisible | Flag::eHostCoherent;

uint64_t aligned(uint64_t offset, uint64_t alignment) {
    return (offset + alignment - 1) / alignment * alignment;
}

}  // namespace

std::optional<uint64_t> FreeRanges::take(uint64_t bytes, uint64_t alignment) {
    for (auto range = ranges_.begin(); range != ranges_.end(); ++range) {
        const auto [begin, length] = *range;
        const uint64_t offset = aligned(begin, alignment), end = offset + bytes;
        if (end > begin + length) continue;
        ranges_.erase(range);
        if (offset > begin) ranges_[begin] = offset - begin;
        if (end < begin + length) ranges_[end] = begin + length - end;
        return offset;
    }
    return std::nullopt;
}

void FreeRanges::give_back(uint64_t offset, uint64_t bytes) {
    auto range = ranges_.emplace(offset, bytes).first;
    if (const auto next = std::next(range); next != ranges_.end() && offset + bytes == next->first) {
        range->second += next->second;
        ranges_.erase(next);
    }
    if (range == ranges_.begin()) return;
    const auto before = std::prev(range);
    if (before->first + before->second != offset) return;
    before->second += range->second;
    ranges_.erase(range);
}

uint64_t block_bytes(uint64_t stride, uint64_t held, uint64_t heap) {
    constexpr uint64_t kLeast = uint64_t(1) << 20, kMost = uint64_t(256) << 20;
    const uint64_t wanted = std::min(std::clamp(held / 16, kLeast, kMost), heap / 64);
    return stride * std::max<uint64_t>(1, wanted / stride);
}

Memory& Memory::operator=(Memory&& other) noexcept {
    if (this == &other) return *this;
    give_back();
    pool_ = std::exchange(other.pool_, nullptr);
    block_ = std::exchange(other.block_, nullptr);
    offset_ = other.offset_;
    bytes_ = other.bytes_;
    access_ = std::exchange(other.access_, HostAccess::none);
    return *this;
}

vk::DeviceMemory Memory::handle() const {
    return *block_->memory;
}

std::byte* Memory::mapped() const {
    return access_ == HostAccess::none ? nullptr : block_->mapped + offset_;
}

void Memory::give_back() {
    if (pool_) std::exchange(pool_, nullptr)->give_back(block_, offset_, bytes_);
}

std::optional<Memory> MemoryPool::allocate(const vk::MemoryRequirements& requirements, bool host_visible) {
    // On CPUs and integrated GPUs, one memory type is local to the device and visible to the host. It needs
    // no staging copies.
    std::vector<vk::MemoryPropertyFlags> wishes;
    if (host_visible) {
        wishes = {kHost | Flag::eHostCached, kHost};
    } else {
        if (mapped_is_fast_) wishes.push_back(Flag::eDeviceLocal | kHost | Flag::eHostCached);
        wishes.push_back(Flag::eDeviceLocal);
        wishes.push_back({});
    }
    const std::lock_guard lock(mutex_);
    const uint64_t most = limit_ == 0 ? UINT64_MAX : host_visible ? limit_ : limit_ - host_part(limit_);
    for (const vk::MemoryPropertyFlags wish : wishes) {
        for (uint32_t type = 0; type < properties_.memoryTypeCount; ++type) {
            const vk::MemoryPropertyFlags flags = properties_.memoryTypes[type].propertyFlags;
            if (!(requirements.memoryTypeBits & (1u << type)) || (flags & wish) != wish) continue;
            std::optional<Memory> memory = take(requirements, type, most, host_visible);
            if (!memory) continue;
            memory->access_ = (flags & kHost) != kHost    ? HostAccess::none
                              : flags & Flag::eHostCached ? HostAccess::read_write
                                                          : HostAccess::write;
            if (!host_visible) memory->access_ = std::min(memory->access_, most_access_);
            return memory;
        }
    }
    return std::nullopt;
}

std::optional<Memory> MemoryPool::take(const vk::MemoryRequirements& requirements, uint32_t type,
                                       uint64_t most, bool for_host) {
    for (Block& block : blocks_) {
        if (block.type != type || (&block == spare_ && !fits(block.bytes, most))) continue;
        const auto offset = block.free.take(requirements.size, requirements.alignment);
        if (!offset) continue;
        if (&block == spare_) {
            spare_ = nullptr;
            count(block);
        }
        return take_from(block, *offset, requirements.size);
    }
    Block* block = new_block(requirements, type, most);
    if (!block) return std::nullopt;
    block->for_host = for_host;
    return take_from(*block, *block->free.take(requirements.size, requirements.alignment), requirements.size);
}

Memory MemoryPool::take_from(Block& block, uint64_t offset, uint64_t bytes) {
    Memory memory;
    memory.pool_ = this;
    memory.block_ = &block;
    memory.offset_ = offset;
    memory.bytes_ = bytes;
    use_.used += bytes;
    use_.peak = std::max(use_.peak, use_.used);
    return memory;
}

MemoryPool::Block* MemoryPool::new_block(const vk::MemoryRequirements& requirements, uint32_t type,
                                         uint64_t most) {
    uint64_t held = 0;
    for (const Block& block : blocks_)
        if (block.type == type) held += block.bytes;
    const uint64_t heap = properties_.memoryHeaps[properties_.memoryTypes[type].heapIndex].size;
    const uint64_t stride = aligned(requirements.size, requirements.alignment);
    // Within a limit, what a block has left over is missing elsewhere.
    const uint64_t whole =
        limit_ > 0 ? stride * std::max<uint64_t>(1, limit_ / 256 / stride) : block_bytes(stride, held, heap);
    Block* block = try_block(whole, type, most);
    if (!block && whole > requirements.size) block = try_block(requirements.size, type, most);
    return block;
}

MemoryPool::Block* MemoryPool::try_block(uint64_t bytes, uint32_t type, uint64_t most) {
    if (!fits(bytes, most)) return nullptr;
    if (spare_ && !fits(bytes, most - std::min(most, spare_->bytes))) free_spare();
    vk::MemoryAllocateInfo info;
    info.setAllocationSize(bytes).setMemoryTypeIndex(type);
    Block block{{}, type, bytes, false, nullptr, FreeRanges(bytes)};
    try {
        block.memory = device_.allocateMemoryUnique(info);
    } catch (const vk::OutOfDeviceMemoryError&) {
    } catch (const vk::OutOfHostMemoryError&) {
    } catch (const vk::TooManyObjectsError&) {
    }
    if (!block.memory) {
        if (!spare_) return nullptr;
        free_spare();
        return try_block(bytes, type, most);
    }
    if ((properties_.memoryTypes[type].propertyFlags & kHost) == kHost)
        block.mapped = static_cast<std::byte*>(device_.mapMemory(*block.memory, 0, VK_WHOLE_SIZE));
    ++use_.allocated;
    count(block);
    return &blocks_.emplace_back(std::move(block));
}

void MemoryPool::count(const Block& block) {
    use_.held += block.bytes;
    ++use_.blocks;
}

/// Where the host reads and writes the device's memory itself, nothing is staged.
bool MemoryPool::becomes_spare(const Block& block) const {
    const bool stages = !mapped_is_fast_ || most_access_ != HostAccess::read_write;
    return stages && block.for_host && block.bytes <= kStagingBytes &&
           (!spare_ || spare_->bytes < block.bytes);
}

void MemoryPool::free_spare() {
    const Block* spare = std::exchange(spare_, nullptr);
    blocks_.remove_if([&](const Block& each) { return &each == spare; });
}

void MemoryPool::give_back(Block* block, uint64_t offset, uint64_t bytes) {
    const std::lock_guard lock(mutex_);
    block->free.give_back(offset, bytes);
    use_.used -= bytes;
    if (!block->free.all_free()) return;
    use_.held -= block->bytes;
    --use_.blocks;
    if (becomes_spare(*block)) {
        free_spare();
        spare_ = block;
    } else {
        blocks_.remove_if([&](const Block& each) { return &each == block; });
    }
}

MemoryUse MemoryPool::use() const {
    const std::lock_guard lock(mutex_);
    return use_;
}

}  // namespace ewa::gpu
