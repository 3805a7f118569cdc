// SPDX-License-Identifier: Apache-2.0
#include "gpu/executor.h"

#include <algorithm>
#include <deque>
#include <stdexcept>

#include "ewa/error.h"

namespace ewa::gpu {

namespace {

/// Calls action, and gives the driver's errors words.
template <class Action>
void with_driver_errors(const Device& device, Action action) {
    try {
        action();
    } catch (const vk::DeviceLostError&) {
        throw RunError(
            "device " + device.info().name +
            " was lost: its driver has reset it, or it is gone; --resume continues a training run");
    } catch (const vk::SystemError& error) {
        throw RunError("device " + device.info().name + ": " + error.what());
    }
}

}  // namespace

Executor::Executor(Device& device, uint32_t ahead) : device_(device), slots_(ahead) {
    vk::CommandPoolCreateInfo pool;
    pool.setQueueFamilyIndex(device.queue_family())
        .setFlags(vk::CommandPoolCreateFlagBits::eResetCommandBuffer);
    command_pool_ = device.handle().createCommandPoolUnique(pool);
    vk::CommandBufferAllocateInfo allocate;
    allocate.setCommandPool(*command_pool_).setCommandBufferCount(1);
    for (Slot& slot : slots_) {
        slot.commands = std::move(device.handle().allocateCommandBuffersUnique(allocate).front());
        slot.fence = device.handle().createFenceUnique({});
    }
}

Executor::~Executor() {
    if (unfinished_) (void)vkDeviceWaitIdle(device_.handle());
}

void Executor::reserve(Slot& slot, const Recording& recording, bool timed) {
    uint32_t sets = 0, bindings = 0;
    for (const Command& command : recording.commands()) {
        if (command.kind != Command::Kind::dispatch) continue;
        ++sets;
        bindings += uint32_t(command.uses.size());
    }
    if (!slot.descriptor_pool || sets > slot.pool_sets || bindings > slot.pool_bindings) {
        slot.pool_sets = std::max(1u, 2 * sets);
        slot.pool_bindings = std::max(1u, 2 * bindings);
        const std::array sizes{
            vk::DescriptorPoolSize(vk::DescriptorType::eStorageBuffer, slot.pool_bindings),
            vk::DescriptorPoolSize(vk::DescriptorType::eUniformBuffer, slot.pool_bindings),
            vk::DescriptorPoolSize(vk::DescriptorType::eUniformTexelBuffer, slot.pool_bindings)};
        vk::DescriptorPoolCreateInfo create;
        create.setMaxSets(slot.pool_sets).setPoolSizes(sizes);
        slot.descriptor_pool = device_.handle().createDescriptorPoolUnique(create);
    } else {
        device_.handle().resetDescriptorPool(*slot.descriptor_pool);
    }
    const uint32_t queries = uint32_t(recording.commands().size()) + 1;
    if (timed && queries > slot.query_count) {
        slot.query_count = 2 * queries;
        vk::QueryPoolCreateInfo create;
        create.setQueryType(vk::QueryType::eTimestamp).setQueryCount(slot.query_count);
        slot.queries = device_.handle().createQueryPoolUnique(create);
    }
}

vk::DescriptorSet Executor::bind(const Command& command, vk::DescriptorPool pool) {
    const auto layout = command.pipeline->set_layout();
    vk::DescriptorSetAllocateInfo allocate;
    allocate.setDescriptorPool(pool).setSetLayouts(layout);
    const vk::DescriptorSet set = device_.handle().allocateDescriptorSets(allocate).front();
    std::deque<vk::DescriptorBufferInfo> infos;
    std::deque<vk::BufferView> views;
    std::vector<vk::WriteDescriptorSet> updates;
    for (size_t i = 0; i < command.uses.size(); ++i) {
        const BufferPart& part = command.uses[i].part;
        const Binding& binding = command.pipeline->reflection().bindings[i];
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

void Executor::record(const Recording& recording, const Slot& slot, bool timed) {
    const vk::CommandBuffer commands = *slot.commands;
    using Stage = vk::PipelineStageFlagBits;
    using Flag = vk::AccessFlagBits;
    const vk::PipelineStageFlags work = Stage::eComputeShader | Stage::eTransfer;
    const vk::AccessFlags written = Flag::eShaderWrite | Flag::eTransferWrite;
    const vk::AccessFlags used = written | Flag::eShaderRead | Flag::eTransferRead | Flag::eUniformRead;
    uint32_t query = 0;
    const auto stamp = [&] {
        if (timed) commands.writeTimestamp(Stage::eBottomOfPipe, *slot.queries, query++);
    };
    // What earlier submissions wrote is seen here: their fence orders the host alone.
    commands.pipelineBarrier(Stage::eAllCommands, work, {}, vk::MemoryBarrier(Flag::eMemoryWrite, used), {},
                             {});
    if (timed) commands.resetQueryPool(*slot.queries, 0, uint32_t(recording.commands().size()) + 1);
    stamp();
    for (const Command& command : recording.commands()) {
        if (command.barrier_before)
            commands.pipelineBarrier(work, work, {}, vk::MemoryBarrier(written, used), {}, {});
        if (command.kind == Command::Kind::fill) {
            const Buffer& target = *command.uses[0].part.buffer;
            commands.fillBuffer(target.handle(), target.begin() + command.target_offset, command.bytes,
                                command.fill_value);
        } else if (command.kind == Command::Kind::copy) {
            const Buffer &source = *command.uses[0].part.buffer, &target = *command.uses[1].part.buffer;
            commands.copyBuffer(source.handle(), target.handle(),
                                vk::BufferCopy(source.begin() + command.source_offset,
                                               target.begin() + command.target_offset, command.bytes));
        } else {
            const vk::PipelineBindPoint compute = vk::PipelineBindPoint::eCompute;
            commands.bindPipeline(compute, command.pipeline->handle());
            commands.bindDescriptorSets(compute, command.pipeline->layout(), 0,
                                        bind(command, *slot.descriptor_pool), {});
            if (!command.push.empty())
                commands.pushConstants(command.pipeline->layout(), vk::ShaderStageFlagBits::eCompute, 0,
                                       uint32_t(command.push.size()), command.push.data());
            commands.dispatch(command.groups[0], command.groups[1], command.groups[2]);
        }
        stamp();
    }
    // The fence alone does not make writes visible to the host.
    commands.pipelineBarrier(work, Stage::eHost, {}, vk::MemoryBarrier(written, Flag::eHostRead), {}, {});
}

void Executor::submit(const Recording& recording, bool timed) {
    if (unfinished_ == slots_.size()) throw std::logic_error("a submission too many ahead of the device");
    Slot& slot = slots_[next_];
    timed = timed && device_.limits().timestamps;
    slot.timed_names.clear();
    if (timed)
        for (const Command& command : recording.commands()) slot.timed_names.push_back(command.name);
    with_driver_errors(device_, [&] {
        reserve(slot, recording, timed);
        slot.commands->reset();
        slot.commands->begin(vk::CommandBufferBeginInfo(vk::CommandBufferUsageFlagBits::eOneTimeSubmit));
        record(recording, slot, timed);
        slot.commands->end();
        vk::SubmitInfo submit;
        submit.setCommandBuffers(*slot.commands);
        device_.handle().resetFences(*slot.fence);
        device_.queue().submit(submit, *slot.fence);
    });
    next_ = (next_ + 1) % uint32_t(slots_.size());
    ++unfinished_;
}

void Executor::wait() {
    const auto count = uint32_t(slots_.size());
    Slot& slot = slots_[(next_ + count - unfinished_) % count];
    with_driver_errors(device_, [&] {
        constexpr uint64_t kForever = ~uint64_t(0);
        if (device_.handle().waitForFences(*slot.fence, true, kForever) != vk::Result::eSuccess)
            throw RunError("the device did not finish");
        --unfinished_;
        if (!slot.timed_names.empty()) read_timings(slot);
    });
    device_.check_validation();
}

void Executor::run(const Recording& recording, bool timed) {
    submit(recording, timed);
    while (unfinished_) wait();
}

void Executor::read_timings(const Slot& slot) {
    const uint32_t count = uint32_t(slot.timed_names.size()) + 1;
    const auto stamps = device_.handle().getQueryPoolResults<uint64_t>(
        *slot.queries, 0, count, count * sizeof(uint64_t), sizeof(uint64_t),
        vk::QueryResultFlagBits::e64 | vk::QueryResultFlagBits::eWait);
    timings_.clear();
    for (uint32_t i = 0; i + 1 < count; ++i) {
        const std::string& name = slot.timed_names[i];
        const double ticks = double(stamps.value[i + 1] - stamps.value[i]);
        auto found =
            std::find_if(timings_.begin(), timings_.end(), [&](const PassTime& t) { return t.pass == name; });
        if (found == timings_.end()) found = timings_.insert(timings_.end(), {name, 0});
        found->milliseconds += ticks * device_.limits().timestamp_nanoseconds * 1e-6;
    }
}

}  // namespace ewa::gpu
