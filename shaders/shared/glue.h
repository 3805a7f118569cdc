// SPDX-License-Identifier: Apache-2.0
// Makes one header legal in both GLSL and C++. In C++ a constant is a double, so that the CPU reference
// computes with the exact decimal value. In GLSL it is a float. Struct members use the scalar block layout,
// which is C++'s own layout for these packed types.
#ifndef EWA_SHARED_GLUE_H
#define EWA_SHARED_GLUE_H

#ifdef __cplusplus
#include <cstddef>
#include <cstdint>
#define EWA_REAL(name, value) inline constexpr double name = value
#define EWA_UINT(name, value) inline constexpr std::uint32_t name = value
#define EWA_BEGIN_SHARED namespace ewa::shared {
#define EWA_END_SHARED }
namespace ewa::shared {
using uint = std::uint32_t;
struct vec2 {
    float x, y;
};
struct vec3 {
    float x, y, z;
};
struct vec4 {
    float x, y, z, w;
};
}  // namespace ewa::shared
#else
#define EWA_REAL(name, value) const float name = value
#define EWA_UINT(name, value) const uint name = value
#define EWA_BEGIN_SHARED
#define EWA_END_SHARED
#endif

#endif
