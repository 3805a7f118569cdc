// SPDX-License-Identifier: Apache-2.0
#include "cli/convert_page.h"

#include "cli/run_inputs.h"
#include "core/atomic_file.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "report/scene_page.h"
#include "scene/framing.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

/// Each page of a folder has levels of its own. Relative to it.
fs::path levels_beside(const fs::path& page) {
    return fs::path(page.stem().string() + "-levels") / "lod-meta.json";
}

constexpr int kStartWidth = 1280, kStartHeight = 720;

/// The cameras of the run's dataset, in the order of their names. Empty, with a remark, where they cannot be read.
Dataset cameras_of(const live::Run& run, std::vector<std::string>& remarks) {
    try {
        return cameras_of_run(run);
    } catch (const InputError& error) {
        remarks.push_back("the page has no views of photos: " + core::one_line(error.what()));
        return {};
    }
}

}  // namespace

bool names_page(const fs::path& path) {
    const std::string extension = core::lower(path.extension().string());
    return extension == ".html" || extension == ".htm";
}

fs::path levels_of_page(const fs::path& page) {
    return page.parent_path() / levels_beside(page);
}

std::vector<std::string> write_page(const fs::path& path, Gaussians gaussians, const SaveOptions& options,
                                    const std::optional<live::Run>& run, const OutputOptions& output) {
    std::vector<std::string> remarks;
    report::ScenePage page;
    page.title = output.title.empty() ? path.stem().string() : output.title;
    core::AtomicFile file(path);
    scene::FramingHints hints;
    if (run) {
        const Dataset dataset = cameras_of(*run, remarks);
        for (const Frame& frame : dataset.frames)
            page.views.push_back({frame.name, scene::pinhole_at(frame.camera)});
        if (!dataset.frames.empty()) {
            hints.up = scene::mean_up(dataset);
            hints.forward = glm::transpose(dataset.frames[0].camera.rotation)[2];
        }
        if (const auto colour = core::parse_colour(run->text("background"))) page.background = *colour;
    }
    const scene::Framing framing = scene::frame_scene(gaussians, kStartWidth, kStartHeight, hints);
    page.start = page.views.empty() ? framing.camera : page.views.front().camera;
    if (page.views.empty())
        page.portrait = scene::frame_scene(gaussians, kStartHeight, kStartWidth, hints).camera;
    page.target = framing.target;
    page.up = framing.up;
    if (output.unbundled) {
        page.levels = levels_beside(path).generic_string();
        for (std::string& remark : save_levels(levels_of_page(path), std::move(gaussians), options))
            remarks.push_back(std::move(remark));
    } else {
        page.sog = sog_bytes(path, gaussians, options, remarks);
    }
    file.write(report::scene_page_html(page));
    file.commit();
    return remarks;
}

}  // namespace ewa::cli
