// SPDX-License-Identifier: Apache-2.0
// Marks of splats: which are hidden, and the colours of the others. The including pass declares MODE.
#ifndef EWA_LIB_MARKS
#define EWA_LIB_MARKS
const bool MARKED = (MODE & PROJECT_MARKS) != 0u;
layout(set = 0, binding = 6, scalar) readonly buffer Marks { uint marks[]; };

// The mark of splat i; 0 without PROJECT_MARKS.
uint mark_of(uint i) {
    if (!MARKED) return 0u;
    return marks[i / 4u] >> (8u * (i % 4u)) & 255u;
}

// The last of several tints shows most.
vec3 tinted(vec3 color, uint mark) {
    if ((mark & MARK_LOCKED) != 0u) color *= float(MARK_LOCKED_LIGHT);
    const vec3 accent = vec3(1.0, MARK_ACCENT_GREEN, MARK_ACCENT_BLUE);
    if ((mark & MARK_SELECTED) != 0u) color = mix(color, accent, float(MARK_SHARE));
    if ((mark & MARK_PREVIEW) != 0u) color = mix(color, vec3(1.0, 0.0, 0.0), float(MARK_SHARE));
    return color;
}

// Splats of a preview are seen even if they are almost transparent. A NaN stays one.
float shown_opacity(float opacity, uint mark) {
    const float least = 0.3;
    return (mark & MARK_PREVIEW) == 0u || !(opacity < least) ? opacity : least;
}
#endif
