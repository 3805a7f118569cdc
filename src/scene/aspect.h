// SPDX-License-Identifier: Apache-2.0
// Whether one picture can be another one resized.
#pragma once

namespace ewa::scene {

/// True where a picture of the new size is the old one resized by one factor, each side rounded to a whole
/// pixel. A factor near 1 has to be exact: a picture a pixel off is another picture (cropped, or of another
/// camera).
bool same_shape(int old_width, int old_height, int width, int height);

}  // namespace ewa::scene
