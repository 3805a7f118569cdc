// SPDX-License-Identifier: Apache-2.0
// Read-only buffers of texels. The build compiles each shader twice. With EWA_TEXEL_BUFFERS they are texel buffers, which
// are fast on CPU drivers. Without it they are storage buffers, which hold any number of texels.
//   TEXELS(binding, name);        fetch(name, index) is a vec4
//   WORD_TEXELS(binding, name);   fetch(name, index) is a uvec4
//   COLOR_TEXELS(binding, name);  fetch_color(name, index) is RGBA, of 4 floats or 4 bytes: SPEC_COLOR_FLOATS
#ifndef EWA_LIB_FETCH
#define EWA_LIB_FETCH
#define COLOR_TEXELS(BINDING, NAME) \
    layout(constant_id = SPEC_COLOR_FLOATS) const uint COLOR_FLOATS = 0; \
    COLOR_BUFFER(BINDING, NAME)
#ifdef EWA_TEXEL_BUFFERS
#define TEXELS(BINDING, NAME) layout(set = 0, binding = BINDING) uniform samplerBuffer NAME
#define WORD_TEXELS(BINDING, NAME) layout(set = 0, binding = BINDING) uniform usamplerBuffer NAME
#define COLOR_BUFFER(BINDING, NAME) TEXELS(BINDING, NAME)
#define fetch(NAME, INDEX) texelFetch(NAME, int(INDEX))
#define fetch_color(NAME, INDEX) texelFetch(NAME, int(INDEX))
#else
#define TEXEL_BLOCK(BINDING, MEMBER) \
    layout(set = 0, binding = BINDING, scalar) readonly buffer Texels##BINDING { MEMBER; }
#define TEXELS(BINDING, NAME) TEXEL_BLOCK(BINDING, vec4 NAME[])
#define WORD_TEXELS(BINDING, NAME) TEXEL_BLOCK(BINDING, uvec4 NAME[])
#define COLOR_BUFFER(BINDING, NAME) TEXEL_BLOCK(BINDING, uint NAME[])
#define fetch(NAME, INDEX) NAME[INDEX]
#define fetch_color(NAME, INDEX) \
    (COLOR_FLOATS == 0u          \
         ? unpackUnorm4x8(NAME[INDEX]) \
         : uintBitsToFloat(uvec4(NAME[4 * (INDEX)], NAME[4 * (INDEX) + 1], NAME[4 * (INDEX) + 2], NAME[4 * (INDEX) + 3])))
#endif
#endif
