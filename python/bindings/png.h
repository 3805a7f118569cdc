// SPDX-License-Identifier: Apache-2.0
// Images as notebooks show them.
#pragma once
#include <nanobind/nanobind.h>

#include "ewa/image.h"

namespace ewa::python {

/// A PNG of an image with 3 or 4 channels.
nanobind::bytes png_bytes(const Image& image);

}  // namespace ewa::python
