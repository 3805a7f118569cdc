// SPDX-License-Identifier: Apache-2.0
#include "cli/dataset_argument.h"

#include <algorithm>

#include "cli/arguments.h"
#include "cli/interrupt.h"
#include "cli/synthetic_dataset.h"
#include "core/text.h"

namespace ewa::cli {

namespace fs = std::filesystem;

bool names_mesh_scene(const fs::path& path) {
    std::error_code error;
    if (fs::is_directory(path, error)) return false;
    const std::string extension = core::lower(path.extension().string());
    return extension == ".gltf" || extension == ".glb" || is_mesh_scene(path);
}

void check_frames(const fs::path& path, const std::string& which, int test_every) {
    if (names_mesh_scene(path)) select_frames(scene_cameras(path, {}), which, test_every);
}

Dataset load_cameras_as_trained(const fs::path& path, int downscale) {
    if (names_mesh_scene(path)) {
        Dataset dataset = scene_cameras(path, {});
        for (Frame& frame : dataset.frames) frame.camera = ewa::downscale(frame.camera, downscale);
        return dataset;
    }
    Dataset dataset = load_dataset(path, {.downscale = downscale, .need_images = false});
    auto missing = [](const Frame& frame) { return !frame.image_exists; };
    const auto count = std::count_if(dataset.frames.begin(), dataset.frames.end(), missing);
    dataset.missing_images = static_cast<int>(count);
    if (count < std::ssize(dataset.frames)) std::erase_if(dataset.frames, missing);
    return dataset;
}

std::optional<Photographed> load_photographed(const fs::path& path, const fs::path& splats,
                                              const DatasetOptions& options, const DeviceOptions& device) {
    if (!names_mesh_scene(path)) return Photographed{load_dataset(path, options), nullptr};
    if (const fs::path beside = splats.parent_path() / "dataset"; is_rendered(path, beside, {}))
        return Photographed{load_dataset(beside, options), nullptr};
    auto folder = std::make_unique<core::TemporaryFolder>("ewa-photographs-");
    // Its watch over signals has ended with it: what came too late for a view is met here.
    if (photograph_with_progress(device, path, folder->path(), {}, false).interrupted || interrupted())
        return std::nullopt;
    return Photographed{load_dataset(folder->path(), options), std::move(folder)};
}

}  // namespace ewa::cli
