// SPDX-License-Identifier: Apache-2.0
// The table of the splat formats: names, functions that read and write them, and the contents of a scene that a file can store.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "ewa/splat_scene.h"
#include "io/splats/value_files.h"

namespace ewa::io {

struct FormatRow {
    SplatFormat format;
    std::string_view name;       // in messages
    std::string_view extension;  // a whole name where it has no dot in front
    std::string_view other_extension = {};
    std::string_view meaning = {};  // what errors add to the extension
    std::string_view readers = {};  // programs that open it

    // For people who choose a format to write.
    std::string_view purpose = {};   // what it is good for
    std::string_view rounding = {};  // how it rounds values, one or more sentences; empty: it does not
    /// The usual bytes of a splat without SH, and of the three values of an SH coefficient. docs/sharing.md has measured files.
    std::array<float, 2> splat_bytes = {};

    // How a file is recognised.
    std::array<std::string_view, 2> beginnings = {};  // first bytes
    /// Whether a file with these first bytes is of this format. Null: it is, unless another row's `confirm` returns true.
    bool (*confirm)(const std::filesystem::path& path) = nullptr;
    /// The file's name has precedence over its first bytes if its size is a multiple of this, bytes. 0: never.
    uint64_t named_multiple = 0;

    // Contents of a scene that a file keeps besides the usual values.
    bool comments = false;
    bool mark = false;        // that the scene was trained anti-aliased
    bool world = false;       // positions far from the origin, which float32 would round
    bool density = false;     // opacities of Footprint::density, not fitted to 3DGS's kernel
    bool undrawable = false;  // splats that are not drawable, and values that are not finite
    bool place = false;       // on the globe
    bool morton = false;      // it has the splats in morton_order, else as they come
    bool no_sh = false;       // colours do not depend on the view

    // Options of a user that apply.
    bool levels = false, spz_version = false, holds_spz = false;
    std::string_view unchecked = {};  // why --check is refused, and what to check instead; empty: it is not
    std::string_view unread = {};     // the error of reading; empty where ewa reads it

    /// Null where ewa only writes the format.
    SplatScene (*read)(const std::filesystem::path& path) = nullptr;
    /// Null where ewa only reads the format, and where `consume` is in its place.
    std::vector<std::string> (*write)(const std::filesystem::path& path, const Gaussians& gaussians,
                                      const SaveOptions& options) = nullptr;
    /// The same for formats that change the scene while they write it.
    std::vector<std::string> (*consume)(const std::filesystem::path& path, Gaussians gaussians,
                                        const SaveOptions& options) = nullptr;

    // Files beside the one that names them.
    /// The existing files that hold the values of an existing naming file.
    Paths (*values)(const std::filesystem::path& naming) = nullptr;
    /// The value files that writing would write and remove.
    ValueFiles (*beside)(const std::filesystem::path& naming) = nullptr;
    /// Whether writing makes folders of such a name.
    bool (*names_part)(std::string_view folder) = nullptr;

    bool writable() const { return write != nullptr || consume != nullptr; }
};

/// All rows, in the order of help texts and errors.
std::span<const FormatRow> format_rows();

const FormatRow& row_of(SplatFormat format);

/// The row whose extension or name the file has, in upper or lower case. Null if there is none.
const FormatRow* row_of_name(const std::filesystem::path& path);

/// The row of a file to write, by its name. Throws InputError that lists the formats that ewa writes.
const FormatRow& row_to_write(const std::filesystem::path& path);

/// The row of a file by its first bytes. Null if no row fits. head: the first four bytes, or the whole of a shorter file.
const FormatRow* row_of_head(const std::filesystem::path& path, std::string_view head);

enum class Uses { read, written, both, only_read, only_written };

/// The extensions of the formats with these uses, for help texts: ".ply .spz".
std::string extension_list(Uses uses);

/// The extensions of the formats with these uses, for errors, with their meanings: ".ply, meta.json of a SOG".
std::string extension_text(Uses uses);

}  // namespace ewa::io
