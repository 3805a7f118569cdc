// SPDX-License-Identifier: Apache-2.0
#include "train/run_input.h"

#include <spdlog/fmt/fmt.h>

#include "ewa/error.h"
#include "train/initial_splats.h"

namespace ewa {
namespace fs = std::filesystem;

std::string run_name(const RunOptions& options) {
    if (!options.scene.empty()) return options.scene.stem().string();
    std::error_code error;
    fs::path path = fs::weakly_canonical(options.dataset, error);
    if (error) path = options.dataset;
    if (path.has_extension() && !fs::is_directory(path, error)) path = path.parent_path();
    const std::string name = path.filename().string();
    return name.empty() || name == "." || name == ".." ? "dataset" : name;
}

fs::path output_folder(const RunOptions& options) {
    return options.output.empty() ? fs::path("out") / run_name(options) : options.output;
}

void check_options(const RunOptions& options) {
    const TrainOptions& train = options.train;
    if (train.strategy != Strategy::adc && train.strategy != Strategy::automatic &&
        (train.absolute_gradients || train.revised_opacity))
        throw InputError("--absgrad and --revised-opacity are options of --strategy adc");
}

namespace train {
namespace {

void add_remarks(RunInput& input) {
    const Dataset& dataset = input.dataset;
    if (input.without_view_dependence())
        input.remarks.push_back("the dataset says that no colour depends on the view: SH degree 0");
    if (input.options.init == "sfm" && dataset.points.positions.empty())
        input.remarks.push_back("the dataset has no points: training starts from random splats");
    if (dataset.missing_images > 0)
        input.remarks.push_back(fmt::format("{} images are missing and are skipped", dataset.missing_images));
    if (dataset.dropped_points > 0)
        input.remarks.push_back(fmt::format("{} points have a coordinate that is not finite and are skipped",
                                            dataset.dropped_points));
}

}  // namespace

RunInput load_run(const RunOptions& options) {
    RunInput input;
    input.options = options;
    input.name = run_name(options);
    input.dataset = load_dataset(options.dataset, {.downscale = options.downscale, .masks = options.masks});
    input.split = split_frames(input.dataset, options.test_every);
    if (input.split.train.empty())
        throw InputError(fmt::format("{}: of {} images ({} missing) none is left to train on",
                                     options.dataset.string(), input.dataset.frames.size(),
                                     input.dataset.missing_images));
    TrainOptions& train = input.options.train;
    train = resolve(train, input.dataset);
    train.render.sh_degree = train.sh_degree;
    input.options.output = output_folder(options);
    input.start = initial_splats(input.options, input.dataset, input.split.train);
    add_remarks(input);
    return input;
}

std::vector<int> spread_out(const std::vector<int>& indices, size_t count) {
    if (indices.size() <= count) return indices;
    std::vector<int> some;
    for (size_t i = 0; i < count; ++i) some.push_back(indices[i * indices.size() / count]);
    return some;
}

}  // namespace train
}  // namespace ewa
