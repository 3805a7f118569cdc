// SPDX-License-Identifier: Apache-2.0
// The gradient by a splat's place that a rolling shutter sees. The point moves the time of its row, and with it the camera.
// check/reference/readout.h has the formulas. Needs readout.glsl and lens_gradient.glsl.
#ifndef EWA_LIB_READOUT_GRADIENT
#define EWA_LIB_READOUT_GRADIENT

// dL/d(mean in camera coordinates) at the time of its row. by_log: as in lens_point_gradient. by_offset: the colour's, by the mean
// in the world. It counts here through the time alone. by_v: dL/d(the point's motion).
vec3 readout_point_gradient(FootprintGradient f, Projection p, float by_log, vec3 by_offset, out vec3 by_v) {
    const Readout o = p.readout;
    const vec3 turn = readout_turn(), shift = readout_shift_at(o.time), r = o.row, v = o.motion;
    vec3 v0, v1;
    lens_row_gradients(f, p, by_log, v0, v1);
    // The rows before they are sheared: j' = j + k (j . v) r, and k (j . v) = j' . v.
    const vec2 along = vec2(dot(p.image.jx, v), dot(p.image.jy, v));
    const vec3 jx = p.image.jx - along.x * r, jy = p.image.jy - along.y * r;
    const vec2 across = vec2(dot(v0, r), dot(v1, r));
    const float by_gain = dot(along, across);
    const vec3 by_r = along.x * v0 + along.y * v1 + o.gain * by_gain * v;
    by_v = o.gain * (across.x * jx + across.y * jy + by_gain * r);
    const vec2 rate = o.row == vec3(0.0) ? vec2(0.0)
                                         : vec2(camera.readout_slope[0] * camera.focal_hi[0], camera.readout_slope[1] * camera.focal_hi[1]);
    const vec3 point = point_of(p.view);
    const vec3 by_point = cross(by_v, turn) +
                          lens_bend_gradient(point, v0 + o.gain * across.x * v, v1 + o.gain * across.y * v, true) +
                          lens_bend_gradient(point, rate.x * by_r, rate.y * by_r, false);
    // The time turns the splat's axes and the motion, and moves the place that the colour is seen from.
    const float by_time = dot(turn, cross(v0, p.image.jx) + cross(v1, p.image.jy)) - dot(by_v, cross(turn, shift)) -
                          dot(by_offset, transpose(seen_rotation(p)) * shift);
    return exact_gradient(f, p) + by_point + o.gain * (dot(v, by_point) + by_time) * r;
}
#endif
