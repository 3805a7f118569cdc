#version 460
// SPDX-License-Identifier: Apache-2.0
// Adds noise of a splat's own shape to its mean; transparent splats move more (Kheradmand et al. 2024, eq. 8): mean
// += amplitude sigmoid(-MCMC_GATE_SLOPE (opacity - MCMC_GATE_OPACITY)) Sigma n, at most `max_length` along each
// axis of the splat.
// One invocation owns splat i. It updates the splat's mean in place and counts shortened steps. With push.frozen it reads the
// moments, and a frozen splat stays.
// A frame whose instances did not fit changes nothing: the host repeats it.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/params.glsl"
#include "lib/quaternion.glsl"
#include "lib/random.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) buffer Params { vec4 params[]; };
layout(set = 0, binding = 1, scalar) buffer CountsBlock { Counts counts; };
layout(set = 0, binding = 2, scalar) readonly buffer Moments { uvec4 moments[]; };
layout(set = 0, binding = 3, scalar) uniform Values { PerturbBlock push; };

void main() {
    const uint i = item_index();
    if (i >= push.splats || counts.instances > push.instance_capacity) return;
    const uint at = param_texel(push.planes, 0u, i);
    if (push.frozen != 0u && is_frozen(moments[at])) return;
    const vec4 p0 = params[at];
    const vec3 scale = exp(params[param_texel(push.planes, 2u, i)].xyz);
    const float opacity = 1.0 / (1.0 + exp(-p0.w));
    const float gate = 1.0 / (1.0 + exp(float(MCMC_GATE_SLOPE) * (opacity - float(MCMC_GATE_OPACITY))));
    const vec3 normal = normal3(uvec4(push.first + i, push.step, push.seed[0], push.seed[1] ^ MCMC_NOISE_STREAM));
    float norm;
    const mat3 rotation = rotation_of(normalize_quaternion(params[param_texel(push.planes, 1u, i)], norm));
    // Noise of a splat larger than the scene is shortened to the scene's size.
    const vec3 along = push.amplitude * gate * (scale * scale * (normal * rotation));
    const float longest = max(max(abs(along.x), abs(along.y)), abs(along.z));
    const bool limited = longest > push.max_length;
    const vec3 moved = p0.xyz + rotation * (limited ? along * (push.max_length / longest) : along);
    if (is_finite(moved)) {
        params[at] = vec4(moved, p0.w);
        if (limited) atomicAdd(counts.limited_steps, 1u);
    }
}
