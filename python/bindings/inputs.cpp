// SPDX-License-Identifier: Apache-2.0
#include "inputs.h"

#include <algorithm>

#include "arrays.h"
#include "capture/run_inputs.h"
#include "capture/what_is.h"
#include "core/typing.h"
#include "errors.h"
#include "ewa/capture.h"
#include "ewa/run_options.h"
#include "ewa/splat_files.h"
#include "io/datasets/refined_cameras.h"

namespace ewa::python {
namespace {

namespace fs = std::filesystem;

/// A dataset, and what keeps its files.
struct KeptDataset {
    Dataset dataset;
    std::shared_ptr<const void> files = {};
};

DatasetOptions options_of(const AskedDataset& asked, const std::optional<folders::Run>& run) {
    DatasetOptions options = run ? capture::dataset_options_of(*run) : DatasetOptions();
    options.downscale = asked.downscale.value_or(options.downscale);
    options.max_width = asked.max_width.value_or(options.max_width);
    options.masks = asked.masks.value_or(options.masks);
    options.lens = asked.lens.value_or(options.lens);
    options.need_images = asked.need_images;
    return options;
}

int test_every_of(const std::optional<folders::Run>& run) {
    const nlohmann::json none;
    const nlohmann::json& value =
        run && run->config.contains("test-every") ? run->config["test-every"] : none;
    return value.is_number_unsigned() ? value.get<int>() : RunOptions().test_every;
}

}  // namespace

namespace {

LoadedDataset read_dataset(const fs::path& path, const AskedDataset& asked) {
    return with_files([&] {
        const std::optional<folders::Run> run = capture::run_named(path);
        LoadedDataset opened{nullptr, fs::absolute(path), options_of(asked, run), test_every_of(run)};
        if (run) opened.background = core::parse_colour(run->text("background")).value_or(opened.background);
        const fs::path named = run ? capture::dataset_of(*run) : path;
        opened.archived = what_is(named) == What::archive;
        auto kept = std::make_shared<KeptDataset>();
        const auto read = [&](const fs::path& folder) {
            kept->dataset = load_dataset(folder, opened.options);
        };
        if (opened.archived)
            kept->files = read_archive(named, read);
        else
            read(named);
        const fs::path refined = run ? capture::refined_cameras_of(*run) : fs::path();
        if (!refined.empty()) io::use_refined_cameras(kept->dataset, refined);
        opened.dataset = SharedDataset(kept, &kept->dataset);
        return opened;
    });
}

}  // namespace

LoadedDataset open_dataset(const fs::path& path, const AskedDataset& asked) {
    LoadedDataset opened = read_dataset(path, asked);
    const Dataset& dataset = *opened.dataset;
    // Some photos without cameras are usual.
    const bool unused = std::ranges::any_of(dataset.used, [](const UsedOf& kind) {
        return !kind.why.empty() && (kind.what != "photo" || 2 * kind.used <= kind.found);
    });
    if (unused && opened.options.need_images)
        warn(PyExc_UserWarning, spelled((path.string() + ": used " + used_text(dataset)).c_str()));
    return opened;
}

Splats open_splats(const fs::path& path) {
    SplatScene scene = with_files([&] { return read_splats(capture::splat_input(path).file); });
    for (const std::string& remark : scene.remarks)
        warn(PyExc_UserWarning, spelled((path.string() + ": " + remark).c_str()));
    return {std::move(scene.gaussians), scene.antialiased, std::move(scene.comments)};
}

std::vector<int> frames_of(nb::handle value, const Dataset& dataset, const char* name) {
    const Array<int64_t> array(value, name, {any('m')});
    const auto count = int64_t(dataset.frames.size());
    std::vector<int> frames;
    for (const int64_t index : array.values()) {
        if (index < 0 || index >= count)
            throw nb::index_error((std::string(name) + " has the index " + std::to_string(index) +
                                   "; the dataset has " + core::counted(uint64_t(count), "frame"))
                                      .c_str());
        frames.push_back(int(index));
    }
    return frames;
}

}  // namespace ewa::python
