// SPDX-License-Identifier: Apache-2.0
#include "run/inria_files.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <system_error>

#include "core/atomic_file.h"
#include "core/folders.h"
#include "core/json.h"
#include "folders/run_folder.h"
#include "io/datasets/image_records.h"
#include "run/run_files.h"
#include "scene/lens.h"

namespace ewa::train {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char *kArguments = "cfg_args", *kSplats = "point_cloud";

/// The text as a literal of Python: INRIA's scripts evaluate cfg_args.
std::string python_text(std::string_view text) {
    std::string literal = "'";
    for (const char c : text) {
        if (c == '\'' || c == '\\') literal += '\\';
        if (static_cast<unsigned char>(c) < ' ')
            literal += fmt::format("\\x{:02x}", int(c));
        else
            literal += c;
    }
    return literal + "'";
}

std::string arguments_text(const RunInput& input, const fs::path& model, int sh_degree) {
    std::error_code ignored;
    const auto absolute = [&](const fs::path& path) {
        return python_text(fs::absolute(path, ignored).lexically_normal().string());
    };
    const auto& [r, g, b] = input.options.train.render.background;
    return fmt::format(
        "Namespace(data_device='cuda', eval={}, images='images', model_path={}, resolution={}, sh_degree={}, "
        "source_path={}, white_background={})",
        input.split.test.empty() ? "False" : "True", absolute(model), input.options.downscale, sh_degree,
        absolute(input.dataset.root), r == 1 && g == 1 && b == 1 ? "True" : "False");
}

/// The camera without its lens. A lens that no pinhole comes near becomes one of 90 degrees.
Camera without_lens(Camera camera) {
    if (!scene::has_pinhole(camera.distortion.lens)) {
        if (camera.distortion.lens == Lens::equirectangular)
            camera.width = camera.height = std::max(1, camera.width / 4);
        camera.fx = camera.fy = 0.5 * std::max(camera.width, camera.height);
    }
    return camera;
}

/// Position and rotation are camera to world, in OpenCV's axes.
Json camera_entry(const Frame& frame, size_t id) {
    const Camera camera = without_lens(frame.camera);
    const glm::dvec3 position = camera.position();
    Json rotation = Json::array();
    for (int row = 0; row < 3; ++row)
        rotation.push_back({camera.rotation[row][0], camera.rotation[row][1], camera.rotation[row][2]});
    return {{"id", id},
            {"img_name", fs::path(frame.name).stem().string()},
            {"width", camera.width},
            {"height", camera.height},
            {"position", {position.x, position.y, position.z}},
            {"rotation", rotation},
            {"fy", camera.fy},
            {"fx", camera.fx}};
}

fs::path made_without_links(const fs::path& folder) {
    core::make_folder(without_link(folder));
    return folder;
}

}  // namespace

void save_inria(const fs::path& folder, const RunInput& input, const Gaussians& gaussians, int step) {
    const fs::path model = made_without_links(folder / folders::kInriaFolder);
    Json cameras = Json::array();
    for (const auto* frames : {&input.split.test, &input.split.train})
        for (const int index : *frames)
            cameras.push_back(camera_entry(input.dataset.frames[size_t(index)], cameras.size()));
    core::write_json(without_link(model / "cameras.json"), cameras);
    core::write_text_file(without_link(model / kArguments),
                          arguments_text(input, model, gaussians.sh_degree));
    io::write_points_ply(without_link(model / "input.ply"), input.dataset.points);
    const fs::path splats =
        made_without_links(made_without_links(model / kSplats) / fmt::format("iteration_{}", step));
    write_splats(without_link(splats / "point_cloud.ply"), gaussians, step, input.options.train.render,
                 place_of(input));
}

void remove_inria_splats(const fs::path& folder) {
    const fs::path model = folder / folders::kInriaFolder;
    std::error_code absent;
    if (fs::is_symlink(model, absent) || !core::is_file(model / kArguments)) return;
    fs::remove_all(model / kSplats, absent);
}

}  // namespace ewa::train
