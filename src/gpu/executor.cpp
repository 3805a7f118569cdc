// SPDX-License-Identifier: Apache-2.0
#include "gpu/executor.h"

#include <algorithm>
#include <stdexcept>
#include <variant>

#include "ewa/error.h"

namespace ewa::gpu {

namespace {

constexpr uint64_t kForever = ~uint64_t(0);

}  // namespace

uint32_t pixel_bytes(VkFormat format) {
    switch (format) {
        case VK_FORMAT_R8G8B8A8_UNORM:
        case VK_FORMAT_R8G8B8A8_SRGB:
        case VK_FORMAT_R32_SFLOAT:
            return 4;
        case VK_FORMAT_R32G32B32A32_SFLOAT:
            return 16;
        default:
            throw InputError(
                "a render goes to a target of R8G8B8A8_UNORM, R8G8B8A8_SRGB, R32G32B32A32_SFLOAT or "
                "R32_SFLOAT, not " +
                vk::to_string(vk::Format(format)));
    }
}

void check_target(const DeviceTarget& target, uint32_t width, uint32_t height) {
    const uint64_t pixel = pixel_bytes(target.format), row = pixel * width;
    const std::string render =
        "a render of " + std::to_string(width) + " x " + std::to_string(height) + " px";
    if (const auto* to = std::get_if<DeviceImage>(&target.to)) {
        if (!to->image) throw InputError("a target without an image");
        if (to->place.x < 0 || to->place.y < 0 || uint64_t(to->place.x) + width > to->size.width ||
            uint64_t(to->place.y) + height > to->size.height)
            throw InputError(render + " at " + std::to_string(to->place.x) + ", " +
                             std::to_string(to->place.y) + " does not fit in an image of " +
                             std::to_string(to->size.width) + " x " + std::to_string(to->size.height) +
                             " px");
        if (to->layout_after == VK_IMAGE_LAYOUT_UNDEFINED ||
            to->layout_after == VK_IMAGE_LAYOUT_PREINITIALIZED)
            throw InputError("no image can change to the layout " +
                             vk::to_string(vk::ImageLayout(to->layout_after)));
        return;
    }
    const auto& to = std::get<DeviceBuffer>(target.to);
    if (!to.buffer) throw InputError("a target without a buffer");
    const uint64_t step = to.row_bytes ? to.row_bytes : row;
    if (to.begin % 4 != 0 || step % 4 != 0 || step < row)
        throw InputError("rows of a target begin at byte " + std::to_string(to.begin) + " and every " +
                         std::to_string(step) + "; these are multiples of 4, and a row has " +
                         std::to_string(row));
    if (to.size < row || to.begin > to.size - row || (to.size - row - to.begin) / step < height - 1)
        throw InputError(render + " does not fit in " + std::to_string(to.size) + " bytes from byte " +
                         std::to_string(to.begin) + " with " + std::to_string(step) + " a row");
}

Executor::Executor(Device& device, uint32_t ahead) : device_(device), slots_(ahead) {
    vk::CommandPoolCreateInfo pool;
    pool.setQueueFamilyIndex(device.queue_family())
        .setFlags(vk::CommandPoolCreateFlagBits::eResetCommandBuffer);
    command_pool_ = device.handle().createCommandPoolUnique(pool);
    for (Slot& slot : slots_) {
        slot.own = new_commands();
        slot.fence = device.handle().createFenceUnique({});
    }
}

Executor::Commands Executor::new_commands() {
    Commands commands;
    vk::CommandBufferAllocateInfo allocate;
    allocate.setCommandPool(*command_pool_).setCommandBufferCount(1);
    commands.buffer = std::move(device_.handle().allocateCommandBuffersUnique(allocate).front());
    return commands;
}

void Executor::finish() noexcept {
    const vk::Device device = device_.handle();
    for (const auto count = uint32_t(slots_.size()); unfinished_ > 0; --unfinished_) {
        const VkFence fence = *slots_[(next_ + count - unfinished_) % count].fence;
        (void)vkWaitForFences(device, 1, &fence, VK_TRUE, kForever);
    }
}

void Executor::reserve(Commands& to, const Recording& recording, bool timed) {
    uint32_t sets = 0, bindings = 0;
    for (const Command& command : recording.commands()) {
        if (command.kind != Command::Kind::dispatch) continue;
        ++sets;
        bindings += uint32_t(command.pipeline->reflection().bindings.size());
    }
    if (!to.descriptor_pool || sets > to.pool_sets || bindings > to.pool_bindings) {
        to.pool_sets = std::max(1u, 2 * sets);
        to.pool_bindings = std::max(1u, 2 * bindings);
        const std::array sizes{
            vk::DescriptorPoolSize(vk::DescriptorType::eStorageBuffer, to.pool_bindings),
            vk::DescriptorPoolSize(vk::DescriptorType::eUniformBuffer, to.pool_bindings),
            vk::DescriptorPoolSize(vk::DescriptorType::eUniformTexelBuffer, to.pool_bindings)};
        vk::DescriptorPoolCreateInfo create;
        create.setMaxSets(to.pool_sets).setPoolSizes(sizes);
        to.descriptor_pool = device_.handle().createDescriptorPoolUnique(create);
    } else {
        device_.handle().resetDescriptorPool(*to.descriptor_pool);
    }
    const uint32_t queries = uint32_t(recording.commands().size()) + 1;
    if (timed && queries > to.query_count) {
        to.query_count = 2 * queries;
        vk::QueryPoolCreateInfo create;
        create.setQueryType(vk::QueryType::eTimestamp).setQueryCount(to.query_count);
        to.queries = device_.handle().createQueryPoolUnique(create);
    }
}

vk::DescriptorSet Executor::bind(const Command& command, vk::DescriptorPool pool) {
    const auto layout = command.pipeline->set_layout();
    vk::DescriptorSetAllocateInfo allocate;
    allocate.setDescriptorPool(pool).setSetLayouts(layout);
    const vk::DescriptorSet set = device_.handle().allocateDescriptorSets(allocate).front();
    const size_t bindings = command.pipeline->reflection().bindings.size();
    // The updates point into these, so they never grow beyond what is reserved.
    std::vector<vk::DescriptorBufferInfo> infos;
    std::vector<vk::BufferView> views;
    std::vector<vk::WriteDescriptorSet> updates;
    infos.reserve(bindings);
    views.reserve(bindings);
    updates.reserve(bindings);
    for (const Binding& binding : command.pipeline->reflection().bindings) {
        const BufferPart& part = command.uses[binding.binding].part;
        vk::WriteDescriptorSet update;
        update.setDstSet(set).setDstBinding(binding.binding).setDescriptorType(descriptor_type(binding.kind));
        if (binding.kind == BindingKind::texel)
            update.setTexelBufferView(views.emplace_back(part.buffer->view()));
        else
            update.setBufferInfo(
                infos.emplace_back(part.buffer->handle(), part.buffer->begin() + part.offset,
                                   part.bytes ? part.bytes : part.buffer->bytes() - part.offset));
        updates.push_back(update);
    }
    device_.handle().updateDescriptorSets(updates, {});
    return set;
}

void Executor::record(const Recording& recording, Commands& to, bool timed,
                      vk::CommandBufferUsageFlags usage) {
    reserve(to, recording, timed);
    to.timed_names.clear();
    if (timed)
        for (const Command& command : recording.commands()) to.timed_names.push_back(command.name);
    const vk::CommandBuffer commands = *to.buffer;
    commands.reset();
    commands.begin(vk::CommandBufferBeginInfo(usage));
    using Stage = vk::PipelineStageFlagBits;
    using Flag = vk::AccessFlagBits;
    const vk::PipelineStageFlags work = Stage::eComputeShader | Stage::eTransfer;
    const vk::AccessFlags written = Flag::eShaderWrite | Flag::eTransferWrite;
    const vk::AccessFlags used = written | Flag::eShaderRead | Flag::eTransferRead | Flag::eUniformRead;
    uint32_t query = 0;
    const auto stamp = [&] {
        if (timed) commands.writeTimestamp(Stage::eBottomOfPipe, *to.queries, query++);
    };
    // What earlier submissions wrote is seen here: their fence orders the host alone.
    const auto barrier = [&](vk::PipelineStageFlags after, vk::AccessFlags writes, bool for_groups) {
        commands.pipelineBarrier(
            after, for_groups ? work | Stage::eDrawIndirect : work, {},
            vk::MemoryBarrier(writes, for_groups ? used | Flag::eIndirectCommandRead : used), {}, {});
    };
    barrier(Stage::eAllCommands, Flag::eMemoryWrite, true);
    if (timed) commands.resetQueryPool(*to.queries, 0, uint32_t(recording.commands().size()) + 1);
    stamp();
    for (const Command& command : recording.commands()) {
        if (command.barrier_before) barrier(work, written, command.barrier_for_groups);
        if (command.kind == Command::Kind::fill) {
            const Buffer& target = *command.uses[0].part.buffer;
            commands.fillBuffer(target.handle(), target.begin() + command.target_offset, command.bytes,
                                command.fill_value);
        } else if (command.kind == Command::Kind::copy) {
            const Buffer &source = *command.uses[0].part.buffer, &target = *command.uses[1].part.buffer;
            commands.copyBuffer(source.handle(), target.handle(),
                                vk::BufferCopy(source.begin() + command.source_offset,
                                               target.begin() + command.target_offset, command.bytes));
        } else if (command.kind == Command::Kind::write) {
            const Buffer& target = *command.uses[0].part.buffer;
            commands.updateBuffer(
                target.handle(), target.begin() + command.target_offset,
                vk::ArrayProxy<const std::byte>(uint32_t(command.push.size()), command.push.data()));
        } else {
            const vk::PipelineBindPoint compute = vk::PipelineBindPoint::eCompute;
            commands.bindPipeline(compute, command.pipeline->handle());
            commands.bindDescriptorSets(compute, command.pipeline->layout(), 0,
                                        bind(command, *to.descriptor_pool), {});
            if (!command.push.empty())
                commands.pushConstants(command.pipeline->layout(), vk::ShaderStageFlagBits::eCompute, 0,
                                       uint32_t(command.push.size()), command.push.data());
            if (const auto* groups = std::get_if<std::array<uint32_t, 3>>(&command.groups)) {
                commands.dispatch((*groups)[0], (*groups)[1], (*groups)[2]);
            } else {
                const auto& part = std::get<BufferPart>(command.groups);
                commands.dispatchIndirect(part.buffer->handle(), part.buffer->begin() + part.offset);
            }
        }
        stamp();
    }
    // The fence alone does not make writes visible to the host.
    commands.pipelineBarrier(work, Stage::eHost, {}, vk::MemoryBarrier(written, Flag::eHostRead), {}, {});
    commands.end();
}

Executor::Slot& Executor::free_slot() {
    if (unfinished_ == slots_.size()) throw std::logic_error("a submission too many ahead of the device");
    Slot& slot = slots_[next_];
    slot.kept = nullptr;
    return slot;
}

void Executor::submit(Slot& slot, vk::SubmitInfo info) {
    const std::array buffers{*slot.own.buffer, slot.kept ? *slot.kept->buffer : vk::CommandBuffer()};
    info.setCommandBufferCount(slot.kept ? 2 : 1).setPCommandBuffers(buffers.data());
    device_.handle().resetFences(*slot.fence);
    device_.submit(info, *slot.fence);
    next_ = (next_ + 1) % uint32_t(slots_.size());
    ++unfinished_;
}

void Executor::submit(const Recording& recording, bool timed) {
    Slot& slot = free_slot();
    with_driver_errors(device_, [&] {
        record(recording, slot.own, timed && device_.limits().timestamps,
               vk::CommandBufferUsageFlagBits::eOneTimeSubmit);
        submit(slot);
    });
}

bool Executor::used(const Commands& commands) const {
    const auto count = uint32_t(slots_.size());
    for (uint32_t ago = 1; ago <= unfinished_; ++ago)
        if (slots_[(next_ + count - ago) % count].kept == &commands) return true;
    return false;
}

void Executor::keep(uint32_t number, const Recording& recording, bool timed) {
    while (kept_.size() <= number) kept_.push_back(new_commands());
    if (used(kept_[number])) throw std::logic_error("a kept recording that the device still needs");
    with_driver_errors(device_,
                       [&] { record(recording, kept_[number], timed && device_.limits().timestamps, {}); });
}

void Executor::submit(const Recording& first, uint32_t kept, bool timed) {
    if (used(kept_.at(kept))) throw std::logic_error("a kept recording that the device still needs");
    Slot& slot = free_slot();
    slot.kept = &kept_[kept];
    with_driver_errors(device_, [&] {
        record(first, slot.own, timed && device_.limits().timestamps,
               vk::CommandBufferUsageFlagBits::eOneTimeSubmit);
        submit(slot);
    });
}

void Executor::record(std::span<const CopyOut> copies, vk::CommandBuffer commands) const {
    using Stage = vk::PipelineStageFlagBits;
    using Flag = vk::AccessFlagBits;
    constexpr auto kSent = vk::ImageLayout::eTransferDstOptimal;
    const vk::AccessFlags any = Flag::eMemoryRead | Flag::eMemoryWrite;
    std::vector<vk::ImageMemoryBarrier> before, after;
    for (const CopyOut& copy : copies) {
        const auto* to = std::get_if<DeviceImage>(&copy.target->to);
        if (!to) continue;
        const vk::ImageSubresourceRange range(vk::ImageAspectFlagBits::eColor, to->mip_level, 1,
                                              to->array_layer, 1);
        const bool released =
            to->family_after != VK_QUEUE_FAMILY_IGNORED && to->family_after != device_.queue_family();
        before.emplace_back(vk::AccessFlags(), Flag::eTransferWrite, vk::ImageLayout(to->layout_before),
                            kSent, VK_QUEUE_FAMILY_IGNORED, VK_QUEUE_FAMILY_IGNORED, to->image, range);
        after.emplace_back(Flag::eTransferWrite, any, kSent, vk::ImageLayout(to->layout_after),
                           released ? device_.queue_family() : VK_QUEUE_FAMILY_IGNORED,
                           released ? to->family_after : VK_QUEUE_FAMILY_IGNORED, to->image, range);
    }
    commands.pipelineBarrier(
        Stage::eAllCommands, Stage::eTransfer, {},
        vk::MemoryBarrier(Flag::eMemoryWrite, Flag::eTransferRead | Flag::eTransferWrite), {}, before);
    for (const CopyOut& copy : copies) {
        const Buffer& source = *copy.source;
        if (const auto* to = std::get_if<DeviceImage>(&copy.target->to)) {
            const vk::ImageSubresourceLayers layers(vk::ImageAspectFlagBits::eColor, to->mip_level,
                                                    to->array_layer, 1);
            commands.copyBufferToImage(
                source.handle(), to->image, kSent,
                vk::BufferImageCopy(source.begin(), copy.stride, 0, layers, {to->place.x, to->place.y, 0},
                                    {copy.width, copy.height, 1}));
            continue;
        }
        const auto& to = std::get<DeviceBuffer>(copy.target->to);
        const uint64_t pixel = pixel_bytes(copy.target->format), row = pixel * copy.width;
        std::vector<vk::BufferCopy> rows;
        for (uint64_t y = 0; y < copy.height; ++y)
            rows.emplace_back(source.begin() + y * copy.stride * pixel,
                              to.begin + y * (to.row_bytes ? to.row_bytes : row), row);
        commands.copyBuffer(source.handle(), to.buffer, rows);
    }
    commands.pipelineBarrier(Stage::eTransfer, Stage::eAllCommands | Stage::eHost, {},
                             vk::MemoryBarrier(Flag::eTransferWrite, any | Flag::eHostRead), {}, after);
}

void Executor::copy_out(std::span<const CopyOut> copies, const DeviceSync& sync) {
    while (unfinished_) wait();
    Slot& slot = free_slot();
    slot.own.timed_names.clear();
    const vk::Semaphore waits(sync.wait), signals(sync.signal);
    const vk::PipelineStageFlags stage = vk::PipelineStageFlagBits::eAllCommands;
    const vk::TimelineSemaphoreSubmitInfo values(1, &sync.wait_value, 1, &sync.signal_value);
    vk::SubmitInfo info;
    if (waits) info.setWaitSemaphores(waits).setWaitDstStageMask(stage);
    if (signals) info.setSignalSemaphores(signals);
    if (sync.wait_value || sync.signal_value) info.setPNext(&values);
    with_driver_errors(device_, [&] {
        slot.own.buffer->reset();
        slot.own.buffer->begin(vk::CommandBufferBeginInfo(vk::CommandBufferUsageFlagBits::eOneTimeSubmit));
        record(copies, *slot.own.buffer);
        slot.own.buffer->end();
        submit(slot, info);
    });
    wait();
}

void Executor::wait() {
    const auto count = uint32_t(slots_.size());
    Slot& slot = slots_[(next_ + count - unfinished_) % count];
    with_driver_errors(device_, [&] {
        if (device_.handle().waitForFences(*slot.fence, true, kForever) != vk::Result::eSuccess)
            throw RunError("the device did not finish");
        --unfinished_;
        if (slot.own.timed_names.empty() && (!slot.kept || slot.kept->timed_names.empty())) return;
        timings_.clear();
        add_timings(slot.own);
        if (slot.kept) add_timings(*slot.kept);
    });
    device_.check_validation();
}

void Executor::run(const Recording& recording, bool timed) {
    submit(recording, timed);
    while (unfinished_) wait();
}

void Executor::add_timings(const Commands& commands) {
    if (commands.timed_names.empty()) return;
    const uint32_t count = uint32_t(commands.timed_names.size()) + 1;
    const auto stamps = device_.handle().getQueryPoolResults<uint64_t>(
        *commands.queries, 0, count, count * sizeof(uint64_t), sizeof(uint64_t),
        vk::QueryResultFlagBits::e64 | vk::QueryResultFlagBits::eWait);
    for (uint32_t i = 0; i + 1 < count; ++i) {
        const std::string& name = commands.timed_names[i];
        const double ticks = double(stamps.value[i + 1] - stamps.value[i]);
        auto found =
            std::find_if(timings_.begin(), timings_.end(), [&](const PassTime& t) { return t.pass == name; });
        if (found == timings_.end()) found = timings_.insert(timings_.end(), {name, 0});
        found->milliseconds += ticks * device_.limits().timestamp_nanoseconds * 1e-6;
    }
}

}  // namespace ewa::gpu
