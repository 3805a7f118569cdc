// SPDX-License-Identifier: Apache-2.0
// The values of a photo and its camera. The pass declares the buffer `values`, and `push` with where they begin.
#ifndef EWA_LIB_PPISP_VALUES
#define EWA_LIB_PPISP_VALUES
#include "lib/ppisp.glsl"

Ppisp pushed_ppisp() {
    float own[PPISP_VALUES];
    [[unroll]] for (uint k = 0u; k < PPISP_PHOTO_VALUES; ++k) own[k] = values[push.photo + k];
    [[unroll]] for (uint k = 0u; k < PPISP_CAMERA_VALUES; ++k)
        own[PPISP_PHOTO_VALUES + k] = values[push.camera + k];
    return ppisp_of(own);
}
#endif
