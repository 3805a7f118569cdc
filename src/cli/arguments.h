// SPDX-License-Identifier: Apache-2.0
// Options that several commands have, with the same names, ranges and meaning in each.
#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/device.h"
#include "ewa/render_options.h"

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

/// --device and --validation.
void add_device_options(CLI::App& app, DeviceOptions& options);

/// For a number from low to high; the help shows it as type_name("N") instead of the range.
template <typename T>
CLI::Validator in_range(T low, T high) {
    return CLI::Range(low, high).description("");
}

/// Refuses a sign: CLI11 reads -1 into an unsigned number as its largest value.
CLI::Validator without_sign();

/// --masks
void add_masks_option(CLI::App& app, MaskUse& masks);

void add_downscale_option(CLI::App& app, int& downscale);
void add_test_every_option(CLI::App& app, int& test_every);

/// Indices of frames for "all", "train", "test" or a list like "0,3,7" in name order. Throws InputError, also
/// when there are none.
std::vector<int> select_frames(const Dataset& dataset, const std::string& which, int test_every);

}  // namespace ewa::cli
