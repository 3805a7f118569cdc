// SPDX-License-Identifier: Apache-2.0
// The SPIR-V modules embedded at build time, by the file name of their GLSL source without extension.
// texel_buffers: the build with texel buffers, or that with storage buffers in their place.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ewa::passes {

std::span<const std::uint32_t> shader_code(std::string_view name, bool texel_buffers);
/// The module with texel buffers, in which the build has inlined functions and resolved variables. Empty: there is none.
std::span<const std::uint32_t> optimised_code(std::string_view name);
/// The module for SPEC_LENSES = LENSES_PINHOLE, without that constant and the code of other lenses. Empty: there is none.
std::span<const std::uint32_t> pinhole_code(std::string_view name, bool texel_buffers);
std::vector<std::string_view> shader_names();

}  // namespace ewa::passes
