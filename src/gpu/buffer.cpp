// SPDX-License-Identifier: Apache-2.0
#include "gpu/buffer.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cassert>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "ewa/error.h"

namespace ewa::gpu {
namespace {

/// Not for Texel::none and Texel::any.
vk::Format format_of(Texel texel) {
    return texel == Texel::rgba32f    ? vk::Format::eR32G32B32A32Sfloat
           : texel == Texel::rgba32ui ? vk::Format::eR32G32B32A32Uint
                                      : vk::Format::eR8G8B8A8Unorm;
}

uint64_t whole_texels(uint64_t bytes) {
    return (std::max<uint64_t>(bytes, 1) + 15) / 16 * 16;
}

uint64_t texel_bytes(Texel texel) {
    return texel == Texel::rgba8 ? 4 : 16;
}

std::atomic<uint64_t> serial_of_last{0};

}  // namespace

Buffer::Buffer(Device& device, std::string name, uint64_t bytes, Texel texel, bool uniform, bool host_visible)
    : device_(&device),
      name_(std::move(name)),
      bytes_(whole_texels(bytes)),
      texel_(texel),
      uniform_(uniform) {
    create([&] {
        const auto requirements = device.handle().getBufferMemoryRequirements(*buffer_);
        memory_ = std::make_shared<Memory>(device.allocate(requirements, host_visible));
    });
}

Buffer::Buffer(const Buffer& memory, uint64_t offset, std::string name, uint64_t bytes, Texel texel)
    : device_(memory.device_),
      name_(std::move(name)),
      bytes_(whole_texels(bytes)),
      texel_(texel),
      memory_offset_(offset) {
    if (memory.texel_ != Texel::any || offset % kPlacement != 0 || offset + bytes_ > memory.bytes_)
        throw std::logic_error("buffer " + name_ + " in memory that is not for it");
    create([&] { memory_ = memory.memory_; });
}

uint64_t Buffer::last_serial() {
    return serial_of_last;
}

/// find_memory: sets memory_ when there is a buffer that tells what it needs.
template <class FindMemory>
void Buffer::create(FindMemory find_memory) {
    serial_ = ++serial_of_last;
    const Limits& limits = device_->limits();
    const bool bound = texel_ != Texel::any;
    const bool fetched = texel_ != Texel::none && limits.texel_buffers;
    if (bound && fetched && bytes_ / texel_bytes(texel_) > limits.max_texels)
        throw RunError(
            "buffer " + name_ + " needs " + std::to_string(bytes_ >> 20) +
            " MiB, more than this device can fetch texels from; fewer splats or a smaller image need less");
    // Software drivers report 128 MiB here, but bind buffers of any size.
    if (bound && !limits.cpu && bytes_ > limits.max_storage_range)
        throw RunError("buffer " + name_ + " needs " + std::to_string(bytes_ >> 20) +
                       " MiB, and this device binds at most " +
                       std::to_string(limits.max_storage_range >> 20) +
                       " MiB at once; fewer splats or a smaller image need less");
    using Usage = vk::BufferUsageFlagBits;
    vk::BufferCreateInfo info;
    info.setSize(bytes_).setUsage(Usage::eStorageBuffer | Usage::eTransferSrc | Usage::eTransferDst |
                                  Usage::eIndirectBuffer);
    if (fetched) info.usage |= Usage::eUniformTexelBuffer;
    if (uniform_) info.usage |= Usage::eUniformBuffer;
    try {
        buffer_ = device_->handle().createBufferUnique(info);
        find_memory();
        device_->handle().bindBufferMemory(*buffer_, memory_->handle(), memory_->offset() + memory_offset_);
        if (!fetched || !bound) return;
        vk::BufferViewCreateInfo view;
        view.setBuffer(*buffer_).setFormat(format_of(texel_)).setRange(bytes_);
        view_ = device_->handle().createBufferViewUnique(view);
    } catch (const vk::OutOfDeviceMemoryError&) {
        throw device_->out_of_memory(bytes_);
    } catch (const vk::OutOfHostMemoryError&) {
        throw device_->out_of_memory(bytes_);
    } catch (const vk::SystemError& error) {
        throw RunError("buffer " + name_ + " of " + std::to_string(bytes_ >> 20) + " MiB: " + error.what());
    }
}

std::optional<Buffer> Buffer::in_host_memory(Device& device, std::string name,
                                             std::span<const std::byte> bytes) {
    constexpr auto kKind = vk::ExternalMemoryHandleTypeFlagBits::eHostAllocationEXT;
    const uint64_t page = device.limits().host_page;
    const auto address = reinterpret_cast<uintptr_t>(bytes.data());
    // Rounded up to whole texels, the buffer must end in its last page.
    if (page == 0 || bytes.empty() ||
        address % std::max<uint64_t>(16, device.limits().storage_alignment) != 0)
        return std::nullopt;
    const uintptr_t first = address / page * page, end = (address + bytes.size() + page - 1) / page * page;
    auto* const pages = const_cast<std::byte*>(bytes.data()) - (address - first);
    const auto pointer_properties = reinterpret_cast<PFN_vkGetMemoryHostPointerPropertiesEXT>(
        device.handle().getProcAddr("vkGetMemoryHostPointerPropertiesEXT"));
    VkMemoryHostPointerPropertiesEXT properties{VK_STRUCTURE_TYPE_MEMORY_HOST_POINTER_PROPERTIES_EXT, nullptr,
                                                0};
    if (!pointer_properties || pointer_properties(device.handle(), VkExternalMemoryHandleTypeFlagBits(kKind),
                                                  pages, &properties) != VK_SUCCESS)
        return std::nullopt;
    Buffer made;
    made.device_ = &device;
    made.name_ = std::move(name);
    made.bytes_ = whole_texels(bytes.size());
    using Usage = vk::BufferUsageFlagBits;
    const vk::ExternalMemoryBufferCreateInfo external(kKind);
    vk::BufferCreateInfo info;
    info.setSize(end - first).setUsage(Usage::eStorageBuffer | Usage::eTransferSrc | Usage::eTransferDst);
    info.setPNext(&external);
    try {
        // The buffer is all pages: its own bytes may begin where no buffer can be bound.
        made.buffer_ = device.handle().createBufferUnique(info);
        made.begin_ = address - first;
        const auto needs = device.handle().getBufferMemoryRequirements(*made.buffer_);
        const uint32_t types = needs.memoryTypeBits & properties.memoryTypeBits;
        if (types == 0 || needs.size > end - first) return std::nullopt;
        const vk::ImportMemoryHostPointerInfoEXT import(kKind, pages);
        const vk::MemoryAllocateInfo allocate(end - first, uint32_t(std::countr_zero(types)), &import);
        made.host_memory_ = device.handle().allocateMemoryUnique(allocate);
        device.handle().bindBufferMemory(*made.buffer_, *made.host_memory_, 0);
    } catch (const vk::SystemError&) {
        return std::nullopt;  // such as pages of a file that may only be read
    }
    return made;
}

Buffer& Buffer::operator=(Buffer&& other) noexcept {
    if (this == &other) return *this;
    device_ = other.device_;
    name_ = std::move(other.name_);
    serial_ = other.serial_;
    bytes_ = std::exchange(other.bytes_, 0);
    texel_ = other.texel_;
    uniform_ = other.uniform_;
    view_ = std::move(other.view_);
    buffer_ = std::move(other.buffer_);
    host_memory_ = std::move(other.host_memory_);
    begin_ = std::exchange(other.begin_, 0);
    memory_ = std::move(other.memory_);
    memory_offset_ = other.memory_offset_;
    return *this;
}

bool Buffer::lies_at(const Buffer& memory, uint64_t offset, uint64_t bytes) const {
    return memory_ && memory_ == memory.memory_ && memory_offset_ == offset && bytes_ == whole_texels(bytes);
}

bool Buffer::overlaps(const Buffer& other) const {
    if (this == &other) return true;
    return memory_ && memory_ == other.memory_ && memory_offset_ < other.memory_offset_ + other.bytes_ &&
           other.memory_offset_ < memory_offset_ + bytes_;
}

void Buffer::upload(std::span<const std::byte> data, uint64_t offset) {
    assert(offset + data.size() <= bytes_);
    if (data.empty()) return;
    if (mapped())
        std::memcpy(mapped() + offset, data.data(), data.size());
    else
        copy_through_staging(data, {}, offset);
}

void Buffer::download(std::span<std::byte> data, uint64_t offset) const {
    assert(offset + data.size() <= bytes_);
    if (data.empty()) return;
    if (readable())
        std::memcpy(data.data(), readable() + offset, data.size());
    else
        copy_through_staging({}, data, offset);
}

void Buffer::copy_through_staging(std::span<const std::byte> source, std::span<std::byte> target,
                                  uint64_t offset) const {
    const size_t piece = device_->staging_bytes();
    const bool up = !source.empty();
    const size_t total = up ? source.size() : target.size();
    Buffer staging(*device_, "staging", std::min(total, piece), Texel::none, false, true);
    const vk::Device device = device_->handle();
    vk::CommandPoolCreateInfo pool_info;
    pool_info.setQueueFamilyIndex(device_->queue_family());
    const auto pool = device.createCommandPoolUnique(pool_info);
    const auto fence = device.createFenceUnique({});
    for (size_t done = 0; done < total; done += piece) {
        const size_t size = std::min(piece, total - done);
        if (up) std::memcpy(staging.mapped(), source.data() + done, size);
        vk::CommandBufferAllocateInfo allocate;
        allocate.setCommandPool(*pool).setCommandBufferCount(1);
        auto commands = std::move(device.allocateCommandBuffersUnique(allocate).front());
        commands->begin({vk::CommandBufferUsageFlagBits::eOneTimeSubmit});
        // Orders the copy after earlier submissions and before later ones, and makes it visible to the host.
        const vk::MemoryBarrier all(vk::AccessFlagBits::eMemoryWrite | vk::AccessFlagBits::eMemoryRead,
                                    vk::AccessFlagBits::eMemoryWrite | vk::AccessFlagBits::eMemoryRead);
        const auto everything = vk::PipelineStageFlagBits::eAllCommands;
        commands->pipelineBarrier(everything, everything, {}, all, {}, {});
        if (up)
            commands->copyBuffer(*staging.buffer_, *buffer_, vk::BufferCopy(0, offset + done, size));
        else
            commands->copyBuffer(*buffer_, *staging.buffer_, vk::BufferCopy(offset + done, 0, size));
        commands->pipelineBarrier(everything, everything | vk::PipelineStageFlagBits::eHost, {}, all, {}, {});
        commands->end();
        vk::SubmitInfo submit;
        submit.setCommandBuffers(*commands);
        with_driver_errors(*device_, [&] {
            device_->submit(submit, *fence);
            (void)device.waitForFences(*fence, true, ~uint64_t(0));
            device.resetFences(*fence);
        });
        if (!up) std::memcpy(target.data() + done, staging.mapped(), size);
    }
}

}  // namespace ewa::gpu
