// SPDX-License-Identifier: Apache-2.0
// The inputs of a training run: its dataset and its first splats.
#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "ewa/device.h"
#include "ewa/run_options.h"
#include "prepare/viewed_sphere.h"
#include "scene/frame_images.h"
#include "train/needs.h"

namespace ewa::train {

struct RunInput {
    RunOptions options;  // strategy, SH degree and folder are resolved
    std::string name;
    Dataset dataset;
    Split split;
    Gaussians start;
    bool from_points = false;  // `start` is a cloud of points, which can be thinned
    scene::KeptImages images;  // decoded images, so that they are not read again
    // For the user and the report: ewa's choices, and possible problems.
    std::vector<std::string> notes, remarks;

    /// The dataset says that SH degree 0 suffices, and the run uses that.
    bool without_view_dependence() const {
        return options.train.sh_degree == 0 && !dataset.color_depends_on_view;
    }
};

/// Loads the dataset and the first splats. Throws InputError. on_dataset: called before images are decoded, without first splats.
RunInput load_run(const RunOptions& options, const std::function<void(const RunInput&)>& on_dataset = {});

/// Thins the points if the device lacks memory for one splat per point, and returns whether it did. It does not if the user set the
/// number of splats. needs: of the input.
bool thin_for_device(RunInput& input, Needs& needs);

/// Whether RunOptions::init is a word, and not a file.
inline bool starts_by_word(const std::string& init) {
    return init == "sfm" || init == "stereo" || init == "random";
}

/// Where the first splats come from.
enum class StartsFrom { points, depth_maps, stereo, random, file };
struct StartSource {
    StartsFrom from = StartsFrom::file;
    size_t points = 0, images = 0;  // of StartsFrom::stereo
    std::string skipped;            // a line on skipped contents of a file, and why; empty: none
    bool cloud = false;             // the file has points
    std::string thinned;            // a line about the thinning of points; empty: none
};

/// The first splats that the options ask for. frames: indices of the training frames. options: with a resolved SH degree. source:
/// receives where the splats come from; may be null. Throws InputError (a splat file or an image that cannot be read, too many
/// splats, --init stereo of images that agree on no depths).
Gaussians initial_splats(const RunOptions& options, const Dataset& dataset, const std::vector<int>& frames,
                         StartSource* source = nullptr);

/// Throws InputError if the options, or the files that they name, are wrong for every dataset. Call it before the long work that
/// makes a dataset.
void check_without_dataset(const RunOptions& options);

/// Throws InputError if --downscale leaves too little of an image to learn from. factor: of --downscale. left: the part of the
/// factor by which width and height, in px, are still to be divided.
void check_downscale(int factor, int left, int width, int height, const std::string& image);

/// Throws InputError if --max-width leaves too little of an image that is wider. width, height: of that image, px.
void check_max_width(int most, int width, int height, const std::string& image);

/// `count` splats, spread evenly over the part of viewed_sphere(frames) that lies in at least one frustum. If
/// that part is too small to hit, a splat lies on a random ray of a camera, at most the sphere's radius away.
/// Colours are grey with a little noise, and scales are as in gaussians_from_points. Each splat is a pure
/// function of seed and index. frames must not be empty.
Gaussians random_gaussians(const Dataset& dataset, const std::vector<int>& frames, int count, uint64_t seed,
                           int sh_degree);

}  // namespace ewa::train
