// SPDX-License-Identifier: Apache-2.0
#include "cli/dataset_argument.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "cli/arguments.h"
#include "cli/interrupt.h"
#include "cli/progress.h"
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

SyntheticDataset render_with_progress(const DeviceOptions& device, const fs::path& scene,
                                      const fs::path& folder, const SyntheticOptions& options, bool quiet) {
    const InterruptWatch watch;
    std::unique_ptr<Progress> progress;
    const SyntheticDataset made =
        render_dataset(open_device(device), scene, folder, options, [&](int done, int total) {
            if (!progress) progress = std::make_unique<Progress>("rendered", total, "views", quiet);
            if (done > 0) progress->update(done);
            return !interrupted();
        });
    progress.reset();
    if (quiet) return made;
    for (const std::string& remark : made.remarks) fmt::print("note: {}\n", core::one_line(remark));
    if (made.dropped_triangles > 0)
        fmt::print("{} triangles with a corner that is not finite are skipped\n", made.dropped_triangles);
    if (made.unfinished_rays > 0)
        fmt::print("{} rays exceeded the step limit of the device and see nothing\n", made.unfinished_rays);
    if (made.dropped_samples > 0)
        fmt::print("{} paths were not finite and count as black\n", made.dropped_samples);
    if (made.interrupted)
        fmt::print("interrupted; the same command continues\n");
    else
        fmt::print("{} views are in {}{}, exposure {:+.1f} stops; {}\n", made.views,
                   core::one_line(folder.string()),
                   made.kept > 0 ? fmt::format(" ({} existed already)", made.kept) : "", made.exposure,
                   made.color_depends_on_view ? "colours depend on the view"
                                              : "every material is diffuse: SH degree 0 suffices");
    return made;
}

std::optional<LoadedDataset> load_with_images(const fs::path& path, const fs::path& splats,
                                              const DatasetOptions& options, const DeviceOptions& device) {
    if (!names_mesh_scene(path)) return LoadedDataset{load_dataset(path, options), nullptr};
    if (const fs::path beside = splats.parent_path() / "dataset"; is_rendered(path, beside, {}))
        return LoadedDataset{load_dataset(beside, options), nullptr};
    auto folder = std::make_unique<core::TemporaryFolder>("ewa-images-");
    // A signal after the last view is noticed here: the watch of the rendering has ended.
    if (render_with_progress(device, path, folder->path(), {}, false).interrupted || interrupted())
        return std::nullopt;
    return LoadedDataset{load_dataset(folder->path(), options), std::move(folder)};
}

}  // namespace ewa::cli
