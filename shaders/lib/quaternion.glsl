// SPDX-License-Identifier: Apache-2.0
// Rotation of a quaternion (w, x, y, z) of any non-zero norm.
#ifndef EWA_LIB_QUATERNION
#define EWA_LIB_QUATERNION

// The largest component is divided out first, so that norms from 1e-38 to 1e38 neither overflow nor vanish.
vec4 normalize_quaternion(vec4 q, out float norm) {
    const float largest = max(max(abs(q.x), abs(q.y)), max(abs(q.z), abs(q.w)));
    const vec4 scaled = q / largest;
    const float scaled_norm = sqrt(dot(scaled, scaled));
    norm = largest * scaled_norm;
    return scaled / scaled_norm;
}

mat3 rotation_of(vec4 q) {
    const float w = q.x, x = q.y, y = q.z, z = q.w;
    return mat3(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y),
                2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x),
                2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y));
}

// dL/dq of the unit quaternion, from dL/dR (columns as in rotation_of).
vec4 rotation_backward(vec4 q, mat3 g) {
    const float w = q.x, x = q.y, y = q.z, z = q.w;
    return 2.0 * vec4(x * (g[1][2] - g[2][1]) + y * (g[2][0] - g[0][2]) + z * (g[0][1] - g[1][0]),
                      -2.0 * x * (g[1][1] + g[2][2]) + y * (g[1][0] + g[0][1]) + z * (g[2][0] + g[0][2]) +
                          w * (g[1][2] - g[2][1]),
                      x * (g[1][0] + g[0][1]) - 2.0 * y * (g[0][0] + g[2][2]) + z * (g[2][1] + g[1][2]) +
                          w * (g[2][0] - g[0][2]),
                      x * (g[2][0] + g[0][2]) + y * (g[2][1] + g[1][2]) - 2.0 * z * (g[0][0] + g[1][1]) +
                          w * (g[0][1] - g[1][0]));
}
#endif
