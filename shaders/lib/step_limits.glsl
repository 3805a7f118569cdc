// SPDX-License-Identifier: Apache-2.0
// How far one step of the optimiser may go (docs/numerics.md, "Steps").
#ifndef EWA_LIB_STEP_LIMITS
#define EWA_LIB_STEP_LIMITS

// Steps that would take a splat out of every view, or its shape out of float32's range, end short of that: a mean's at
// STEP_DEPTH_SHARE of its depth, a quaternion's at STEP_NORM_SHARE of its norm, a scale's at the borders of what scales may
// be. depth: of a splat that is drawn, else without bound. Returns whether it did.
// The length of a step whose largest component is `longest`; squares of what is beyond 1e19 would overflow.
float step_length(vec4 step, float longest) { return longest * length(step / longest); }

bool limit_step(uint plane, vec4 value, float depth, inout vec4 moved) {
    const vec4 step = moved - value;
    if (plane == 0u) {
        const float most = float(STEP_DEPTH_SHARE) * depth;
        const float size = step_length(vec4(step.xyz, 0.0), max(max(abs(step.x), abs(step.y)), abs(step.z)));
        if (!(size > most)) return false;
        moved.xyz = value.xyz + step.xyz * (most / size);
        return true;
    }
    if (plane == 1u) {
        const vec4 old = abs(value), by = abs(step);
        const float most = float(STEP_NORM_SHARE) * max(max(old.x, old.y), max(old.z, old.w));
        const float size = step_length(step, max(max(by.x, by.y), max(by.z, by.w)));
        if (!(size > most)) return false;
        moved = value + step * (most / size);
        return true;
    }
    if (plane == 2u) {
        // A scale that is outside already may come back, and goes no further.
        const vec3 low = min(vec3(LOG_SCALE_MIN), value.xyz), high = max(vec3(LOG_SCALE_MAX), value.xyz);
        const bool outside = any(lessThan(moved.xyz, low)) || any(greaterThan(moved.xyz, high));
        if (outside) moved.xyz = clamp(moved.xyz, low, high);
        return outside;
    }
    return false;
}
#endif
