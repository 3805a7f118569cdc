// SPDX-License-Identifier: Apache-2.0
// The box that new splats come from. Its corners are relative to the model's origin, as means are.
#ifndef EWA_LIB_REGION
#define EWA_LIB_REGION
bool in_region(float region[6], vec3 mean) {
    return all(greaterThanEqual(mean, vec3(region[0], region[1], region[2]))) &&
           all(lessThanEqual(mean, vec3(region[3], region[4], region[5])));
}
#endif
