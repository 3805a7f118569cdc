// SPDX-License-Identifier: Apache-2.0
#include "io/datasets/transforms_write.h"

#include <glm/matrix.hpp>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"

namespace ewa::io {

namespace {

using Json = nlohmann::ordered_json;

Json matrix_of(const Camera& camera) {
    glm::dmat3 axes = glm::transpose(camera.rotation);
    axes[1] = -axes[1];
    axes[2] = -axes[2];
    const glm::dvec3 position = camera.position();
    Json rows = Json::array();
    for (int row = 0; row < 3; ++row)
        rows.push_back({axes[0][row], axes[1][row], axes[2][row], position[row]});
    rows.push_back({0.0, 0.0, 0.0, 1.0});
    return rows;
}

}  // namespace

void write_transforms(const std::filesystem::path& path, const TransformsFile& file) {
    Json top = {{"camera_model", "PINHOLE"}};
    for (const auto& [key, text] : file.remarks) top[key] = text;
    if (!file.color_depends_on_view) top["view_dependent"] = false;
    if (!file.points.empty()) top["ply_file_path"] = file.points;
    top["frames"] = Json::array();
    for (const TransformsFrame& frame : file.frames) {
        const Camera& camera = frame.camera;
        Json entry = {{"file_path", frame.image}, {"w", camera.width},
                      {"h", camera.height},       {"fl_x", camera.fx},
                      {"fl_y", camera.fy},        {"cx", camera.cx},
                      {"cy", camera.cy},          {"transform_matrix", matrix_of(camera)}};
        if (!frame.depth.empty()) entry["depth_file_path"] = frame.depth;
        top["frames"].push_back(std::move(entry));
    }
    core::write_text_file(path, top.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

void write_points_ply(const std::filesystem::path& path, const PointCloud& points) {
    std::string text =
        "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(points.positions.size()) +
        "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar "
        "green\nproperty uchar blue\nend_header\n";
    for (size_t i = 0; i < points.positions.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            const float value = float(points.positions[i][axis]);
            text.append(reinterpret_cast<const char*>(&value), sizeof(value));
        }
        for (const uint8_t channel : points.colors[i]) text += char(channel);
    }
    core::write_text_file(path, text);
}

}  // namespace ewa::io
