// SPDX-License-Identifier: Apache-2.0
// Read-only buffers of texels. The build compiles each shader twice. With EWA_TEXEL_BUFFERS they are texel buffers, which
// are fast on CPU drivers. Without it they are storage buffers, which hold any number of texels.
//   TEXELS(binding, name);        fetch(name, index) is a vec4
//   WORD_TEXELS(binding, name);   fetch(name, index) is a uvec4
//   WORDS(binding, name);         fetch_word(name, index) is a uint; a texel holds four
//   COLOR_TEXELS(binding, name);  fetch_color(name, index) is RGBA, of 4 floats or 4 bytes: SPEC_COLOR_FLOATS
// Buffers of texels that a pass only writes. A CPU driver stores a texel in a loop over the lanes for each component, so the
// build with texel buffers stores two components at once, as one word of 64 bits.
//   STORED_TEXELS(binding, name);        name[index] = as_texel(a vec4)
//   STORED_WORD_TEXELS(binding, name);   name[index] = as_texel(a uvec4)
#ifndef EWA_LIB_FETCH
#define EWA_LIB_FETCH
#define COLOR_TEXELS(BINDING, NAME) \
    layout(constant_id = SPEC_COLOR_FLOATS) const uint COLOR_FLOATS = 0; \
    COLOR_BUFFER(BINDING, NAME)
#ifdef EWA_TEXEL_BUFFERS
#define TEXELS(BINDING, NAME) layout(set = 0, binding = BINDING) uniform samplerBuffer NAME
#define WORD_TEXELS(BINDING, NAME) layout(set = 0, binding = BINDING) uniform usamplerBuffer NAME
#define WORDS(BINDING, NAME) WORD_TEXELS(BINDING, NAME)
#define COLOR_BUFFER(BINDING, NAME) TEXELS(BINDING, NAME)
#define fetch(NAME, INDEX) texelFetch(NAME, int(INDEX))
#define fetch_word(NAME, INDEX) fetch(NAME, (INDEX) / 4u)[(INDEX) % 4u]
#define fetch_color(NAME, INDEX) texelFetch(NAME, int(INDEX))
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#define STORED_TEXELS(BINDING, NAME) \
    layout(set = 0, binding = BINDING, scalar) writeonly buffer Stored##BINDING { u64vec2 NAME[]; }
#define STORED_WORD_TEXELS(BINDING, NAME) STORED_TEXELS(BINDING, NAME)
u64vec2 as_texel(uvec4 words) { return u64vec2(packUint2x32(words.xy), packUint2x32(words.zw)); }
u64vec2 as_texel(vec4 texel) { return as_texel(floatBitsToUint(texel)); }
#else
#define TEXEL_BLOCK(BINDING, MEMBER) \
    layout(set = 0, binding = BINDING, scalar) readonly buffer Texels##BINDING { MEMBER; }
#define TEXELS(BINDING, NAME) TEXEL_BLOCK(BINDING, vec4 NAME[])
#define WORD_TEXELS(BINDING, NAME) TEXEL_BLOCK(BINDING, uvec4 NAME[])
#define WORDS(BINDING, NAME) TEXEL_BLOCK(BINDING, uint NAME[])
#define COLOR_BUFFER(BINDING, NAME) TEXEL_BLOCK(BINDING, uint NAME[])
#define fetch(NAME, INDEX) NAME[INDEX]
#define fetch_word(NAME, INDEX) NAME[INDEX]
#define STORED_TEXELS(BINDING, NAME) \
    layout(set = 0, binding = BINDING, scalar) writeonly buffer Stored##BINDING { vec4 NAME[]; }
#define STORED_WORD_TEXELS(BINDING, NAME) \
    layout(set = 0, binding = BINDING, scalar) writeonly buffer Stored##BINDING { uvec4 NAME[]; }
vec4 as_texel(vec4 texel) { return texel; }
uvec4 as_texel(uvec4 words) { return words; }
#define fetch_color(NAME, INDEX) \
    (COLOR_FLOATS == 0u          \
         ? unpackUnorm4x8(NAME[INDEX]) \
         : uintBitsToFloat(uvec4(NAME[4 * (INDEX)], NAME[4 * (INDEX) + 1], NAME[4 * (INDEX) + 2], NAME[4 * (INDEX) + 3])))
#endif
#endif
