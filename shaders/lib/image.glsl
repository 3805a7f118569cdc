// SPDX-License-Identifier: Apache-2.0
// Pixels of image planes (shared/layouts.h).
#ifndef EWA_LIB_IMAGE
#define EWA_LIB_IMAGE
// Offset of pixel i within a plane. i counts the pixels of all rows, from the top.
uint pixel_offset(ImageLayout image, uint i) { return (i / image.size[0]) * image.stride + i % image.size[0]; }
#endif
