// SPDX-License-Identifier: Apache-2.0
// A training image's exposure: an affine map of colours, three rows of (matrix row, offset), 12 floats.
#ifndef EWA_LIB_EXPOSURE
#define EWA_LIB_EXPOSURE
vec3 exposed_color(vec4 rows[3], vec3 color) {
    const vec4 c = vec4(color, 1.0);
    return vec3(dot(rows[0], c), dot(rows[1], c), dot(rows[2], c));
}
#endif
