// SPDX-License-Identifier: Apache-2.0
#include "gpu/recording.h"

#include <algorithm>
#include <stdexcept>

namespace ewa::gpu {
namespace {

bool has(Access access, Access part) {
    return (uint32_t(access) & uint32_t(part)) != 0;
}

[[noreturn]] void fail(const Pipeline& pipeline, const std::string& what) {
    throw std::logic_error("shader " + pipeline.name() + ": " + what);
}

void check_part(const Pipeline& pipeline, const Binding& binding, const BufferPart& part) {
    const std::string at = "binding " + std::to_string(binding.binding) + " (" + part.buffer->name() + ")";
    if (binding.kind == BindingKind::texel && !part.buffer->view())
        fail(pipeline, at + " is fetched as texels, and the buffer has no texel format");
    if (binding.kind == BindingKind::uniform && !part.buffer->uniform())
        fail(pipeline, at + " is a uniform block, and the buffer was not made for that");
    if (binding.kind == BindingKind::texel && part.offset != 0)
        fail(pipeline, at + " is a part of a texel buffer");
    if (part.offset + part.bytes > part.buffer->bytes())
        fail(pipeline, at + " reaches past the buffer's end");
}

void check_groups(const Pipeline& pipeline, const BufferPart& groups) {
    if (groups.offset % 4 != 0 || groups.offset + sizeof(VkDispatchIndirectCommand) > groups.buffer->bytes())
        fail(pipeline, "workgroups at byte " + std::to_string(groups.offset) + " of " +
                           groups.buffer->name() + ", which has " + std::to_string(groups.buffer->bytes()));
}

}  // namespace

void Recording::dispatch(const Pipeline& pipeline, std::string name, std::span<const BufferPart> parts,
                         std::span<const std::byte> push, const Workgroups& groups) {
    const Reflection& shader = pipeline.reflection();
    if (parts.size() != shader.bindings.size())
        fail(pipeline, "declares " + std::to_string(shader.bindings.size()) + " bindings, the pass gives " +
                           std::to_string(parts.size()));
    if (push.size() != shader.push_constant_bytes)
        fail(pipeline, "takes " + std::to_string(shader.push_constant_bytes) +
                           " bytes of push constants, the pass gives " + std::to_string(push.size()));
    const auto* known = std::get_if<std::array<uint32_t, 3>>(&groups);
    for (const uint32_t count : known ? *known : std::array<uint32_t, 3>{1, 1, 1})
        if (count == 0 || count > limits_.max_groups)
            fail(pipeline, "a dispatch of " + std::to_string(count) + " workgroups (1 to " +
                               std::to_string(limits_.max_groups) + " are possible)");
    if (!known) check_groups(pipeline, std::get<BufferPart>(groups));
    Command command;
    for (size_t i = 0; i < parts.size(); ++i) {
        check_part(pipeline, shader.bindings[i], parts[i]);
        command.uses.push_back({parts[i], shader.bindings[i].access});
    }
    command.name = std::move(name);
    command.pipeline = &pipeline;
    command.push.assign(push.begin(), push.end());
    command.groups = groups;
    if (!known) command.uses.push_back({std::get<BufferPart>(groups), Access::read});
    append(std::move(command));
}

void Recording::fill(const Buffer& target, uint32_t value, uint64_t offset, uint64_t bytes) {
    if (bytes == 0) return;
    if (offset % 4 || bytes % 4 || offset + bytes > target.bytes())
        throw std::logic_error("fill of " + target.name() +
                               " outside the buffer or not a multiple of 4 bytes");
    append({.kind = Command::Kind::fill,
            .name = "fill " + target.name(),
            .uses = {{target, Access::write}},
            .fill_value = value,
            .target_offset = offset,
            .bytes = bytes});
}

void Recording::copy(const Buffer& source, uint64_t source_offset, const Buffer& target,
                     uint64_t target_offset, uint64_t bytes) {
    if (bytes == 0) return;
    if (source_offset + bytes > source.bytes() || target_offset + bytes > target.bytes())
        throw std::logic_error("copy from " + source.name() + " to " + target.name() + " outside a buffer");
    append({.kind = Command::Kind::copy,
            .name = "copy " + source.name(),
            .uses = {{source, Access::read}, {target, Access::write}},
            .source_offset = source_offset,
            .target_offset = target_offset,
            .bytes = bytes});
}

void Recording::write(const Buffer& target, uint64_t offset, std::span<const std::byte> bytes) {
    if (bytes.empty() || bytes.size() > kMostWritten || offset % 4 || bytes.size() % 4 ||
        offset + bytes.size() > target.bytes())
        throw std::logic_error("write of " + std::to_string(bytes.size()) + " bytes to " + target.name());
    append({.kind = Command::Kind::write,
            .name = "write " + target.name(),
            .uses = {{target, Access::write}},
            .push = {bytes.begin(), bytes.end()},
            .target_offset = offset,
            .bytes = bytes.size()});
}

void Recording::append(Command command) {
    // A command needs a barrier if, since the last one, memory that it reads was written, or memory that it
    // writes was read or written. Buffers may share memory.
    command.barrier_before = false;
    for (const Use& use : command.uses)
        for (const State& state : states_) {
            if (!state.written && !has(use.access, Access::write)) continue;
            if (state.buffer->overlaps(*use.part.buffer)) command.barrier_before = true;
        }
    if (command.barrier_before) {
        states_.clear();
        last_barrier_ = commands_.size();
    }
    // What an earlier barrier made visible, the last one makes visible again.
    command.barrier_for_groups = command.barrier_before && command.indirect();
    if (command.indirect() && last_barrier_ < commands_.size())
        commands_[last_barrier_].barrier_for_groups = true;
    for (const Use& use : command.uses) {
        auto state = std::find_if(states_.begin(), states_.end(),
                                  [&](const State& s) { return s.buffer == use.part.buffer; });
        if (state == states_.end()) state = states_.insert(states_.end(), {use.part.buffer, false, false});
        state->read = state->read || has(use.access, Access::read);
        state->written = state->written || has(use.access, Access::write);
    }
    commands_.push_back(std::move(command));
}

std::string Recording::describe() const {
    std::string text;
    for (const Command& command : commands_) {
        if (command.barrier_before) text += command.barrier_for_groups ? "barrier groups\n" : "barrier\n";
        text += command.name + ":";
        for (const Use& use : command.uses)
            text += (command.indirect() && &use == &command.uses.back() ? " groups " : " ") +
                    use.part.buffer->name() + (has(use.access, Access::read) ? ":r" : ":") +
                    (has(use.access, Access::write) ? "w" : "");
        text += "\n";
    }
    return text;
}

}  // namespace ewa::gpu
