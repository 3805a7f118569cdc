// SPDX-License-Identifier: Apache-2.0
// Reads and writes splats of any format: the table (format_table.h) tells how.
#include "ewa/splat_files.h"

#include <algorithm>

#include "core/file_reader.h"
#include "core/messages.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "io/splats/format_table.h"
#include "io/splats/formats.h"
#include "io/splats/prepare.h"
#include "io/splats/sog.h"
#include "io/splats/zipped_splats.h"

namespace ewa {

namespace {

[[noreturn]] void refuse(const std::filesystem::path& path) {
    constexpr std::string_view kClouds[] = {".las", ".laz", ".e57", ".pcd", ".pts", ".ptx", ".xyz"};
    if (std::ranges::count(kClouds, core::lower(path.extension().string())) > 0)
        throw InputError(
            core::one_line(path.string()) +
            ": ewa reads point clouds as .ply alone; CloudCompare makes one of this, or of a .las "
            "or .laz `pdal translate IN.las OUT.ply`");
    throw InputError(core::one_line(path.string() + ": not a supported kind of splat file; supported: " +
                                    io::extension_text(io::Uses::read)));
}

/// Whether the file is a zip archive of splats in another format, or in a folder.
bool is_zipped(const std::filesystem::path& path) {
    const io::FormatRow* row = io::row_of_name(path);
    if ((row && row->named_multiple > 0) || !io::is_zip(path)) return false;
    const io::ZipFiles zip(path);
    return std::ranges::none_of(zip.entries(), [](const auto& entry) { return entry.name == io::kSogMeta; });
}

void require_levels(const std::filesystem::path& path) {
    if (format_of_file(path) != SplatFormat::sog_levels)
        throw InputError(core::one_line(path.string()) + ": has no levels; a lod-meta.json has");
}

void warn_of(const std::filesystem::path& path, const std::vector<std::string>& remarks) {
    for (const std::string& remark : remarks)
        core::warn(core::one_line(path.string()) + ": " + core::one_line(remark));
}

/// Throws InputError for comments that a reader of the file would refuse.
void check_comments(const std::filesystem::path& path, const std::vector<std::string>& comments) {
    constexpr size_t kMostLine = 65000, kMostHeader = 4000000;  // bytes; less than ply_table.cpp's limits
    size_t longest = 0, all = 0;
    for (const std::string& comment : comments) {
        const size_t bytes = core::one_line(comment).size();
        longest = std::max(longest, bytes);
        all += bytes;
    }
    if (longest > kMostLine || all > kMostHeader)
        throw InputError(core::one_line(path.string() + ": comments of " + std::to_string(all) +
                                        " bytes, the longest of " + std::to_string(longest) + "; at most " +
                                        std::to_string(kMostHeader) + " and " + std::to_string(kMostLine) +
                                        " fit in the file"));
}

void add_remarks(std::vector<std::string>& remarks, const std::vector<std::string>& more) {
    remarks.insert(remarks.end(), more.begin(), more.end());
}

/// `gaussians` is not needed afterwards.
std::vector<std::string> save_as(const std::filesystem::path& path, const io::FormatRow& row,
                                 Gaussians&& gaussians, const SaveOptions& options) {
    check(gaussians);
    if (row.comments) check_comments(path, options.comments);
    std::vector<std::string> remarks = io::prepare(gaussians, row);
    add_remarks(remarks, row.write ? row.write(path, gaussians, options)
                                   : row.consume(path, std::move(gaussians), options));
    add_remarks(remarks, io::dropped_remarks(options, row));
    return remarks;
}

}  // namespace

std::string_view name_of(SplatFormat format) {
    return io::row_of(format).name;
}

std::string_view readers_of(SplatFormat format) {
    return io::row_of(format).readers;
}

SplatFormat format_of_name(const std::filesystem::path& path) {
    const io::FormatRow* row = io::row_of_name(path);
    if (!row) refuse(path);
    return row->format;
}

SplatFormat format_to_write(const std::filesystem::path& path) {
    return io::row_to_write(path).format;
}

SplatFormat format_of_file(const std::filesystem::path& path) {
    if (is_zipped(path)) return format_of_name(io::zipped_splats(path, io::ZipFiles(path)).name);
    const io::FormatRow* row = io::row_of_name(path);
    std::error_code error;
    if (!row && !std::filesystem::is_regular_file(path, error)) refuse(path);
    core::FileReader reader(path);
    if (row && row->named_multiple > 0 && reader.size() % row->named_multiple == 0) return row->format;
    constexpr uint64_t kHeadBytes = 4;
    const size_t size = size_t(std::min(reader.size(), kHeadBytes));
    const std::string head(reinterpret_cast<const char*>(reader.take(size, "the header")), size);
    if (const io::FormatRow* found = io::row_of_head(path, head)) row = found;
    if (!row) refuse(path);
    return row->format;
}

SplatScene read_splats(const std::filesystem::path& path) {
    if (is_zipped(path)) return io::read_zipped(path, read_splats);
    const io::FormatRow& row = io::row_of(format_of_file(path));
    if (!row.read) throw InputError(core::one_line(path.string()) + ": " + std::string(row.unread));
    return row.read(path);
}

SplatScene read_splat_level(const std::filesystem::path& path, size_t level) {
    require_levels(path);
    return io::read_level(path, level);
}

std::vector<size_t> level_counts(const std::filesystem::path& path) {
    require_levels(path);
    return io::count_levels(path);
}

Gaussians load_splats(const std::filesystem::path& path) {
    SplatScene scene = read_splats(path);
    warn_of(path, scene.remarks);
    return std::move(scene.gaussians);
}

std::vector<std::string> save_splats(const std::filesystem::path& path, const Gaussians& gaussians,
                                     const SaveOptions& options) {
    check(gaussians);
    const io::FormatRow& row = io::row_to_write(path);
    if (!row.write || !io::is_prepared(gaussians, row))
        return save_as(path, row, Gaussians(gaussians), options);
    if (row.comments) check_comments(path, options.comments);
    std::vector<std::string> remarks = row.write(path, gaussians, options);
    add_remarks(remarks, io::dropped_remarks(options, row));
    return remarks;
}

std::vector<std::string> save_splats(const std::filesystem::path& path, Gaussians&& gaussians,
                                     const SaveOptions& options) {
    return save_as(path, io::row_to_write(path), std::move(gaussians), options);
}

std::vector<std::string> save_levels(const std::filesystem::path& path, Gaussians gaussians,
                                     const SaveOptions& options) {
    return save_as(path, io::row_of(SplatFormat::sog_levels), std::move(gaussians), options);
}

std::string sog_bytes(const std::filesystem::path& path, const Gaussians& gaussians,
                      const SaveOptions& options, std::vector<std::string>& remarks) {
    check(gaussians);
    Gaussians plain = gaussians;
    add_remarks(remarks, io::prepare(plain, io::row_of(SplatFormat::sog)));
    std::vector<std::string> more;
    std::string bytes = io::pack_sog(path, plain, options, more);
    add_remarks(remarks, more);
    return bytes;
}

void save_splats(const std::filesystem::path& path, const Gaussians& gaussians,
                 const std::vector<std::string>& comments) {
    warn_of(path, save_splats(path, gaussians, SaveOptions{.comments = comments}));
}

}  // namespace ewa
