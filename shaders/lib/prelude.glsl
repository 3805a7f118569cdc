// SPDX-License-Identifier: Apache-2.0
// Included first by every pass.
#ifndef EWA_LIB_PRELUDE
#define EWA_LIB_PRELUDE
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
#include "shared/constants.h"
#include "shared/layouts.h"
#include "lib/fetch.glsl"

layout(constant_id = SPEC_GROUP_SIZE) const uint GROUP_SIZE = 64;
layout(constant_id = SPEC_CUT_OFF) const float CUT_OFF = float(ALPHA_MIN);

// This invocation's item, in a dispatch whose workgroups may fill several rows.
uint item_index() {
    return (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * GROUP_SIZE + gl_LocalInvocationID.x;
}

// The same, if neighbouring groups of items are in different rows: some drivers give each thread whole rows of workgroups.
uint dealt_index() {
    return (gl_WorkGroupID.x * gl_NumWorkGroups.y + gl_WorkGroupID.y) * GROUP_SIZE + gl_LocalInvocationID.x;
}

// A NaN fails every comparison, so it is not finite here.
bool is_finite(float x) { return abs(x) <= 3.402823466e38; }
bool is_finite(vec3 v) { return is_finite(v.x) && is_finite(v.y) && is_finite(v.z); }
bool is_finite(vec4 v) { return is_finite(v.xyz) && is_finite(v.w); }
#endif
