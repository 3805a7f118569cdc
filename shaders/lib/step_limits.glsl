// SPDX-License-Identifier: Apache-2.0
// Longest step of the optimiser (docs/numerics.md, "Steps").
#ifndef EWA_LIB_STEP_LIMITS
#define EWA_LIB_STEP_LIMITS

// Length of a step whose largest component is `longest`. Squares of components above 1e19 would overflow.
float step_length(vec4 step, float longest) { return longest * length(step / longest); }

// Shortens a step that would move a splat out of every view, or its shape out of float32's range. Limits: STEP_DEPTH_SHARE
// of the depth for a mean, STEP_NORM_SHARE of the norm for a quaternion, LOG_SCALE_MIN and LOG_SCALE_MAX for a scale.
// depth: of a visible splat; unbounded otherwise. Returns whether the step was shortened.
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
        // A scale that is already outside may come back, but moves no further out.
        const vec3 low = min(vec3(LOG_SCALE_MIN), value.xyz), high = max(vec3(LOG_SCALE_MAX), value.xyz);
        const bool outside = any(lessThan(moved.xyz, low)) || any(greaterThan(moved.xyz, high));
        if (outside) moved.xyz = clamp(moved.xyz, low, high);
        return outside;
    }
    return false;
}
#endif
