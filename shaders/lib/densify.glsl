// SPDX-License-Identifier: Apache-2.0
// What adaptive density control does with one splat (3DGS, section 5.2 and densify_and_prune of its code). A splat
// whose mean gradient reaches the threshold is cloned if it is small and split if it is large. A splat that has
// become transparent is pruned, and one that is too large once prune_scale is set. The children of a split are judged
// by their own size. A negative number of views prunes, whatever the splat is like. All else keeps a frozen splat. Outside of the region no splat
// grows. A splat whose largest scale is above the distance of its mean to every point of the cameras' ball is pruned.
#ifndef EWA_LIB_DENSIFY
#define EWA_LIB_DENSIFY
#include "region.glsl"
const uint ACTION_PRUNE = 0u, ACTION_KEEP = 1u, ACTION_CLONE = 2u, ACTION_SPLIT = 3u;

uint outputs_of(uint action) { return min(action, 2u); }

uint action_of(DensifyPush push, vec4 mean_logit, vec4 quaternion, vec4 scale_red, vec2 statistics, bool frozen) {
    if (frozen) return statistics.y < 0.0 ? ACTION_PRUNE : ACTION_KEEP;
    const bool whole = is_finite(mean_logit) && is_finite(quaternion) && is_finite(scale_red);
    const bool opaque = mean_logit.w >= push.prune_opacity;
    if (!(whole && opaque) || statistics.y < 0.0) return ACTION_PRUNE;
    const float size = exp(max(scale_red.x, max(scale_red.y, scale_red.z)));
    const vec3 middle = vec3(push.ball[0], push.ball[1], push.ball[2]);
    if (size > length(mean_logit.xyz - middle) + push.ball[3]) return ACTION_PRUNE;
    const bool limited = push.prune_scale > 0.0;
    const bool grow = statistics.y > 0.0 && statistics.x / statistics.y >= push.grow_gradient &&
                      in_region(push.region, mean_logit.xyz);
    if (grow && size > push.split_scale)
        return limited && size / float(SPLIT_SCALE) > push.prune_scale ? ACTION_PRUNE : ACTION_SPLIT;
    if (limited && size > push.prune_scale) return ACTION_PRUNE;
    return grow ? ACTION_CLONE : ACTION_KEEP;
}

// -ln(1 - opacity)
float thickness_of(float logit) { return max(logit, 0.0) + log(1.0 + exp(-abs(logit))); }

// Logit of 1 - (1 - opacity)^share: so many splats of that opacity in one place as fit into 1 / share transmit as much as one of
// `logit`. The small opacity is a series, where 1 - exp would cancel.
float thinned_logit(float logit, float share) {
    const float thickness = share * thickness_of(logit);
    const float small = thickness * (1.0 - thickness * (0.5 - thickness * (1.0 / 6.0 - thickness / 24.0)));
    return log(thickness < 0.1 ? small : 1.0 - exp(-thickness)) + thickness;
}
#endif
