// SPDX-License-Identifier: Apache-2.0
// Rotation of a quaternion (w, x, y, z) of any non-zero norm.
#ifndef EWA_LIB_QUATERNION
#define EWA_LIB_QUATERNION

// Divides by the largest component first, so that norms from 1e-38 to 1e38 neither overflow nor underflow.
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

// dL/dq of the unit quaternion, from dL/d(rotation about its own axes). A rotation by small angles w is q (1, w / 2), so
// the gradient is 2 q (0, torque), at right angles to q.
vec4 torque_on_quaternion(vec4 q, vec3 torque) {
    return 2.0 * vec4(-dot(q.yzw, torque), q.x * torque + cross(q.yzw, torque));
}
#endif
