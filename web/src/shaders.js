// SPDX-License-Identifier: Apache-2.0
// Shaders of the page. Formulas and constants are those of shaders/ (docs/numerics.md).

const kHeader = `#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
precision highp usampler2DArray;
`;

// SH of degree 1 to 3 in INRIA's order, after degree 0.
const kBands = [
    "",
    `c += sh(0u) * (-0.4886025119029199 * d.y) + sh(1u) * (0.4886025119029199 * d.z) + sh(2u) * (-0.4886025119029199 * d.x);`,
    `c += sh(3u) * (1.0925484305920792 * d.x * d.y) + sh(4u) * (-1.0925484305920792 * d.y * d.z)
       + sh(5u) * (0.31539156525252005 * (2.0 * d.z * d.z - d.x * d.x - d.y * d.y))
       + sh(6u) * (-1.0925484305920792 * d.x * d.z) + sh(7u) * (0.5462742152960396 * (d.x * d.x - d.y * d.y));`,
    `c += sh(8u) * (-0.5900435899266435 * d.y * (3.0 * d.x * d.x - d.y * d.y)) + sh(9u) * (2.890611442640554 * d.x * d.y * d.z)
       + sh(10u) * (-0.4570457994644658 * d.y * (4.0 * d.z * d.z - d.x * d.x - d.y * d.y))
       + sh(11u) * (0.3731763325901154 * d.z * (2.0 * d.z * d.z - 3.0 * d.x * d.x - 3.0 * d.y * d.y))
       + sh(12u) * (-0.4570457994644658 * d.x * (4.0 * d.z * d.z - d.x * d.x - d.y * d.y))
       + sh(13u) * (1.445305721320277 * d.z * (d.x * d.x - d.y * d.y))
       + sh(14u) * (-0.5900435899266435 * d.x * (d.x * d.x - 3.0 * d.y * d.y));`];

/// The vertex shader of a scene: what it does not need is left out. chunks: how many chunks it is made of; missing for one SOG.
export function splatVertex({degree, antialias, chunks}) {
    const coefficients = [0, 3, 8, 15][degree], many = chunks !== undefined;
    return kHeader + `
uniform usampler2D splats;
uniform sampler2D codebooks;
${degree > 0 ? `uniform usampler2D${many ? "Array" : ""} palette;` : ""}
uniform mat3 rotation;
uniform vec3 eye;
uniform vec4 lens;      // fx, fy, cx, cy in px
uniform vec2 size;      // px
layout(location = 0) in uint index;
out vec2 at;            // standard deviations
flat out vec4 tint;     // colour and opacity

${many ? "int chunk;" : ""}
float code(uint word, int channel, int table) {
    return texelFetch(codebooks, ivec2(int(word >> (8 * channel) & 255u), table${many ? " + 3 * chunk" : ""}), 0).x;
}
vec3 codes(uint word, int table) { return vec3(code(word, 0, table), code(word, 1, table), code(word, 2, table)); }

mat3 rotation_of(uint word) {
    vec3 others = (vec3(uvec3(word, word >> 8, word >> 16) & 255u) / 255.0 - 0.5) * 1.4142135623730951;
    float largest = sqrt(max(0.0, 1.0 - dot(others, others)));
    uint which = (word >> 24) - 252u;
    vec4 q = which == 0u ? vec4(largest, others) : which == 1u ? vec4(others.x, largest, others.yz)
           : which == 2u ? vec4(others.xy, largest, others.z) : vec4(others, largest);
    q /= length(q);
    float w = q.x, x = q.y, y = q.z, z = q.w;
    return mat3(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y),
                2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x),
                2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y));
}
${degree > 0 ? `
uint row;
vec3 sh(uint k) {
    uvec4 word = texelFetch(palette, ivec${many ? 3 : 2}(int((row & 63u) * ${coefficients}u + k), int(row >> 6)${many ? ", chunk" : ""}), 0);
    return codes(word.x | word.y << 8 | word.z << 16, 2);
}` : ""}
vec3 color_of(uint word, vec3 d) {
    vec3 c = 0.28209479177387814 * codes(word, 1);
    ${kBands.slice(1, degree + 1).join("\n    ")}
    return max(vec3(0.0), c + 0.5);
}

void main() {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    ivec2 texel = ivec2(int(index & 1023u) * 2, int(index >> 10));
    uvec4 a = texelFetch(splats, texel, 0), b = texelFetch(splats, texel + ivec2(1, 0), 0);
    ${many ? "chunk = int(b.w);" : ""}
    vec3 relative = uintBitsToFloat(a.xyz) - eye, p = rotation * relative;
    if (!(p.z > 0.01)) return;

    vec2 slope = p.xy / p.z, margin = 0.15 * size / lens.xy;
    vec2 bounded = clamp(slope, -(lens.zw / lens.xy + margin), (size - lens.zw) / lens.xy + margin);
    mat3 m = rotation * rotation_of(b.x);
    vec3 scale = codes(b.y, 0);
    mat3 axes = mat3(m[0] * scale.x, m[1] * scale.y, m[2] * scale.z);
    // Rows of M = J W R S.
    vec3 depth = vec3(axes[0].z, axes[1].z, axes[2].z);
    vec3 u = lens.x / p.z * (vec3(axes[0].x, axes[1].x, axes[2].x) - bounded.x * depth);
    vec3 v = lens.y / p.z * (vec3(axes[0].y, axes[1].y, axes[2].y) - bounded.y * depth);
    const float low_pass = ${antialias ? 0.1 : 0.3};
    float uu = dot(u, u), vv = dot(v, v), xy = dot(u, v), x = uu + low_pass, y = vv + low_pass;
    vec3 minors = cross(u, v);
    float plain = dot(minors, minors), det = plain + low_pass * (uu + vv) + low_pass * low_pass;
    float opacity = float(b.z >> 24) / 255.0;
    ${antialias ? "opacity *= sqrt(plain / det);" : ""}
    if (!(opacity * 255.0 >= 1.0)) return;

    float reach = sqrt(2.0 * log(opacity * 255.0)) + 1e-3;
    float larger = 0.5 * (x + y) + length(vec2(0.5 * (x - y), xy)), smaller = det / larger;
    vec2 axis = x >= y ? vec2(larger - y, xy) : vec2(xy, larger - x);
    axis = dot(axis, axis) > 0.0 ? normalize(axis) : vec2(1.0, 0.0);
    at = reach * (vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0);
    vec2 pixel = lens.xy * slope + lens.zw + at.x * sqrt(larger) * axis + at.y * sqrt(smaller) * vec2(-axis.y, axis.x);
    ${degree > 0 ? "row = a.w;" : ""}
    tint = vec4(color_of(b.z, normalize(relative)), opacity);
    gl_Position = vec4(vec2(2.0, -2.0) * pixel / size + vec2(-1.0, 1.0), 0.0, 1.0);
}`;
}

export const splatFragment = kHeader + `
in vec2 at;
flat in vec4 tint;
out vec4 result;
void main() {
    float alpha = min(0.99, tint.a * exp(-0.5 * dot(at, at)));
    if (alpha < 1.0 / 255.0) discard;
    result = vec4(tint.rgb * alpha, alpha);
}`;

export const screenVertex = kHeader + `
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }`;

export const screenFragment = kHeader + `
uniform highp sampler2D picture;
uniform vec3 background;
out vec4 result;
void main() {
    vec4 c = texelFetch(picture, ivec2(gl_FragCoord.xy), 0);
    result = vec4(c.rgb + (1.0 - c.a) * background, 1.0);
}`;
