// SPDX-License-Identifier: Apache-2.0
// Blending of spheres at the pixels of a lane's column. Needs tile.glsl. Both directions share it: they must agree on the
// spheres that a pixel has.
#ifndef EWA_LIB_SPHERE_BLENDING
#define EWA_LIB_SPHERE_BLENDING
layout(constant_id = SPEC_NEAREST) const uint NEAREST = 8;

struct Meeting {
    float u, v;
    float raw;     // 1 - (u^2 + v^2)
    float alpha;   // 0 if the sphere is not drawn at the pixel
    float weight;  // alpha * T
};

// Sphere s at pixel p of the lane's column. left: how many more spheres the pixel takes. It counts down, and is 0 behind the
// sphere that takes T to TRANSMITTANCE_STOP. T: the transmittance in front of the sphere; it becomes that behind it.
// A record beyond the end of the list has opacity 0.
Meeting meet_sphere(LaneSplat s, uint p, inout uint left, inout float T) {
    Meeting m;
    EXACT const float u = s.u + s.u_step * float(p), v = s.v + s.v_step * float(p), q = u * u + v * v;
    m.u = u;
    m.v = v;
    m.raw = 1.0 - q;
    // A NaN draws nothing.
    const bool drawn = q < 1.0 && left > 0u && s.opacity > 0.0;
    m.alpha = drawn ? min(float(ALPHA_MAX), m.raw) : 0.0;
    m.weight = m.alpha * T;
    EXACT const float next = T - T * m.alpha;
    T = next;
    left = next > float(TRANSMITTANCE_STOP) ? left - (drawn ? 1u : 0u) : 0u;
    return m;
}
#endif
