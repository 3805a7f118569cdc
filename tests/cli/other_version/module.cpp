// SPDX-License-Identifier: Apache-2.0
// The module of another version of ewa. Nobody may call its functions.
#include "image/openimageio.h"

extern "C" const ewa::image::OpenImageIO ewa_openimageio_module;
const ewa::image::OpenImageIO ewa_openimageio_module = {"0.0.0", nullptr, nullptr, nullptr};
