// SPDX-License-Identifier: Apache-2.0
#include "io/datasets/image_records.h"

#include <algorithm>
#include <cmath>
#include <glm/trigonometric.hpp>
#include <numbers>

#include "core/atomic_file.h"
#include "core/file_reader.h"
#include "core/text.h"
#include "ewa/error.h"
#include "io/splats/ply_table.h"
#include "scene/native_lens.h"
#include "scene/thin_points.h"

namespace ewa::io {

void set_sphere(Camera& camera, const std::string& where) {
    constexpr int kRounding = 2;  // px of the width
    scene::set_equirectangular(camera);
    const int more = 2 * camera.height - camera.width;
    if (more > kRounding)
        throw InputError(core::one_line(
            where + ": a 360 degree image of " + std::to_string(camera.width) + " x " +
            std::to_string(camera.height) +
            " pixels is higher than half its width; stretch the images to 2:1, or cut a second eye off"));
    if (more < -kRounding) camera.fy = camera.fx;
}

void note_partial_spheres(ImageRecords& records) {
    const auto partial = [](const ImageRecord& image) {
        const Camera& c = image.camera;
        return image.distortion.lens == Lens::equirectangular && c.height < 0.999 * std::numbers::pi * c.fy;
    };
    const auto first = std::ranges::find_if(records.images, partial);
    if (first == records.images.end()) return;
    records.notes.push_back(
        "360 degree images of " + std::to_string(first->camera.width) + " x " +
        std::to_string(first->camera.height) +
        " pixels are taken to show the whole circle along their width, and " +
        std::to_string(std::lround(glm::degrees(first->camera.height / first->camera.fy))) +
        " degrees upright");
}

namespace {

/// Else counts it as dropped.
bool is_finite_point(DroppedPoints& dropped, const glm::dvec3& position,
                     const std::function<std::string()>& where) {
    for (int axis = 0; axis < 3; ++axis)
        if (!std::isfinite(static_cast<float>(position[axis]))) {
            if (dropped.count++ == 0) dropped.first = where();
            return false;
        }
    return true;
}

}  // namespace

bool add_point(PointCloud& points, DroppedPoints& dropped, const glm::dvec3& position,
               const std::array<uint8_t, 3>& color, const std::function<std::string()>& where) {
    if (!is_finite_point(dropped, position, where)) return false;
    points.positions.push_back(position);
    points.colors.push_back(color);
    return true;
}

bool is_point_cloud(const std::filesystem::path& path) {
    {
        core::FileReader reader(path);
        constexpr std::string_view kMagic = "ply";
        if (reader.size() < kMagic.size()) return false;
        const auto* head = reinterpret_cast<const char*>(reader.take(kMagic.size(), "the header"));
        if (std::string_view(head, kMagic.size()) != kMagic) return false;
    }
    PlyTable table(path);
    const PlyElement* vertex = nullptr;
    for (const PlyElement& element : table.elements()) {
        // Compressed splats have chunks. Faces make a mesh.
        if (element.name == "chunk" ||
            ((element.name == "face" || element.name == "tristrips") && element.count > 0))
            return false;
        if (element.name == "vertex") vertex = &element;
    }
    return vertex && vertex->find_number("x") && vertex->find_number("y") && vertex->find_number("z") &&
           !vertex->find("opacity") && !vertex->find("f_dc_0") && !vertex->find("scale_0");
}

PlyPoints read_points_ply(const std::filesystem::path& path, size_t most) {
    PlyTable table(path);
    const PlyElement& vertex = table.go_to("vertex");
    std::vector<size_t> columns;
    for (const char* name : {"x", "y", "z"}) {
        const std::optional<size_t> found = vertex.find_number(name);
        if (!found) throw InputError(table.name() + ": the vertices have no number \"" + name + "\"");
        columns.push_back(*found);
    }
    const std::optional<PlyColors> colors = find_colors(path, vertex);
    if (colors) columns.insert(columns.end(), colors->columns.begin(), colors->columns.end());
    const double color_scale = colors ? 255 / colors->full : 1;

    PlyPoints result;
    scene::PointThinner thinner(most);
    table.read(columns, [&](size_t index, const double* row) {
        const auto byte = [&](double v) -> uint8_t {
            return v > 0 ? static_cast<uint8_t>(std::lround(std::min(v * color_scale, 255.0))) : uint8_t(0);
        };
        std::array<uint8_t, 3> color{128, 128, 128};
        if (colors) color = {byte(row[3]), byte(row[4]), byte(row[5])};
        const glm::dvec3 position(row[0], row[1], row[2]);
        const auto where = [&] {
            return core::one_line(path.string()) + ": vertex " + std::to_string(index);
        };
        if (!is_finite_point(result.dropped, position, where)) return;
        thinner.add(position, color);
        ++result.found;
    });
    result.points = thinner.take();
    return result;
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
