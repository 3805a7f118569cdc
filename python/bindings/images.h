// SPDX-License-Identifier: Apache-2.0
// Images as arguments, and as notebooks show them.
#pragma once
#include <nanobind/nanobind.h>

#include <string>

#include "ewa/image.h"

namespace ewa::python {

/// [H, W, 3] or [H, W, 4], from 0 to 1; integers are from 0 to 255. Or the path of an image. Throws ValueError that names the argument,
/// and InputError.
Image image_of(nanobind::handle value, const std::string& name);
/// [H, W]
Image weights_of(nanobind::handle value);

/// A PNG of an image with 3 or 4 channels.
nanobind::bytes png_bytes(const Image& image);

}  // namespace ewa::python
