// SPDX-License-Identifier: Apache-2.0
#include "cli/convert_edits.h"

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <utility>

#include "cli/output.h"
#include "cli/run_inputs.h"
#include "core/text.h"
#include "edit/journal.h"
#include "ewa/error.h"
#include "ewa/renderer.h"
#include "pipeline/contradicted.h"
#include "scene/framing.h"

namespace ewa::cli {

std::vector<edit::Edit> typed_edits(const CLI::App& app) {
    std::vector<edit::Edit> edits;
    std::map<const CLI::Option*, size_t> used;  // values of an option so far
    for (const CLI::Option* option : app.parse_order()) {
        if (option->check_lname("edits")) {
            const std::vector<edit::Edit> all = edit::edits_of_journal(option->results().at(used[option]++));
            edits.insert(edits.end(), all.begin(), all.end());
        }
        for (const edit::Row& row : edit::rows()) {
            if (!option->check_lname(row.name)) continue;
            const size_t value = used[option]++;
            edits.push_back(edit::parse(row.name, *row.value == 0 ? "" : option->results().at(value)));
        }
    }
    return edits;
}

namespace {

/// Compares splats of a run with its training images.
pipeline::Contradicted compared_with_photos(const folders::Run& run, const Gaussians& gaussians,
                                            const std::vector<uint32_t>& left, bool quiet) {
    CLI::App app("", "eval");  // whose options are those of the run
    const auto arguments = std::make_unique<ViewArguments>();
    ViewArguments& views = *arguments;
    views.splats = run.folder;
    add_view_positionals(app, views);
    add_view_options(app, views);
    resolve_views(app, views);
    pipeline::ComparedPhotos photos{
        .frames = {}, .load = load_training_image, .options = views.draw.options()};
    views.draw.load(views.splats, photos.options);
    const int test_every =
        run.number("test-every", 0, std::numeric_limits<int>::max(), RunOptions().test_every);
    const Views loaded = load_views(views, "train", test_every);
    for (const int frame : loaded.frames) photos.frames.push_back(loaded.dataset.frames[size_t(frame)]);
    photos.fit_colors = core::is_file(run.folder / folders::kAppearanceFile) ||
                        core::is_file(run.folder / folders::kOldExposuresFile);
    std::unique_ptr<Progress> progress;
    return pipeline::contradicted_splats(
        open_device(views.device), gaussians, left, photos, [&](size_t photo, size_t all, size_t round) {
            if (photo == 1)
                progress = std::make_unique<Progress>(fmt::format("round {}: compared", round), int(all),
                                                      "photos", quiet);
            progress->update(int(photo) - 1);
        });
}

std::string comparison_text(const pipeline::Contradicted& found) {
    const auto decibels = [](double error) { return -10 * std::log10(error); };
    return fmt::format(
        "{} contradicted by the photos: mean squared error {:.4g} with and {:.4g} without, PSNR {:.2f} and "
        "{:.2f} dB",
        core::counted(found.count, "splat"), found.before, found.after, decibels(found.before),
        decibels(found.after));
}

}  // namespace

edit::Cameras cameras_of(const std::optional<folders::Run>& run, std::vector<std::string>& remarks,
                         bool quiet) {
    if (!run) return {};
    edit::Cameras cameras = [run = *run] {
        std::vector<Camera> all;
        for (const Frame& frame : cameras_of_run(run).frames) all.push_back(frame.camera);
        return all;
    };
    cameras.contradicted = [run = *run, &remarks, quiet](const Gaussians& gaussians,
                                                         const std::vector<uint32_t>& left) {
        pipeline::Contradicted found = compared_with_photos(run, gaussians, left, quiet);
        remarks.push_back(comparison_text(found));
        return std::move(found.flags);
    };
    return cameras;
}

void draw_removed(const std::filesystem::path& picture, const Gaussians& all,
                  const std::vector<uint32_t>& left, const std::optional<folders::Run>& run) {
    constexpr int kWidth = 1280, kHeight = 720;
    Camera camera = scene::frame_scene(all, kWidth, kHeight).camera;
    if (run)
        if (const Dataset dataset = cameras_of_run(*run); !dataset.frames.empty())
            camera = scene::pinhole_at(dataset.frames.front().camera);
    RenderOptions options;
    if (all.density) options.kernel = Footprint::density;
    save_image(picture,
               Renderer(open_device({}), edit::with_removed_in_red(all, left), options).render(camera).color);
}

}  // namespace ewa::cli
