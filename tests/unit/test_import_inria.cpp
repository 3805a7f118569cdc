// SPDX-License-Identifier: Apache-2.0
// cameras.json of INRIA's trainer.
#include <nlohmann/json.hpp>

#include "support/import_scene.h"

namespace {

using namespace ewa;
using namespace ewa::test;
using nlohmann::json;

json inria_cameras() {
    json list = json::array();
    for (const SceneView& view : scene_views()) {
        const glm::dmat3 axes = glm::transpose(view.rotation);
        json rows = json::array();
        for (int r = 0; r < 3; ++r) rows.push_back({axes[0][r], axes[1][r], axes[2][r]});
        list.push_back({{"id", list.size()},
                        {"img_name", std::filesystem::path(view.name).stem().string()},
                        {"width", kSceneWidth},
                        {"height", kSceneHeight},
                        {"position", {view.center.x, view.center.y, view.center.z}},
                        {"rotation", rows},
                        {"fy", 43.25},
                        {"fx", 44.5}});
    }
    return list;
}

TEST(ImportInria, PutsPointsWhereTheyAre) {
    const TempFolder folder;
    write_scene_images(folder);
    folder.write("cameras.json", inria_cameras().dump());
    const Dataset dataset = load_dataset(folder.path(), {});
    EXPECT_EQ(dataset.format, "INRIA's cameras.json");
    expect_scene(dataset, [](const glm::dvec3& p) {
        return glm::dvec2(44.5 * p.x / p.z + kSceneWidth / 2.0, 43.25 * p.y / p.z + kSceneHeight / 2.0);
    });
}

TEST(ImportInria, ErrorsNameTheCamera) {
    const TempFolder folder;
    write_scene_images(folder);
    const auto refuse = [&](const std::string& text, const auto& damage) {
        json cameras = inria_cameras();
        damage(cameras[1]);
        folder.write("cameras.json", cameras.dump());
        try {
            load_dataset(folder.path(), {});
            FAIL() << text;
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find("camera 1"), std::string::npos) << error.what();
            EXPECT_NE(std::string(error.what()).find(text), std::string::npos) << error.what();
        }
    };
    refuse("img_name", [](json& c) { c.erase("img_name"); });
    refuse("width", [](json& c) { c["width"] = 0; });
    refuse("focal", [](json& c) { c["fx"] = -1; });
    refuse("rotation", [](json& c) { c["rotation"] = {1, 2, 3}; });
    refuse("rotation", [](json& c) { c["rotation"] = {{1, 0, 0}, {0, 1, 0}, {0, 0, -1}}; });
    refuse("position", [](json& c) { c["position"] = {1, 2}; });
}

}  // namespace
