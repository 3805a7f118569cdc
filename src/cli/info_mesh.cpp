// SPDX-License-Identifier: Apache-2.0
#include "cli/info_mesh.h"

#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>

#include "cli/text.h"
#include "core/text.h"
#include "ewa/synthetic_dataset.h"
#include "io/gltf/mesh.h"

namespace ewa::cli {

void info_mesh(const std::filesystem::path& path, int test_every, bool json) {
    const scene::MeshScene scene = io::read_gltf_mesh(path);
    const Dataset views = scene_cameras(path, {});
    const Split split = split_frames(views, test_every);
    const scene::Box box = scene::bounds_of(scene);
    const auto bytes = std::filesystem::file_size(path);
    // The last material is the one of triangles that name none.
    const size_t materials = scene.materials.size() - 1;
    if (json) {
        const nlohmann::ordered_json out = {
            {"kind", "mesh scene"},
            {"bytes", bytes},
            {"triangles", scene.triangles.size()},
            {"dropped_triangles", scene.dropped_triangles},
            {"materials", materials},
            {"textures", scene.textures.size()},
            {"images", scene.images.size()},
            {"lights", scene.lights.size()},
            {"cameras", scene.cameras.size()},
            {"bounds",
             {{"min", {box.low.x, box.low.y, box.low.z}}, {"max", {box.high.x, box.high.y, box.high.z}}}},
            {"views", views.frames.size()},
            {"train", split.train.size()},
            {"test", split.test.size()},
            {"color_depends_on_view", views.color_depends_on_view},
            {"notes", scene.remarks}};
        fmt::print("{}\n", out.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
        return;
    }
    fmt::print("{}\nkind            mesh scene (glTF), {}\n", core::one_line(path.string()),
               bytes_text(bytes));
    for (const std::string& remark : scene.remarks)
        fmt::print("note            {}\n", core::one_line(remark));
    fmt::print("triangles       {} ({} more are left out: a corner is not finite)\n", scene.triangles.size(),
               scene.dropped_triangles);
    fmt::print("materials       {}, with {} textures of {} images\n", materials, scene.textures.size(),
               scene.images.size());
    fmt::print("lights          {}, and the sky\n", scene.lights.size());
    fmt::print("bounds          ({:.6g}, {:.6g}, {:.6g}) .. ({:.6g}, {:.6g}, {:.6g})\n", box.low.x, box.low.y,
               box.low.z, box.high.x, box.high.y, box.high.z);
    fmt::print("views           {} of {} ({} train, {} test with --test-every {})\n", views.frames.size(),
               views.frames.size() == scene.cameras.size() ? "the file's cameras" : "a dome over it",
               split.train.size(), split.test.size(), test_every);
    fmt::print("colour          {}\n",
               views.color_depends_on_view
                   ? "depends on the view"
                   : "every material is diffuse: training leaves SH degrees 1 to 3 out");
}

}  // namespace ewa::cli
