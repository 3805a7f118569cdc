// SPDX-License-Identifier: Apache-2.0
// A module as another version of ewa would have it. Nothing of it may be called.
#include <cstdlib>

#include "image/openimageio.h"

namespace {
ewa::image::OpenImageIO* instance() {
    std::abort();
}
}  // namespace

extern "C" const ewa::image::OpenImageIOModule ewa_openimageio_module;
const ewa::image::OpenImageIOModule ewa_openimageio_module = {"0.0.0", instance};
