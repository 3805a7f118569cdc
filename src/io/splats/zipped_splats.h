// SPDX-License-Identifier: Apache-2.0
// Reads splats in a zip archive, as web sites offer them: one splat file, or the folder of a SOG, among other files.
#pragma once
#include <filesystem>

#include "ewa/splat_scene.h"
#include "io/splats/zip_files.h"

namespace ewa::io {

/// Whether an archive has splats that read_splats reads: one or several files, or the parts of a SOG.
bool has_splats(const ZipFiles& zip);

/// The entry of the splats. Throws InputError with a remedy if there is none or more than one.
ZipFiles::Entry zipped_splats(const std::filesystem::path& path, const ZipFiles& zip);

/// Unpacks the splats into a temporary folder, where `read` reads them. Throws as zipped_splats and `read` do, and RunError (disk).
SplatScene read_zipped(const std::filesystem::path& path, SplatScene (*read)(const std::filesystem::path&));

}  // namespace ewa::io
