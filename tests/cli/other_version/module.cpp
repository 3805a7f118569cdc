// SPDX-License-Identifier: Apache-2.0
// The module of another version of ewa. Nobody may call its functions.
#include "image/image_files.h"

extern "C" const ewa::image::OpenImageIO ewa_openimageio_layout_2;
const ewa::image::OpenImageIO ewa_openimageio_layout_2 = {"0.0.0", nullptr, nullptr,
                                                          nullptr, nullptr, nullptr};
