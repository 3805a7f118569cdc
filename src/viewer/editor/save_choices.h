// SPDX-License-Identifier: Apache-2.0
// The choices of Save as: what a format does not keep, how large its file becomes, and which files may be written.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "ewa/gaussians.h"
#include "io/splats/format_table.h"

namespace ewa::viewer {

/// What a file of the format does not keep of these splats, one line each. Empty: it keeps everything.
std::vector<std::string> losses(const io::FormatRow& row, const Gaussians& splats);

/// The usual size of a file with so many splats, bytes.
uint64_t usual_bytes(const io::FormatRow& row, size_t splats, int sh_degree);

/// "Wrote room.html, 1.36 MB, 73,777 splats", with the files of its values. A format with a whole name goes by its folder.
std::string wrote_text(const std::filesystem::path& out, size_t splats);

/// The path without the extension of its format. The folder is left where the format has a whole name, such as meta.json.
std::filesystem::path stem_of(const std::filesystem::path& path);

/// The path with the extension of the format. A format with a whole name, such as meta.json, has a folder in place of the file.
std::filesystem::path with_format(const std::filesystem::path& path, const io::FormatRow& row);

/// The first proposal for a copy of the scene: beside its file, under another name. file: empty for a scene without one, whose
/// name then counts. part: EditedScene::part.
std::filesystem::path proposed_file(const std::filesystem::path& file, const std::string& name,
                                    const io::FormatRow& row, size_t part = 1);

/// Why the file cannot be written; empty: it can. originals: the files that were opened, which are never replaced.
std::string refusal(const std::filesystem::path& out, const std::vector<std::filesystem::path>& originals);

}  // namespace ewa::viewer
