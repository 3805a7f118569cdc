// SPDX-License-Identifier: Apache-2.0
// The registry of the splat formats: it selects a format by the first bytes or the extension of a file.
#include "ewa/splat_files.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "core/messages.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "io/splats/formats.h"
#include "io/splats/ply_table.h"
#include "io/splats/sog.h"
#include "io/splats/splat_values.h"
#include "io/splats/zipped_splats.h"
#include "scene/splat_arrays.h"

namespace ewa {

namespace {

std::vector<std::string> write_levels_of_copy(const std::filesystem::path& path, const Gaussians& gaussians,
                                              const SaveOptions& options) {
    return io::write_levels(path, gaussians, options);
}

struct Kind {
    SplatFormat format;
    std::string_view extension, name;
    std::array<std::string_view, 2> beginnings;  // of a file; none where the first bytes do not tell
    /// Null where ewa only writes the format.
    SplatScene (*read)(const std::filesystem::path&);
    /// Null where ewa only reads the format.
    std::vector<std::string> (*write)(const std::filesystem::path&, const Gaussians&, const SaveOptions&);
    std::string_view readers;  // programs that open it
};
constexpr std::string_view kOfSog = "SuperSplat, PlayCanvas, Spark, Babylon.js",
                           kOfGltf =
                               "PlayCanvas, Babylon.js, CesiumJS; others that know KHR_gaussian_splatting",
                           kOfUsd = "Omniverse, Isaac Sim, Houdini; others that know OpenUSD 26.03";
/// An extension that is the end of another one comes after it. One without a dot is a whole name.
constexpr Kind kKinds[] = {
    {SplatFormat::compressed_ply,
     ".compressed.ply",
     "compressed PLY",
     {},
     io::read_compressed_ply,
     io::write_compressed_ply,
     "SuperSplat, PlayCanvas, Spark, Babylon.js"},
    {SplatFormat::ply,
     ".ply",
     "PLY",
     {"ply\n", "ply\r"},
     io::read_ply,
     io::write_ply,
     "SuperSplat, PlayCanvas, Spark, Babylon.js, SIBR's viewers; trainers and editors"},
    {SplatFormat::splat,
     ".splat",
     "splat",
     {},
     io::read_splat,
     io::write_splat,
     "antimatter15/splat, SuperSplat, Spark, Babylon.js"},
    {SplatFormat::spz,
     ".spz",
     "SPZ",
     {"NGSP", "\x1f\x8b"},
     io::read_spz,
     io::write_spz,
     "SuperSplat, Spark, Babylon.js, Scaniverse"},
    {SplatFormat::glb, ".glb", "GLB", {"glTF"}, io::read_gltf_splats, io::write_gltf_splats, kOfGltf},
    {SplatFormat::gltf, ".gltf", "glTF", {"{"}, io::read_gltf_splats, io::write_gltf_splats, kOfGltf},
    {SplatFormat::sog, ".sog", "SOG", {"PK\x03\x04"}, io::read_sog, io::write_sog, kOfSog},
    {SplatFormat::sog_meta, "meta.json", "SOG", {}, io::read_sog_meta, io::write_sog_meta, kOfSog},
    {SplatFormat::sog_levels,
     "lod-meta.json",
     "streamed SOG",
     {},
     io::read_levels,
     write_levels_of_copy,
     "PlayCanvas, SuperSplat's viewer"},
    {SplatFormat::usda, ".usda", "USD", {"#usd", "PXR-"}, nullptr, io::write_usda, kOfUsd},
    {SplatFormat::usdz, ".usdz", "USDZ", {}, nullptr, io::write_usdz, kOfUsd},
    {SplatFormat::ksplat,
     ".ksplat",
     "ksplat",
     {std::string_view("\0\1\0\0", 4)},
     io::read_ksplat,
     nullptr,
     "GaussianSplats3D, Spark"}};

const Kind& kind_of(SplatFormat format) {
    return *std::ranges::find(kKinds, format, &Kind::format);
}

const Kind* kind_of_name(const std::filesystem::path& path) {
    const std::string name = core::lower(path.filename().string());
    for (const Kind& kind : kKinds)
        if (kind.extension.starts_with('.') ? name.ends_with(kind.extension) : name == kind.extension)
            return &kind;
    return nullptr;
}

constexpr const char* kBothWays =
    ".ply, .compressed.ply, .splat, .spz, .sog, meta.json of a SOG, lod-meta.json, .glb, .gltf";

std::string read_kinds() {
    return std::string(kBothWays) + ", .ksplat";
}

std::string written_kinds() {
    return std::string(kBothWays) + ", .usda, .usdz";
}

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& kinds) {
    constexpr std::string_view kClouds[] = {".las", ".laz", ".e57", ".pcd", ".pts", ".ptx", ".xyz"};
    if (std::ranges::count(kClouds, core::lower(path.extension().string())) > 0)
        throw InputError(
            core::one_line(path.string()) +
            ": ewa reads point clouds as .ply alone; CloudCompare makes one of this, or of a .las "
            "or .laz `pdal translate IN.las OUT.ply`");
    throw InputError(
        core::one_line(path.string() + ": not a supported kind of splat file; supported: " + kinds));
}

/// Says what to write instead.
[[noreturn]] void refuse_to_write(const std::filesystem::path& path, bool read_only) {
    if (!read_only) refuse(path, written_kinds());
    throw InputError(core::one_line(
        path.string() + ": ewa reads this format and does not write it; it writes " + written_kinds()));
}

/// Whether the file is a zip archive of splats in another format, or in a folder.
bool is_zipped(const std::filesystem::path& path) {
    const Kind* kind = kind_of_name(path);
    // A .splat has no header, and a .usdz is a zip archive of another kind.
    if (kind && (kind->format == SplatFormat::splat || kind->format == SplatFormat::usdz)) return false;
    if (!io::is_zip(path)) return false;
    const io::ZipFiles zip(path);
    return std::ranges::none_of(zip.entries(), [](const auto& entry) { return entry.name == io::kSogMeta; });
}

/// The kind that the first bytes identify, or null.
const Kind* kind_of_head(std::string_view head) {
    for (const Kind& kind : kKinds)
        for (const std::string_view beginning : kind.beginnings)
            if (!beginning.empty() && head.starts_with(beginning)) return &kind;
    return nullptr;
}

void require_levels(const std::filesystem::path& path) {
    if (format_of_file(path) != SplatFormat::sog_levels)
        throw InputError(core::one_line(path.string()) + ": has no levels; a lod-meta.json has");
}

void warn_of(const std::filesystem::path& path, const std::vector<std::string>& remarks) {
    for (const std::string& remark : remarks)
        core::warn(core::one_line(path.string()) + ": " + core::one_line(remark));
}

/// Makes the scene one that every format can hold: without the splats that are never visible, and with finite values. PLY
/// alone stores all values.
void make_storable(Gaussians& gaussians, std::vector<std::string>& remarks) {
    std::vector<uint32_t> kept;
    for (size_t i = 0; i < gaussians.size(); ++i)
        if (drawable(gaussians, i)) kept.push_back(uint32_t(i));
    if (const uint64_t skipped = gaussians.size() - kept.size(); skipped > 0) {
        remarks.push_back(core::counted(skipped, "splat") + (skipped == 1 ? " has" : " have") +
                          " a value that is not finite or a zero quaternion and " +
                          std::string(core::is_or_are(skipped)) +
                          " skipped: " + scene::undrawable_text(gaussians));
        select_splats(gaussians, kept);
    }
    if (!scene::is_computable(gaussians)) gaussians = scene::computable(std::move(gaussians));
}

/// Whether make_storable would change the scene.
bool is_storable(const Gaussians& gaussians) {
    for (size_t i = 0; i < gaussians.size(); ++i)
        if (!drawable(gaussians, i)) return false;
    return scene::is_computable(gaussians);
}

/// The scene with world positions as its means, rounded to float32.
Gaussians in_float_positions(Gaussians gaussians) {
    for (size_t i = 0; i < gaussians.size(); ++i) {
        const glm::dvec3 mean = gaussians.world_mean(i);
        for (int axis = 0; axis < 3; ++axis) gaussians.means[3 * i + size_t(axis)] = float(mean[axis]);
    }
    gaussians.origin = glm::dvec3(0);
    return gaussians;
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

std::string rounding_remark(const glm::dvec3& origin) {
    const double farthest = std::max({std::abs(origin.x), std::abs(origin.y), std::abs(origin.z)});
    const float step = std::nextafter(float(farthest), INFINITY) - float(farthest);
    char text[160];
    std::snprintf(text, sizeof(text),
                  "positions are rounded to %.3g units, float32's step so far from the origin; save a .ply, "
                  "or move the "
                  "scene near the origin with --transform move=",
                  double(step));
    return text;
}

}  // namespace

std::string_view name_of(SplatFormat format) {
    return kind_of(format).name;
}

std::string_view readers_of(SplatFormat format) {
    return kind_of(format).readers;
}

SplatFormat format_of_name(const std::filesystem::path& path) {
    const Kind* kind = kind_of_name(path);
    if (!kind) refuse(path, read_kinds());
    return kind->format;
}

SplatFormat format_to_write(const std::filesystem::path& path) {
    const Kind* kind = kind_of_name(path);
    if (!kind || !kind->write) refuse_to_write(path, kind != nullptr);
    return kind->format;
}

SplatFormat format_of_file(const std::filesystem::path& path) {
    if (is_zipped(path)) return format_of_name(io::zipped_splats(path, io::ZipFiles(path)).name);
    const Kind* kind = kind_of_name(path);
    std::error_code error;
    if (!kind && !std::filesystem::is_regular_file(path, error)) refuse(path, read_kinds());
    core::FileReader reader(path);
    // Both .usdz and .sog are zip archives.
    if (kind && kind->format == SplatFormat::usdz) return SplatFormat::usdz;
    // A .splat begins with a coordinate, so its first bytes may look like any format.
    if (kind && kind->format == SplatFormat::splat && reader.size() % 32 == 0) return SplatFormat::splat;
    constexpr uint64_t kHeadBytes = 4;
    const size_t size = size_t(std::min(reader.size(), kHeadBytes));
    const std::string head(reinterpret_cast<const char*>(reader.take(size, "the header")), size);
    // glTF, the meta.json of a SOG and a lod-meta.json are all JSON.
    if (kind && kind->format == SplatFormat::sog_levels) return SplatFormat::sog_levels;
    const bool sog_meta =
        head.starts_with('{') && ((kind && kind->format == SplatFormat::sog_meta) || io::is_sog_meta(path));
    if (sog_meta)
        kind = &kind_of(SplatFormat::sog_meta);
    else if (const Kind* found = kind_of_head(head))
        kind = found;
    if (!kind) refuse(path, read_kinds());
    if (kind->format != SplatFormat::ply) return kind->format;
    return io::is_compressed_ply(io::PlyTable(path)) ? SplatFormat::compressed_ply : SplatFormat::ply;
}

SplatScene read_splats(const std::filesystem::path& path) {
    if (is_zipped(path)) return io::read_zipped(path, read_splats);
    const SplatFormat format = format_of_file(path);
    const auto read = kind_of(format).read;
    if (!read) throw InputError(core::one_line(path.string()) + ": ewa writes USD and does not read it");
    return read(path);
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
    const SplatFormat format = format_to_write(path);
    if (format == SplatFormat::sog_levels) return save_levels(path, gaussians, options);
    std::vector<std::string> remarks, more;
    const bool ply = format == SplatFormat::ply;
    if (ply || format == SplatFormat::compressed_ply) check_comments(path, options.comments);
    if (!ply && gaussians.origin != glm::dvec3(0)) {
        remarks = save_splats(path, in_float_positions(gaussians), options);
        remarks.push_back(rounding_remark(gaussians.origin));
        return remarks;
    }
    if (!ply && gaussians.density) {
        Gaussians fitted = gaussians;
        fit_opacities(fitted, false);
        remarks = save_splats(path, fitted, options);
        remarks.push_back(
            "opacities of --kernel density are fitted to 3DGS's kernel; a .ply keeps the kernel");
        return remarks;
    }
    const auto write = kind_of(format).write;
    if (ply || is_storable(gaussians)) {
        more = write(path, gaussians, options);
    } else {
        Gaussians storable = gaussians;
        make_storable(storable, remarks);
        more = write(path, storable, options);
    }
    remarks.insert(remarks.end(), more.begin(), more.end());
    const bool comments = ply || format == SplatFormat::compressed_ply;
    const bool unmarked = !comments && format != SplatFormat::spz && format != SplatFormat::sog &&
                          format != SplatFormat::sog_meta && !options.gltf_spz;
    if (options.antialiased && unmarked)
        remarks.push_back("the mark that the scene was trained anti-aliased is dropped");
    if (!options.comments.empty() && !comments) remarks.push_back("comments are dropped");
    return remarks;
}

std::vector<std::string> save_levels(const std::filesystem::path& path, Gaussians gaussians,
                                     const SaveOptions& options) {
    check(gaussians);
    std::vector<std::string> remarks;
    if (gaussians.origin != glm::dvec3(0)) {
        remarks.push_back(rounding_remark(gaussians.origin));
        gaussians = in_float_positions(std::move(gaussians));
    }
    if (gaussians.density) {
        fit_opacities(gaussians, false);
        remarks.emplace_back("opacities of --kernel density are fitted to 3DGS's kernel");
    }
    make_storable(gaussians, remarks);
    const std::vector<std::string> more = io::write_levels(path, std::move(gaussians), options);
    remarks.insert(remarks.end(), more.begin(), more.end());
    if (!options.comments.empty()) remarks.emplace_back("comments are dropped");
    return remarks;
}

std::string sog_bytes(const std::filesystem::path& path, const Gaussians& gaussians,
                      const SaveOptions& options, std::vector<std::string>& remarks) {
    check(gaussians);
    Gaussians plain = gaussians;
    if (plain.origin != glm::dvec3(0)) {
        remarks.push_back(rounding_remark(plain.origin));
        plain = in_float_positions(std::move(plain));
    }
    if (plain.density) {
        fit_opacities(plain, false);
        remarks.push_back("opacities of --kernel density are fitted to 3DGS's kernel");
    }
    make_storable(plain, remarks);
    std::vector<std::string> more;
    std::string bytes = io::pack_sog(path, plain, options, more);
    remarks.insert(remarks.end(), more.begin(), more.end());
    return bytes;
}

void save_splats(const std::filesystem::path& path, const Gaussians& gaussians,
                 const std::vector<std::string>& comments) {
    warn_of(path, save_splats(path, gaussians, SaveOptions{.comments = comments}));
}

}  // namespace ewa
