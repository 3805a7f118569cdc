// SPDX-License-Identifier: Apache-2.0
#include "cli/convert_output.h"

#include <CLI/CLI.hpp>

#include "cli/arguments.h"
#include "cli/convert_page.h"
#include "cli/convert_tiles.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

void check_options(const ConvertOutput& output, const OutputOptions& options) {
    const SplatFormat format = output.format;
    const bool levels =
        format == SplatFormat::sog_levels || format == SplatFormat::rad || output.tiles || options.unbundled;
    if (!options.geo.empty() && !output.tiles) throw InputError("--geo: only a tileset.json is on a globe");
    if (!options.title.empty() && !output.page) throw InputError("--title: only a page has one");
    if (options.unbundled && !output.page) throw InputError("--unbundled: only a page has its scene inside");
    if (options.levels > 0 && !levels)
        throw InputError(
            "--levels: only a lod-meta.json, a .rad, a tileset.json and an --unbundled page have levels");
    if (options.spz_version > 0 && (output.tiles || options.gltf_spz))
        throw InputError("--spz-version: a glTF and tiles hold SPZ 2; only an .spz has a version to choose");
    if (options.spz_version > 0 && format != SplatFormat::spz)
        throw InputError("--spz-version: only an .spz has one");
    if (options.gltf_spz && format != SplatFormat::glb && format != SplatFormat::gltf)
        throw InputError("--gltf-spz: only a .glb or .gltf can hold an SPZ");
}

void check_readable(const ConvertOutput& output, const OutputOptions& options) {
    if (output.page) throw InputError("--check: ewa does not read a page; check a .sog, which it holds");
    if (output.tiles)
        throw InputError("--check: ewa reads no tileset; check a .glb with --gltf-spz, which its tiles are");
    if (output.format == SplatFormat::sog_levels)
        throw InputError(
            "--check: its splats are in another order; check a .sog, which level 0 holds in chunks");
    if (output.format == SplatFormat::rad && options.levels > 1)
        throw InputError("--check: the splats of a tree are in another order; check a .rad without --levels");
}

}  // namespace

void add_output_options(CLI::App& app, OutputOptions& options) {
    app.add_option("--spz-version", options.spz_version,
                   "SPZ version of an .spz: 3 (every reader supports it) or 4 (newer, smaller files) [3]")
        ->transform(one_of({"3", "4"}))
        ->type_name("3|4");
    app.add_flag("--gltf-spz", options.gltf_spz,
                 "Pack the splats of a .glb or .gltf as SPZ (KHR_gaussian_splatting_compression_spz_2)");
    app.add_option("--levels", options.levels,
                   "Levels of a lod-meta.json, .rad, tileset.json or --unbundled page, each with half of the "
                   "splats of the one before; fewer where a tile would have less than 1,000 [until one "
                   "has at most a million, or a tile 100,000; none in a .rad]")
        ->transform(in_range(1, 32))
        ->type_name("N");
    app.add_flag(
        "--unbundled", options.unbundled,
        "Write the scene of a page NAME.html beside it, as NAME-levels/lod-meta.json, of which a web server "
        "gives the browser what a view needs");
    app.add_option("--title", options.title, "Title of a page [the name of its file]")->type_name("TEXT");
    app.add_option(
           "--geo", options.geo,
           "Where a tileset.json puts the scene, in degrees (WGS 84) and metres: x points east, z to the "
           "heading, which is north without it, and y down. Or ecef: the scene's coordinates are those of "
           "the earth")
        ->type_name("LAT,LON,HEIGHT[,HEADING]|ecef");
}

namespace {

SplatFormat format_of_output(const fs::path& file) try {
    return format_to_write(file);
} catch (const InputError& error) {
    const std::string extension = core::lower(file.extension().string());
    std::string hint = ", tileset.json, .html (a page)";
    for (const char* mesh : {".obj", ".stl", ".fbx", ".dae"})
        if (extension == mesh)
            hint += "; ewa mesh makes meshes: ewa mesh IN -o " + file.stem().string() +
                    (extension == ".obj" ? ".obj" : ".glb");
    throw InputError(error.what() + core::one_line(hint));
}

}  // namespace

ConvertOutput output_of(const fs::path& file, const OutputOptions& options, bool check) {
    ConvertOutput output{.file = file,
                         .page = names_page(file),
                         .tiles = names_tileset(file),
                         .earth = parse_geo(options.geo)};
    output.format = output.page ? SplatFormat::sog : output.tiles ? SplatFormat::glb : format_of_output(file);
    check_options(output, options);
    if (check) check_readable(output, options);
    return output;
}

std::vector<std::string> write_output(const ConvertOutput& output, const OutputOptions& options,
                                      Gaussians& gaussians, SaveOptions save,
                                      const std::optional<live::Run>& run) {
    if (options.spz_version > 0) save.spz_version = options.spz_version;
    save.gltf_spz = options.gltf_spz;
    save.levels = options.levels;
    if (output.page) return write_page(output.file, std::move(gaussians), save, run, options);
    if (output.tiles) return write_tiles(output.file, std::move(gaussians), save, output.earth);
    if (output.format == SplatFormat::sog_levels) return save_levels(output.file, std::move(gaussians), save);
    return save_splats(output.file, gaussians, save);
}

}  // namespace ewa::cli
