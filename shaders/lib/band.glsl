// SPDX-License-Identifier: Apache-2.0
// A band of a view's tile rows is drawn as an image of its own.
#ifndef EWA_LIB_BAND
#define EWA_LIB_BAND
#include "lib/double_float.glsl"

// A record's first texel in the image that begins at this row of the view.
vec4 from_row(vec4 record0, uint row) {
    if (row == 0u) return record0;
    const vec2 y = df_add(record0.yw, vec2(-float(row), 0.0));
    return vec4(record0.x, y.x, record0.z, y.y);
}
#endif
