// SPDX-License-Identifier: Apache-2.0
// What a SPIR-V module declares about its bindings: the truth that a pass's own declaration is held against.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace ewa::gpu {

enum class Access : uint32_t { read = 1, write = 2, read_write = 3 };
enum class BindingKind { storage, uniform, texel };

std::string to_string(Access access);

struct Binding {
    uint32_t binding = 0;
    BindingKind kind = BindingKind::storage;
    Access access = Access::read_write;
};

struct Reflection {
    std::vector<Binding> bindings;  // of set 0, ascending; every variable the module declares
    uint32_t push_constant_bytes = 0;
};

/// Storage blocks: read where every member is NonWritable, write where every member is NonReadable, else
/// read_write (GLSL readonly and writeonly). Uniform blocks and texel buffers: read. Push constants: bytes
/// up to the end of the last member. Throws std::logic_error for a module this project
/// does not produce.
Reflection reflect(std::span<const uint32_t> spirv);

}  // namespace ewa::gpu
