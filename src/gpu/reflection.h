// SPDX-License-Identifier: Apache-2.0
// What a SPIR-V module declares: its bindings and how it accesses them, push constants, specialisation
// constants. Recordings take every access from here.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

namespace ewa::gpu {

enum class Access : uint32_t { read = 1, write = 2, read_write = 3 };
enum class BindingKind { storage, uniform, texel };

struct Binding {
    uint32_t binding = 0;
    BindingKind kind = BindingKind::storage;
    Access access = Access::read_write;
};

struct Reflection {
    std::vector<Binding> bindings;  // of set 0; entry i is binding i
    uint32_t push_constant_bytes = 0;
    std::vector<uint32_t> constants;  // ids of the specialisation constants, ascending
};

/// Access of a storage block: read if every member is NonWritable, write if every member is NonReadable
/// (GLSL readonly and writeonly), else read_write. Uniform blocks and texel buffers: read. Push constants:
/// bytes up to the end of the last member. Throws std::logic_error if bindings are not numbered from 0
/// without gaps, or for a module of a kind that this project does not produce.
Reflection reflect(std::span<const uint32_t> spirv);

}  // namespace ewa::gpu
