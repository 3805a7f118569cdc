// SPDX-License-Identifier: Apache-2.0
#include "core/file_reader.h"
#include "core/text.h"
#include "io/datasets/colmap_model.h"

namespace ewa::io {

namespace {

constexpr size_t kMaxName = 4096;
// The bytes of the shortest entry of each list, and of each item that an entry counts.
constexpr uint64_t kCameraBytes = 4 + 4 + 8 + 8 + 3 * 8, kImageBytes = 4 + 7 * 8 + 4 + 1 + 8;
constexpr uint64_t kPointBytes = 8 + 3 * 8 + 3 + 8 + 8, kObservationBytes = 3 * 8, kTrackBytes = 2 * 4;

uint64_t read_count(core::FileReader& reader, uint64_t bytes_each, const char* what) {
    const auto count = reader.read<uint64_t>(what);
    reader.require_room(count, bytes_each, what);
    return count;
}

void read_cameras(const std::filesystem::path& path, ColmapBuilder& builder) {
    core::FileReader reader(path);
    const Fail fail = [&](const std::string& text) { reader.fail(text); };
    const uint64_t count = read_count(reader, kCameraBytes, "cameras");
    for (uint64_t i = 0; i < count; ++i) {
        const auto id = reader.read<uint32_t>("a camera");
        const auto lens_id = reader.read<int32_t>("a camera");
        const auto width = reader.read<uint64_t>("a camera"), height = reader.read<uint64_t>("a camera");
        const ColmapLens* lens = colmap_lens(int64_t(lens_id));
        if (!lens)
            reader.fail("camera " + std::to_string(id) + " has the unknown lens model number " +
                        std::to_string(lens_id) +
                        "; undistort the images with `colmap image_undistorter` and use its output");
        std::vector<double> parameters(lens->parameters());
        for (double& parameter : parameters) parameter = reader.read<double>("a camera");
        builder.add_camera(id, *lens, width, height, parameters, fail);
    }
}

void read_images(const std::filesystem::path& path, ColmapBuilder& builder) {
    core::FileReader reader(path);
    const Fail fail = [&](const std::string& text) { reader.fail(text); };
    const uint64_t count = read_count(reader, kImageBytes, "images");
    for (uint64_t i = 0; i < count; ++i) {
        reader.skip(sizeof(uint32_t), "an image");  // its id, which nothing refers to that is read here
        std::array<double, 7> pose;
        for (double& value : pose) value = reader.read<double>("an image");
        const auto camera_id = reader.read<uint32_t>("an image");
        const std::string name = reader.read_zero_terminated(kMaxName, "the name of an image");
        builder.add_image(pose, camera_id, name, fail);
        const uint64_t observations = read_count(reader, kObservationBytes, "observations");
        reader.skip(observations * kObservationBytes, "observations");
    }
}

void read_points(const std::filesystem::path& path, ColmapBuilder& builder) {
    core::FileReader reader(path);
    const uint64_t count = read_count(reader, kPointBytes, "points");
    for (uint64_t i = 0; i < count; ++i) {
        const uint64_t begin = reader.offset();
        reader.skip(sizeof(uint64_t), "a point");  // its id
        glm::dvec3 position;
        for (int axis = 0; axis < 3; ++axis) position[axis] = reader.read<double>("a point");
        std::array<uint8_t, 3> color;
        for (uint8_t& channel : color) channel = reader.read<uint8_t>("a point");
        reader.skip(sizeof(double), "a point");  // its reprojection error
        const uint64_t track = read_count(reader, kTrackBytes, "entries of a track");
        reader.skip(track * kTrackBytes, "a track");
        builder.add_point(position, color, [&] {
            return core::one_line(path.string()) + ": the point at byte " + std::to_string(begin);
        });
    }
}

}  // namespace

void read_colmap_binary(const std::filesystem::path& model, ColmapBuilder& builder) {
    read_cameras(model / "cameras.bin", builder);
    read_images(model / "images.bin", builder);
    if (std::filesystem::exists(model / "points3D.bin")) read_points(model / "points3D.bin", builder);
}

}  // namespace ewa::io
