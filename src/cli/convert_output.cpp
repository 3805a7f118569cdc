// SPDX-License-Identifier: Apache-2.0
#include "cli/convert_output.h"

#include <CLI/CLI.hpp>

#include "cli/arguments.h"
#include "cli/run_inputs.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::cli {

void add_output_options(CLI::App& app, io::OutputOptions& options) {
    app.add_option("--spz-version", options.spz_version,
                   "SPZ version of an .spz: 3 (every reader supports it) or 4 (newer, smaller files) [3]")
        ->transform(one_of({"3", "4"}))
        ->type_name("3|4");
    app.add_flag("--gltf-spz", options.gltf_spz,
                 "Pack the splats of a .glb or .gltf as SPZ (KHR_gaussian_splatting_compression_spz_2)");
    app.add_option("--levels", options.levels,
                   "Levels of a lod-meta.json, tileset.json or --unbundled page, each with half of the "
                   "splats of the one before; fewer where a tile would have less than 1,000 [until one "
                   "has at most a million, or a tile 100,000]")
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

void show_run(const folders::Run& run, Dataset& cameras, PageOptions& page,
              std::vector<std::string>& remarks) {
    page.background = core::parse_colour(run.text("background")).value_or(page.background);
    try {
        cameras = cameras_of_run(run);
        page.cameras = &cameras;
    } catch (const InputError& error) {
        remarks.push_back("the page has no views of photos: " + core::one_line(error.what()));
    }
}

}  // namespace ewa::cli
