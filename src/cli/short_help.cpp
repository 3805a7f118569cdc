// SPDX-License-Identifier: Apache-2.0
#include "cli/short_help.h"

#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <utility>

#include "core/text.h"
#include "run/option_table.h"

namespace ewa::cli {
namespace {

/// Those of ewa train that are not in train::run_options(), and all of other commands.
std::map<std::string, core::ShortHelp> often_used() {
    return {{"train",
             {{"output", "Folder of the run [out/<name of the dataset>]"},
              {"quality", "Steps of the run: 2000, 7000 or 30000"},
              {"config", "Options from a JSON file, such as a config.json"},
              {"resume", "Continue the run in DIR from its checkpoint"},
              {"force", "Replace the run in DIR"},
              {"serve", "Let ewa-view watch the training by this port"}}},
            {"render",
             {{"SPLATS", "Splat file, or folder of a training run"},
              {"output", "Folder for the renders, one image, or a film"},
              {"format", "Format of the images in a folder"},
              {"mode", "What the renders show"},
              {"cameras", "Dataset whose cameras to render through"},
              {"frames", ""},
              {"size", "Size of the renders, px, or 720p, 1080p, 4k"},
              {"orbit", "N views round the scene"},
              {"look-at", "Look from x,y,z at X,Y,Z (world units)"},
              {"views", "Saved views of ewa-view; a film goes through them"},
              {"through", "fisheye[:DEGREES], equirectangular, orthographic or opencv:K1,..."},
              {"downscale", ""},
              {"background", "Colour behind the splats, or a sky.json"},
              {"transparent", "No background"},
              {"kernel", "Footprint of a splat"},
              {"quiet", ""},
              {"device", "Device by its number or name (see ewa devices)"}}},
            {"convert",
             {{"FILES", "One or more inputs, which are joined, then the output, unless -o names it"},
              {"output", ""},
              {"spz-version", "SPZ version of an .spz"},
              {"levels", "Levels of a lod-meta.json, page or 3D Tiles"},
              {"check", "Read the output back and print its error"},
              {"quiet", ""},
              {"transform", "move=x,y,z, turn=x,y,z,degrees or scale=s"},
              {"max-sh", ""},
              {"decimate", "Merge near splats until N or P% are left"},
              {"where", "Keep only splats of opacity=0.1.., box=..., sphere=... or the like"},
              {"crop", "Keep only splats in this box"},
              {"remove-invalid", "Remove splats with a value that is not finite"},
              {"remove-floaters", "Remove small groups of splats far from others"}}},
            {"compare",
             {{"A", ""},
              {"B", ""},
              {"threshold", "Exit with status 1 if the PSNR is lower"},
              {"max-error", "Exit with status 1 if two values differ by more"},
              {"metrics", "Metrics beside PSNR and SSIM, or all"},
              {"json", ""},
              {"heat-map", "Write the error as an image, or as one per pair"},
              {"cameras", "Dataset whose cameras render splat files"},
              {"frames", ""},
              {"downscale", ""},
              {"background", "Colour behind the splats, or a sky.json"},
              {"kernel", "Footprint of a splat"},
              {"device", "Device by its number or name (see ewa devices)"}}}};
}

}  // namespace

void use_short_help(CLI::App& command) {
    std::map<std::string, core::ShortHelp> commands = often_used();
    const auto found = commands.find(command.get_name());
    if (found == commands.end()) return;
    core::ShortHelp shown = std::move(found->second);
    if (command.get_name() == "train")
        for (const train::RunOption& option : train::run_options())
            if (!option.brief.empty())
                shown[option.name == "dataset" ? "DATASET" : option.name] = option.brief;
    shown.insert({{"help", "Print this help and exit"}, {"help-all", ""}});
    command.set_help_all_flag("--help-all", "Print the help of all options and exit");
    core::use_help_text<CLI::Formatter>(command, std::move(shown));
}

}  // namespace ewa::cli
