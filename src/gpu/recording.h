// SPDX-License-Identifier: Apache-2.0
// A list of device commands with what each reads and writes. It is plain data: it can be built, printed and
// tested with no device at work. Barriers follow from the declarations; nobody places one by hand.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "gpu/buffer.h"
#include "gpu/pipeline.h"

namespace ewa::gpu {

/// One binding of a dispatch: which buffer (or part of it) stands at a binding number, and what the kernel
/// does with it.
struct Use {
    uint32_t binding = 0;
    Access access = Access::read;
    const Buffer* buffer = nullptr;
    uint64_t offset = 0;  // bytes; other than 0 for uniform and storage bindings only
    uint64_t bytes = 0;   // 0: the rest of the buffer
};
inline Use reads(uint32_t binding, const Buffer& buffer) {
    return {binding, Access::read, &buffer};
}
inline Use writes(uint32_t binding, const Buffer& buffer) {
    return {binding, Access::write, &buffer};
}
inline Use updates(uint32_t binding, const Buffer& buffer) {
    return {binding, Access::read_write, &buffer};
}
inline Use reads_part(uint32_t binding, const Buffer& buffer, uint64_t offset, uint64_t bytes) {
    return {binding, Access::read, &buffer, offset, bytes};
}

struct Command {
    enum class Kind { dispatch, fill, copy } kind = Kind::dispatch;
    std::string name;
    std::vector<Use> uses;  // of a fill: the target; of a copy: source, then target
    const Pipeline* pipeline = nullptr;
    std::vector<std::byte> push;
    std::array<uint32_t, 3> groups{1, 1, 1};
    uint32_t fill_value = 0;
    uint64_t source_offset = 0, target_offset = 0, bytes = 0;
    bool barrier_before = false;  // derived
};

class Recording {
  public:
    explicit Recording(const Limits& limits) : limits_(limits) {}

    /// name: what the timing is reported under. Throws std::logic_error that names the shader and the binding
    /// when
    /// - the bindings are not exactly those the shader declares, or a declared access is not the shader's;
    /// - a texel or uniform binding stands on a buffer without that usage;
    /// - the push constants' size is not the shader's; a group count is zero or over the device's limit.
    void dispatch_bytes(const Pipeline& pipeline, std::string name, std::vector<Use> uses,
                        std::span<const std::byte> push, std::array<uint32_t, 3> groups);
    template <class Push>
    void dispatch(const Pipeline& pipeline, std::string name, std::vector<Use> uses, const Push& push,
                  std::array<uint32_t, 3> groups) {
        dispatch_bytes(pipeline, std::move(name), std::move(uses),
                       std::as_bytes(std::span<const Push>(&push, 1)), groups);
    }
    /// Sets bytes [offset, offset + bytes) to a repeated 32 bit value; both multiples of 4.
    void fill(const Buffer& target, uint32_t value, uint64_t offset, uint64_t bytes);
    void copy(const Buffer& source, uint64_t source_offset, const Buffer& target, uint64_t target_offset,
              uint64_t bytes);

    const std::vector<Command>& commands() const { return commands_; }
    /// One line a command: name, buffers with r, w or rw, and "barrier" where one precedes it.
    std::string describe() const;

  private:
    void append(Command command);

    Limits limits_;
    std::vector<Command> commands_;
    struct State {
        const Buffer* buffer;
        bool read, written;  // since the last barrier
    };
    std::vector<State> states_;
};

}  // namespace ewa::gpu
