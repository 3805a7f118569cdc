// SPDX-License-Identifier: Apache-2.0
// Arguments that several commands share, with the same names, ranges and help texts.
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

/// How a scene is rendered: --background, --kernel, --antialias, --sh-degree.
struct DrawArguments {
    std::string background = "0,0,0";
    std::string kernel = "peak";
    bool antialias = false;  // the short form of --kernel antialias
    int sh_degree = kMaxShDegree;

    /// Throws InputError if the background is not three numbers in [0, 1].
    RenderOptions options() const;
};
void add_draw_options(CLI::App& app, DrawArguments& arguments);

/// The required positionals SPLATS and DATASET.
void add_splats(CLI::App& app, std::filesystem::path& splats);
void add_dataset(CLI::App& app, std::filesystem::path& dataset);

/// --device and --validation.
void add_device_options(CLI::App& app, DeviceOptions& options);

/// --masks
void add_masks_option(CLI::App& app, MaskUse& masks);

void add_downscale_option(CLI::App& app, int& downscale);
/// --frames and --test-every.
void add_frames_options(CLI::App& app, std::string& frames, int& test_every);
void add_quiet_option(CLI::App& app, bool& quiet);
void add_test_every_option(CLI::App& app, int& test_every);

/// The indices of the frames that --frames names: "all", "train", "test", or a list such as "0,3,7" in name
/// order. Throws InputError, also if there are none.
std::vector<int> select_frames(const Dataset& dataset, const std::string& which, int test_every);

}  // namespace ewa::cli
