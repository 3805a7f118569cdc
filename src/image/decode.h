// SPDX-License-Identifier: Apache-2.0
// Pictures from the bytes of a file that stands inside another.
#pragma once
#include <string>
#include <vector>

#include "ewa/image.h"

namespace ewa::image {

/// A PNG or JPEG, as load_image gives it. Throws InputError that begins with `what`: also for another format,
/// or more than `largest` pixels in a direction.
Image decode(const std::vector<unsigned char>& bytes, const std::string& what, int largest);

}  // namespace ewa::image
