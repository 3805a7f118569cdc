// SPDX-License-Identifier: Apache-2.0
// A list of device commands. It is plain data: it can be built, printed and tested without a running device.
// What a shader reads and writes is derived from its SPIR-V, and barriers follow from that. Nobody declares
// an access or places a barrier by hand.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "gpu/buffer.h"
#include "gpu/pipeline.h"

namespace ewa::gpu {

/// A buffer, or a part of one, for one binding of a dispatch.
struct BufferPart {
    BufferPart(const Buffer& whole) : buffer(&whole) {}
    /// offset, size: bytes. Uniform and storage bindings only.
    BufferPart(const Buffer& of, uint64_t from, uint64_t size) : buffer(&of), offset(from), bytes(size) {}

    const Buffer* buffer;
    uint64_t offset = 0;
    uint64_t bytes = 0;  // 0: the rest of the buffer
};

/// A buffer part and how a command accesses it.
struct Use {
    BufferPart part;
    Access access;
};

/// Workgroups of a dispatch along x, y and z: numbers, or a part of a buffer with a VkDispatchIndirectCommand, which the device
/// reads. The device's numbers may be 0, and must not exceed its limits.
using Workgroups = std::variant<std::array<uint32_t, 3>, BufferPart>;

struct Command {
    enum class Kind { dispatch, fill, copy, write } kind = Kind::dispatch;
    std::string name;
    // dispatch: by binding, then the buffer with the workgroups if there is one; fill, write: the target; copy: source, then target
    std::vector<Use> uses;
    const Pipeline* pipeline = nullptr;
    std::vector<std::byte> push{};  // write: the bytes
    Workgroups groups = std::array<uint32_t, 3>{1, 1, 1};
    uint32_t fill_value = 0;
    uint64_t source_offset = 0, target_offset = 0, bytes = 0;
    bool barrier_before = false;  // derived
    // Derived: the barrier is also for workgroups in a buffer, of this command or of one up to the next barrier.
    bool barrier_for_groups = false;
    bool indirect() const { return std::holds_alternative<BufferPart>(groups); }
};

class Recording {
  public:
    explicit Recording(const Limits& limits) : limits_(limits) {}

    /// name: the timing's name. parts: entry i is bound at binding i. Throws std::logic_error that names the
    /// shader and the binding when
    /// - the number of parts is not the shader's number of bindings;
    /// - a buffer lacks the usage of its texel or uniform binding;
    /// - the push constants' size is not the shader's;
    /// - a group count is zero or over the device's limit, or its place in a buffer is not a multiple of 4 bytes or not inside.
    void dispatch(const Pipeline& pipeline, std::string name, std::span<const BufferPart> parts,
                  std::span<const std::byte> push, const Workgroups& groups);
    /// Sets bytes [offset, offset + bytes) to a repeated 32-bit value. Both are multiples of 4.
    void fill(const Buffer& target, uint32_t value, uint64_t offset, uint64_t bytes);
    void copy(const Buffer& source, uint64_t source_offset, const Buffer& target, uint64_t target_offset,
              uint64_t bytes);
    /// Writes bytes that are part of the recording. Their number and the offset are multiples of 4.
    void write(const Buffer& target, uint64_t offset, std::span<const std::byte> bytes);
    static constexpr size_t kMostWritten = 65536;  // bytes
    /// Adds a command that may come from another recording. Its barrier is derived again.
    void append(Command command);

    const std::vector<Command>& commands() const { return commands_; }
    /// One line a command: name, buffers with r, w or rw, and a line "barrier" before it where it has one. "groups" is before the
    /// buffer with the workgroups, and after a barrier for one.
    std::string describe() const;

  private:
    Limits limits_;
    std::vector<Command> commands_;
    struct State {
        const Buffer* buffer;
        bool read, written;  // since the last barrier
    };
    std::vector<State> states_;
    size_t last_barrier_ = SIZE_MAX;  // index of the last command with one
};

}  // namespace ewa::gpu
