// SPDX-License-Identifier: Apache-2.0
// Vectors of three numbers, and rotations as three rows.
export const add = (a, b, scale = 1) => a.map((v, i) => v + scale * b[i]);
export const subtract = (a, b) => a.map((v, i) => v - b[i]);
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const length = (a) => Math.hypot(...a);
export const normalize = (a) => a.map((v) => v / length(a));
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/// The vector turned about a unit axis by an angle (Rodrigues).
export const turn = (a, axis, angle) => {
    const c = Math.cos(angle), s = Math.sin(angle), across = cross(axis, a), along = dot(axis, a) * (1 - c);
    return a.map((v, i) => v * c + across[i] * s + axis[i] * along);
};
