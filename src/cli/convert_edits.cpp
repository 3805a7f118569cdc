// SPDX-License-Identifier: Apache-2.0
#include "cli/convert_edits.h"

#include <CLI/CLI.hpp>
#include <map>

#include "cli/run_inputs.h"
#include "edit/journal.h"
#include "ewa/error.h"
#include "ewa/renderer.h"
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

edit::Cameras cameras_of(const std::optional<folders::Run>& run) {
    if (!run) return {};
    return [run = *run] {
        std::vector<Camera> cameras;
        for (const Frame& frame : cameras_of_run(run).frames) cameras.push_back(frame.camera);
        return cameras;
    };
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
