// SPDX-License-Identifier: Apache-2.0
// The buffers of a mesh scene, and functions that read them. shared/layouts.h describes their texels. The including
// pass binds them at 0 to 5.
#ifndef EWA_LIB_MESH
#define EWA_LIB_MESH

layout(constant_id = SPEC_ALPHA_TESTED) const uint ALPHA_TESTED = 0u;
WORD_TEXELS(0, nodes);
WORD_TEXELS(1, triangles);
WORD_TEXELS(2, surfaces);
WORD_TEXELS(3, materials);
WORD_TEXELS(4, textures);
COLOR_TEXELS(5, texels);

struct Surface {
    vec3 normal;     // shading normal, world axes, on the front side; zero if the file has none
    vec2 uv;
    vec4 color;      // linear
};

struct Material {
    vec3 base, emitted;  // linear
    float opacity, metallic, roughness, f0, f90, cutoff, light_density;
    uint flags;
};

// Octahedral encoding (Meyer et al. 2010).
vec3 unpack_normal(uint bits) {
    const vec2 e = unpackSnorm2x16(bits);
    vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    if (n.z < 0.0) n.xy = (1.0 - abs(e.yx)) * vec2(e.x >= 0.0 ? 1.0 : -1.0, e.y >= 0.0 ? 1.0 : -1.0);
    return n;
}

Surface surface_at(uint triangle, vec2 barycentric) {
    const int at = int(triangle * SURFACE_TEXELS);
    const uvec4 a = fetch(surfaces, at), b = fetch(surfaces, at + 1), c = fetch(surfaces, at + 2);
    const vec3 w = vec3(1.0 - barycentric.x - barycentric.y, barycentric);
    Surface s;
    // This word marks a missing normal; no direction packs to it.
    s.normal = a.x == 0x80008000u ? vec3(0.0)
                                  : w.x * normalize(unpack_normal(a.x)) + w.y * normalize(unpack_normal(a.y)) +
                                        w.z * normalize(unpack_normal(a.z));
    s.uv = w.x * uintBitsToFloat(b.xy) + w.y * uintBitsToFloat(b.zw) + w.z * uintBitsToFloat(c.xy);
    s.color = w.x * unpackUnorm4x8(a.w) + w.y * unpackUnorm4x8(c.z) + w.z * unpackUnorm4x8(c.w);
    return s;
}

int wrapped(int i, int size, uint mode) {
    if (mode == WRAP_CLAMP) return clamp(i, 0, size - 1);
    const int period = mode == WRAP_MIRROR ? 2 * size : size;
    const int r = i - period * int(floor(float(i) / float(period)));
    const int inside = clamp(r, 0, period - 1);
    return inside < size ? inside : period - 1 - inside;
}

vec3 linear_of_srgb(vec3 v) {
    return mix(v / 12.92, pow((v + 0.055) / 1.055, vec3(2.4)), greaterThan(v, vec3(0.04045)));
}

// Bilinear, of linearised values. It uses the finest level only: paths take many samples.
vec4 sample_texture(uint index, vec2 uv, bool srgb) {
    const uvec4 t = fetch(textures, index);
    const ivec2 size = ivec2(t.yz);
    // uv beyond this range is noise at any size. NaN becomes 0.
    const vec2 p = clamp(uv, vec2(-1048576.0), vec2(1048576.0)) * vec2(size) -
                   ((t.w & TEXTURE_NEAREST) != 0u ? vec2(0.0) : vec2(0.5));
    const vec2 corner = clamp(floor(p), vec2(-2e9), vec2(2e9));
    const vec2 f = (t.w & TEXTURE_NEAREST) != 0u ? vec2(0.0) : p - corner;
    vec4 sum = vec4(0.0);
    [[unroll]] for (int k = 0; k < 4; ++k) {
        const ivec2 step = ivec2(k & 1, k >> 1);
        const int x = wrapped(int(corner.x) + step.x, size.x, t.w & 3u);
        const int y = wrapped(int(corner.y) + step.y, size.y, (t.w >> TEXTURE_WRAP_T_SHIFT) & 3u);
        vec4 value = fetch_color(texels, int(t.x) + y * size.x + x);
        if (srgb) value.rgb = linear_of_srgb(value.rgb);
        sum += (step.x == 0 ? 1.0 - f.x : f.x) * (step.y == 0 ? 1.0 - f.y : f.y) * value;
    }
    return sum;
}

Material material_at(uint index, Surface s) {
    const int at = int(index * MATERIAL_TEXELS);
    const vec4 a = uintBitsToFloat(fetch(materials, at)), b = uintBitsToFloat(fetch(materials, at + 1)),
               c = uintBitsToFloat(fetch(materials, at + 2));
    const uvec4 d = fetch(materials, at + 3);
    Material m;
    m.base = a.rgb * s.color.rgb;
    m.opacity = a.a * s.color.a;
    m.metallic = b.x;
    m.roughness = b.y;
    m.f0 = b.z;
    m.f90 = b.w;
    m.emitted = c.rgb;
    m.cutoff = c.a;
    m.flags = d.w;
    m.light_density = uintBitsToFloat(fetch(materials, at + 4).x);
    if (d.x != NO_TEXTURE) {
        const vec4 texel = sample_texture(d.x, s.uv, true);
        m.base *= texel.rgb;
        m.opacity *= texel.a;
    }
    if (d.y != NO_TEXTURE) {
        const vec4 texel = sample_texture(d.y, s.uv, false);
        m.roughness *= texel.g;
        m.metallic *= texel.b;
    }
    if (d.z != NO_TEXTURE) m.emitted *= sample_texture(d.z, s.uv, true).rgb;
    if ((m.flags & MATERIAL_UNLIT) != 0u) m.emitted *= s.color.rgb;
    return m;
}

// Opacity only, for rays that may pass through the surface.
float opacity_at(uint triangle, uint material, vec2 barycentric, out uint flags, out float cutoff) {
    const Surface s = surface_at(triangle, barycentric);
    const int at = int(material * MATERIAL_TEXELS);
    const uvec4 d = fetch(materials, at + 3);
    float opacity = uintBitsToFloat(fetch(materials, at).w) * s.color.a;
    if (d.x != NO_TEXTURE) opacity *= sample_texture(d.x, s.uv, false).a;
    flags = d.w;
    cutoff = uintBitsToFloat(fetch(materials, at + 2).w);
    return opacity;
}
#endif
