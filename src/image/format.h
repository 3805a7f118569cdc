// SPDX-License-Identifier: Apache-2.0
// Which picture formats are read, and what their files say of themselves. Pictures come from strangers: what
// OpenImageIO would also open (films, archives of volumes, its own test patterns, formats whose readers take
// memory before they know the size, or fill in what is missing) is not given to it.
#pragma once
#include "core/file_reader.h"
#include "image/limits.h"

namespace ewa::image {

enum class Format { png, jpeg, tiff, exr, webp, bmp, pnm, hdr };

/// By its first bytes, whatever its name. Throws InputError for every other format.
Format format_of(core::FileReader& reader);

/// Reads the file's structure from its first byte, and decodes nothing. Throws InputError where the size is
/// beyond a limit (limits.h), a part is missing that the pixels need, or the file uses what is not read. The
/// codecs alone would print on standard error (libpng), fill what is missing with grey (libjpeg) or with
/// whatever is there (TIFF), or take memory for tables.
/// whole: the pixels will be read too; what takes reading the whole file is then looked at.
Claim look_at(core::FileReader& reader, Format format, bool whole);

// One a format; the reader stands at the file's first byte.
Claim look_at_png(core::FileReader& reader, bool whole);   // whole: checksums
Claim look_at_jpeg(core::FileReader& reader, bool whole);  // whole: up to the end-of-image marker
Claim look_at_tiff(core::FileReader& reader);
Claim look_at_exr(core::FileReader& reader);
Claim look_at_webp(core::FileReader& reader);
Claim look_at_bmp(core::FileReader& reader);
Claim look_at_pnm(core::FileReader& reader);
Claim look_at_hdr(core::FileReader& reader);

}  // namespace ewa::image
