// SPDX-License-Identifier: Apache-2.0
// The SPIR-V modules embedded at build time, by the file name of their GLSL source without extension.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ewa::passes {

std::span<const std::uint32_t> shader_code(std::string_view name);
std::vector<std::string_view> shader_names();

}  // namespace ewa::passes
