// SPDX-License-Identifier: Apache-2.0
// Options that several commands have, with the same names, ranges and meaning in each.
#pragma once
#include <string>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/device.h"
#include "ewa/render_options.h"

namespace CLI {
class App;
}

namespace ewa::cli {

/// How a picture is drawn: --background, --kernel, --antialias, --sh-degree.
struct DrawArguments {
    std::string background = "0,0,0";
    std::string kernel = "peak";
    bool antialias = false;        // the short form of --kernel antialias
    int sh_degree = kMaxShDegree;  // -1, in training: as the dataset needs

    bool random_allowed = false;  // whether the background may be random, as in training

    bool degree_by_dataset = false;  // whether sh_degree may be left to the dataset, as in training

    bool random_background() const { return random_allowed && background == "random"; }
    /// Throws InputError for a background that is not three numbers of [0, 1]. A random background is black
    /// here.
    RenderOptions options() const;
};
void add_draw_options(CLI::App& app, DrawArguments& arguments);

/// --device and --validation.
void add_device_options(CLI::App& app, DeviceOptions& options);

/// --masks
void add_masks_option(CLI::App& app, MaskUse& masks);
std::string masks_text(MaskUse masks);

void add_downscale_option(CLI::App& app, int& downscale);
void add_test_every_option(CLI::App& app, int& test_every);

/// Indices of frames for "all", "train", "test" or a list like "0,3,7" in name order. Throws InputError, also
/// when there are none.
std::vector<int> select_frames(const Dataset& dataset, const std::string& which, int test_every);

}  // namespace ewa::cli
