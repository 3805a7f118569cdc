// SPDX-License-Identifier: Apache-2.0
#include "io/splats/format_table.h"

#include <algorithm>

#include "core/text.h"
#include "ewa/error.h"
#include "io/splats/formats.h"
#include "io/splats/levels.h"
#include "io/splats/ply_table.h"
#include "io/splats/sog.h"
#include "io/splats/tileset.h"

namespace ewa::io {

namespace {

constexpr std::string_view kSogRounding =
                               "Positions have 65,536 steps. Sizes, colours, opacities and rotations have "
                               "256. View-dependent colours come from a palette.",
                           kSpzRounding =
                               "Positions have steps of 1/4096 unit, or coarser ones in a scene over 2,000 "
                               "units. Sizes, colours and opacities have 256 "
                               "steps, rotations 1,024, and view-dependent colours 32 or 16.";

constexpr std::string_view kOfSog = "SuperSplat, PlayCanvas, Spark, Babylon.js",
                           kOfGltf =
                               "PlayCanvas, Babylon.js, CesiumJS; others that know KHR_gaussian_splatting",
                           kOfUsd = "Omniverse, Isaac Sim, Houdini; others that know OpenUSD 26.03",
                           kUsdUnread = "ewa writes USD and does not read it",
                           kUsdUnchecked =
                               "ewa writes USD and does not read it; check a .ply, which has the same values";

constexpr FormatRow kRows[] = {
    {.format = SplatFormat::ply,
     .name = "PLY",
     .extension = ".ply",
     .readers = "SuperSplat, PlayCanvas, Spark, Babylon.js, SIBR's viewers; trainers and editors",
     .purpose = "keeps everything; to edit and to train further",
     .splat_bytes = {68, 12},
     .beginnings = {"ply\n", "ply\r"},
     .comments = true,
     .mark = true,
     .world = true,
     .density = true,
     .undrawable = true,
     .read = read_ply,
     .write = write_ply},
    {.format = SplatFormat::compressed_ply,
     .name = "compressed PLY",
     .extension = ".compressed.ply",
     .readers = "SuperSplat, PlayCanvas, Spark, Babylon.js",
     .purpose = "a quarter of a PLY; viewers on the web",
     .rounding = "Positions and sizes have 2,048 or 1,024 steps in the box of 256 neighbours. Colours, "
                 "opacities and view-dependent colours have 256.",
     .splat_bytes = {16.3f, 3},
     .beginnings = {"ply\n", "ply\r"},
     .confirm = [](const std::filesystem::path& path) { return is_compressed_ply(PlyTable(path)); },
     .comments = true,
     .mark = true,
     .morton = true,
     .read = read_compressed_ply,
     .write = write_compressed_ply},
    // It begins with a coordinate, so its first bytes may look like any format.
    {.format = SplatFormat::splat,
     .name = "splat",
     .extension = ".splat",
     .readers = "antimatter15/splat, SuperSplat, Spark, Babylon.js",
     .purpose = "simple web viewers; no view-dependent colours",
     .rounding = "Colours, opacities and rotations have 256 steps.",
     .splat_bytes = {32, 0},
     .named_multiple = 32,
     .no_sh = true,
     .read = read_splat,
     .write = write_splat},
    {.format = SplatFormat::ksplat,
     .name = "ksplat",
     .extension = ".ksplat",
     .readers = "GaussianSplats3D, Spark",
     .beginnings = {std::string_view("\0\1\0\0", 4)},
     .read = read_ksplat},
    {.format = SplatFormat::spz,
     .name = "SPZ",
     .extension = ".spz",
     .readers = "SuperSplat, Spark, Babylon.js, Scaniverse",
     .purpose = "small; phones and games",
     .rounding = kSpzRounding,
     .splat_bytes = {16, 0.5f},
     .beginnings = {"NGSP", "\x1f\x8b"},
     .mark = true,
     .spz_version = true,
     .read = read_spz,
     .write = write_spz},
    {.format = SplatFormat::sog,
     .name = "SOG",
     .extension = ".sog",
     .readers = kOfSog,
     .purpose = "small; viewers on the web",
     .rounding = kSogRounding,
     .splat_bytes = {20, 0.9f},
     .beginnings = {"PK\x03\x04"},
     .mark = true,
     .morton = true,
     .read = read_sog,
     .write = write_sog},
    {.format = SplatFormat::sog_meta,
     .name = "SOG",
     .extension = kSogMeta,
     .meaning = " of a SOG",
     .readers = kOfSog,
     .purpose = "a SOG as a folder of images",
     .rounding = kSogRounding,
     .splat_bytes = {20, 0.9f},
     .beginnings = {"{"},
     .confirm =
         [](const std::filesystem::path& path) {
             return core::lower(path.filename().string()) == kSogMeta || is_sog_meta(path);
         },
     .mark = true,
     .morton = true,
     .read = read_sog_meta,
     .write = write_sog_meta,
     .values = sog_images,
     .beside = sog_value_files},
    {.format = SplatFormat::sog_levels,
     .name = "streamed SOG",
     .extension = kLevelsName,
     .readers = "PlayCanvas, SuperSplat's viewer",
     .purpose = "large scenes that are streamed",
     .rounding = kSogRounding,
     .splat_bytes = {40, 1.8f},
     .named_multiple = 1,
     .mark = true,
     .levels = true,
     .unchecked = "its splats are in another order; check a .sog, which level 0 holds in chunks",
     .read = read_levels,
     .consume = write_levels,
     .values = level_files,
     .names_part = names_chunk_folder},
    {.format = SplatFormat::glb,
     .name = "GLB",
     .extension = ".glb",
     .readers = kOfGltf,
     .purpose = "glTF programs, one file",
     .splat_bytes = {64, 12},
     .beginnings = {"glTF"},
     .holds_spz = true,
     .read = read_gltf_splats,
     .write = write_gltf_splats},
    {.format = SplatFormat::gltf,
     .name = "glTF",
     .extension = ".gltf",
     .readers = kOfGltf,
     .purpose = "glTF programs, text and values",
     .splat_bytes = {64, 12},
     .beginnings = {"{"},
     .holds_spz = true,
     .read = read_gltf_splats,
     .write = write_gltf_splats,
     .values = gltf_values,
     .beside = gltf_value_files},
    {.format = SplatFormat::usda,
     .name = "USD",
     .extension = ".usda",
     .readers = kOfUsd,
     .purpose = "simulation and film, as text",
     .splat_bytes = {220, 33},
     .beginnings = {"#usd", "PXR-"},
     .unchecked = kUsdUnchecked,
     .unread = kUsdUnread,
     .write = write_usda},
    // A zip archive of another kind than a .sog.
    {.format = SplatFormat::usdz,
     .name = "USDZ",
     .extension = ".usdz",
     .readers = kOfUsd,
     .purpose = "simulation and film, one file",
     .splat_bytes = {220, 33},
     .named_multiple = 1,
     .unchecked = kUsdUnchecked,
     .unread = kUsdUnread,
     .write = write_usdz},
    {.format = SplatFormat::tileset,
     .name = "3D Tiles",
     .extension = kTilesetName,
     .readers = "CesiumJS",
     .purpose = "scenes on a globe",
     .rounding = kSpzRounding,
     .splat_bytes = {32, 0.6f},
     .named_multiple = 1,
     .mark = true,
     .world = true,
     .place = true,
     .levels = true,
     .unchecked = "ewa reads no tileset; check a .glb with --gltf-spz, which its tiles are",
     .unread = "ewa writes 3D Tiles and does not read them",
     .consume = write_tileset,
     .values = tile_files,
     .names_part = names_tile_folder},
    // It shows the scene as it is before it is rounded for the SOG that it holds.
    {.format = SplatFormat::page,
     .name = "page",
     .extension = ".html",
     .other_extension = ".htm",
     .meaning = " (a page)",
     .readers = "any browser",
     .purpose = "one page that shows the scene",
     .rounding = kSogRounding,
     .splat_bytes = {27, 1.2f},
     .named_multiple = 1,
     .mark = true,
     .world = true,
     .density = true,
     .morton = true,
     .unchecked = "ewa does not read a page; check a .sog, which it holds",
     .unread = "ewa writes pages and does not read them",
     .consume = write_page}};

bool ends_with(const std::string& name, std::string_view extension) {
    return extension.starts_with('.') ? name.ends_with(extension) : !extension.empty() && name == extension;
}

bool has_uses(const FormatRow& row, Uses uses) {
    const bool read = row.read != nullptr, written = row.writable();
    switch (uses) {
        case Uses::read:
            return read;
        case Uses::written:
            return written;
        case Uses::both:
            return read && written;
        case Uses::only_read:
            return read && !written;
        case Uses::only_written:
            return written && !read;
    }
    return false;
}

/// What to write in place of a mesh of this name; empty for other names.
std::string mesh_advice(const std::filesystem::path& path) {
    const std::string extension = core::lower(path.extension().string());
    for (const char* mesh : {".obj", ".stl", ".fbx", ".dae"})
        if (extension == mesh)
            return "; ewa mesh makes meshes: ewa mesh IN -o " + path.stem().string() +
                   (extension == ".obj" ? ".obj" : ".glb");
    return {};
}

}  // namespace

std::span<const FormatRow> format_rows() {
    return kRows;
}

const FormatRow& row_of(SplatFormat format) {
    return *std::ranges::find(kRows, format, &FormatRow::format);
}

const FormatRow* row_of_name(const std::filesystem::path& path) {
    const std::string name = core::lower(path.filename().string());
    const FormatRow* found = nullptr;
    // One extension is the end of another.
    for (const FormatRow& row : kRows)
        if ((ends_with(name, row.extension) || ends_with(name, row.other_extension)) &&
            (!found || row.extension.size() > found->extension.size()))
            found = &row;
    return found;
}

const FormatRow& row_to_write(const std::filesystem::path& path) {
    const FormatRow* row = row_of_name(path);
    if (row && row->writable()) return *row;
    const std::string written = extension_text(Uses::written);
    throw InputError(core::one_line(
        path.string() +
        (row ? ": ewa reads this format and does not write it; it writes " + written
             : ": not a supported kind of splat file; supported: " + written + mesh_advice(path))));
}

const FormatRow* row_of_head(const std::filesystem::path& path, std::string_view head) {
    const FormatRow* found = nullptr;
    for (const FormatRow& row : kRows) {
        const bool begins = std::ranges::any_of(row.beginnings, [&](std::string_view beginning) {
            return !beginning.empty() && head.starts_with(beginning);
        });
        if (begins && row.confirm && row.confirm(path)) return &row;
        if (begins && !row.confirm) found = &row;
    }
    return found;
}

std::string extension_list(Uses uses) {
    std::string text;
    for (const FormatRow& row : kRows)
        if (has_uses(row, uses)) (text += text.empty() ? "" : " ") += row.extension;
    return text;
}

std::string extension_text(Uses uses) {
    std::string text;
    for (const FormatRow& row : kRows)
        if (has_uses(row, uses)) ((text += text.empty() ? "" : ", ") += row.extension) += row.meaning;
    return text;
}

}  // namespace ewa::io
