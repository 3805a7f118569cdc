// SPDX-License-Identifier: Apache-2.0
#include "capture/sparse_model.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include "core/atomic_file.h"
#include "core/file_reader.h"
#include "core/folders.h"
#include "ewa/error.h"
#include "io/datasets/colmap_lens.h"
#include "scene/lens.h"

namespace ewa::capture {
namespace {

constexpr size_t kMostName = 4096;
constexpr uint64_t kCameraRow = 4 + 4 + 8 + 8, kImageRow = 4 + 7 * 8 + 4 + 1 + 8, kFeatureRow = 3 * 8,
                   kPointRow = 8 + 3 * 8 + 3 + 8 + 8, kTrackRow = 8;

void read_cameras(const std::filesystem::path& file, SparseModel& model) {
    core::FileReader reader(file);
    const auto count = reader.read<uint64_t>("the number of cameras");
    reader.require_room(count, kCameraRow, "cameras");
    for (uint64_t i = 0; i < count; ++i) {
        SparseCamera& camera = model.cameras[reader.read<uint32_t>("a camera")];
        camera.lens = reader.read<int32_t>("a camera");
        camera.width = reader.read<uint64_t>("a camera");
        camera.height = reader.read<uint64_t>("a camera");
        const io::ColmapLens* lens = io::colmap_lens(int64_t(camera.lens));
        if (!lens) reader.fail("a camera has an unknown lens");
        camera.parameters.resize(lens->parameters());
        for (double& parameter : camera.parameters) parameter = reader.read<double>("a camera");
    }
}

void read_images(const std::filesystem::path& file, SparseModel& model) {
    core::FileReader reader(file);
    const auto count = reader.read<uint64_t>("the number of images");
    reader.require_room(count, kImageRow, "images");
    for (uint64_t i = 0; i < count; ++i) {
        SparseImage& image = model.images[reader.read<uint32_t>("an image")];
        for (double& value : image.pose) value = reader.read<double>("an image");
        image.camera = reader.read<uint32_t>("an image");
        if (!model.cameras.contains(image.camera)) reader.fail("an image has a camera that is not there");
        image.name = reader.read_zero_terminated(kMostName, "the name of an image");
        const auto features = reader.read<uint64_t>("the number of features");
        reader.require_room(features, kFeatureRow, "features");
        image.features.resize(features);
        for (SparseFeature& feature : image.features) {
            feature.at.x = reader.read<double>("a feature");
            feature.at.y = reader.read<double>("a feature");
            feature.point = reader.read<uint64_t>("a feature");
        }
    }
}

void read_points(const std::filesystem::path& file, SparseModel& model) {
    core::FileReader reader(file);
    const auto count = reader.read<uint64_t>("the number of points");
    reader.require_room(count, kPointRow, "points");
    for (uint64_t i = 0; i < count; ++i) {
        SparsePoint& point = model.points[reader.read<uint64_t>("a point")];
        for (int axis = 0; axis < 3; ++axis) point.position[axis] = reader.read<double>("a point");
        for (uint8_t& channel : point.color) channel = reader.read<uint8_t>("a point");
        point.error = reader.read<double>("a point");
        const auto length = reader.read<uint64_t>("the length of a track");
        reader.require_room(length, kTrackRow, "a track");
        point.track.resize(length);
        for (auto& [image, place] : point.track) {
            image = reader.read<uint32_t>("a track");
            place = reader.read<uint32_t>("a track");
            const auto found = model.images.find(image);
            if (found == model.images.end() || place >= found->second.features.size())
                reader.fail("a track has a feature that is not there");
        }
    }
}

}  // namespace

SparseModel read_sparse(const std::filesystem::path& folder) {
    SparseModel model;
    read_cameras(folder / "cameras.bin", model);
    read_images(folder / "images.bin", model);
    read_points(folder / "points3D.bin", model);
    return model;
}

void write_sparse(const SparseModel& model, const std::filesystem::path& folder) {
    core::make_folder(folder);
    core::BinaryFile cameras(folder / "cameras.bin");
    cameras.add(uint64_t(model.cameras.size()));
    for (const auto& [id, camera] : model.cameras) {
        cameras.add(id, camera.lens, camera.width, camera.height);
        for (const double parameter : camera.parameters) cameras.add(parameter);
    }
    cameras.commit();
    core::BinaryFile images(folder / "images.bin");
    images.add(uint64_t(model.images.size()));
    for (const auto& [id, image] : model.images) {
        images.add(id);
        for (const double value : image.pose) images.add(value);
        images.add(image.camera);
        images.add_text(image.name);
        images.add(uint64_t(image.features.size()));
        for (const SparseFeature& feature : image.features)
            images.add(feature.at.x, feature.at.y, feature.point);
    }
    images.commit();
    core::BinaryFile points(folder / "points3D.bin");
    points.add(uint64_t(model.points.size()));
    for (const auto& [id, point] : model.points) {
        points.add(id, point.position.x, point.position.y, point.position.z, point.color[0], point.color[1],
                   point.color[2], point.error, uint64_t(point.track.size()));
        for (const auto& [image, place] : point.track) points.add(image, place);
    }
    points.commit();
}

Camera camera_of(const SparseModel& model, const SparseImage& image) {
    const SparseCamera& source = model.cameras.at(image.camera);
    const io::ColmapLens& lens = *io::colmap_lens(int64_t(source.lens));
    Camera camera;
    camera.width = int(source.width);
    camera.height = int(source.height);
    camera.distortion.lens = lens.lens;
    if (lens.focal_lengths > 0) {
        camera.fx = source.parameters[0];
        camera.fy = source.parameters[lens.focal_lengths - 1];
        camera.cx = source.parameters[lens.focal_lengths];
        camera.cy = source.parameters[lens.focal_lengths + 1];
    }
    for (size_t i = lens.focal_lengths + 2; i < source.parameters.size(); ++i)
        camera.distortion.*lens.terms[i - lens.focal_lengths - 2] = source.parameters[i];
    const std::array<double, 7>& pose = image.pose;
    camera.rotation = glm::mat3_cast(glm::normalize(glm::dquat(pose[0], pose[1], pose[2], pose[3])));
    camera.translation = {pose[4], pose[5], pose[6]};
    return camera;
}

void move(SparseModel& model, double scale, const glm::dmat3& rotation, const glm::dvec3& shift) {
    for (auto& [id, image] : model.images) {
        const Camera camera = camera_of(model, image);
        const glm::dmat3 turned = camera.rotation * glm::transpose(rotation);
        const glm::dvec3 t = -(turned * (scale * (rotation * camera.position()) + shift));
        const glm::dquat q = glm::normalize(glm::quat_cast(turned));
        image.pose = {q.w, q.x, q.y, q.z, t.x, t.y, t.z};
    }
    for (auto& [id, point] : model.points) point.position = scale * (rotation * point.position) + shift;
}

double reprojection_error(const Camera& camera, const glm::dvec3& point, const glm::dvec2& at) {
    const glm::dvec3 seen = camera.rotation * point + camera.translation;
    if (!(seen.z > 0)) return std::numeric_limits<double>::infinity();
    const glm::dvec2 bent = scene::distort(camera.distortion, glm::dvec2(seen.x / seen.z, seen.y / seen.z));
    return glm::length(glm::dvec2(camera.fx * bent.x + camera.cx, camera.fy * bent.y + camera.cy) - at);
}

}  // namespace ewa::capture
