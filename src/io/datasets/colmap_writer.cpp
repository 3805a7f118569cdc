// SPDX-License-Identifier: Apache-2.0
// Writes binary files of COLMAP.
#include <cmath>
#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/folders.h"
#include "ewa/error.h"
#include "io/datasets/colmap_lens.h"
#include "io/datasets/image_records.h"
#include "scene/native_lens.h"

namespace ewa::io {

namespace {

/// The position in colmap_lenses() of the first lens model that has all of the distortion's terms, and not one focal length; empty: none has.
std::optional<int32_t> lens_with(const Distortion& distortion) {
    const std::span<const ColmapLens> lenses = colmap_lenses();
    for (size_t i = 0; i < lenses.size(); ++i) {
        const ColmapLens& lens = lenses[i];
        if (lens.focal_lengths == 1 || lens.lens != distortion.lens) continue;
        Distortion kept;
        kept.lens = lens.lens;
        for (const auto term : lens.terms)
            if (term) kept.*term = distortion.*term;
        if (kept == distortion) return int32_t(i);
    }
    return std::nullopt;
}

bool same_lens(const ImageRecord& a, const ImageRecord& b) {
    const Camera &x = a.camera, &y = b.camera;
    return x.width == y.width && x.height == y.height && x.fx == y.fx && x.fy == y.fy && x.cx == y.cx &&
           x.cy == y.cy && a.distortion == b.distortion;
}

void write_camera(core::BinaryFile& file, uint32_t id, const ImageRecord& image) {
    const Camera& c = image.camera;
    const std::optional<int32_t> lens = lens_with(image.distortion);
    if (!lens) throw RunError("COLMAP has no lens model with these distortion terms");
    file.add(id, *lens, uint64_t(c.width), uint64_t(c.height));
    const ColmapLens& model = colmap_lenses()[size_t(*lens)];
    if (model.focal_lengths == 0) return file.add(double(c.width), double(c.height));
    file.add(c.fx, c.fy, c.cx, c.cy);
    for (const auto term : model.terms)
        if (term) file.add(image.distortion.*term);
}

}  // namespace

bool fits_colmap(const ImageRecord& image) {
    if (image.distortion.lens != Lens::equirectangular) return lens_with(image.distortion).has_value();
    Camera whole = image.camera;
    scene::set_equirectangular(whole);
    constexpr double kSame = 1e-9;  // of the focal length
    return std::abs(whole.fx - image.camera.fx) < kSame * whole.fx &&
           std::abs(whole.fy - image.camera.fy) < kSame * whole.fy;
}

void write_colmap(const std::filesystem::path& model, const std::vector<ImageRecord>& images,
                  const PointCloud& points) {
    core::make_folder(model);
    // Neighbours with the same lens share a camera.
    std::vector<uint32_t> camera_of;
    std::vector<size_t> first;
    for (size_t i = 0; i < images.size(); ++i) {
        if (i == 0 || !same_lens(images[i - 1], images[i])) first.push_back(i);
        camera_of.push_back(uint32_t(first.size()));
    }
    core::BinaryFile cameras(model / "cameras.bin");
    cameras.add(uint64_t(first.size()));
    for (size_t i = 0; i < first.size(); ++i) write_camera(cameras, uint32_t(i + 1), images[first[i]]);
    cameras.commit();

    core::BinaryFile poses(model / "images.bin");
    poses.add(uint64_t(images.size()));
    for (size_t i = 0; i < images.size(); ++i) {
        const glm::dquat q = glm::quat_cast(images[i].camera.rotation);
        const glm::dvec3& t = images[i].camera.translation;
        poses.add(uint32_t(i + 1), q.w, q.x, q.y, q.z, t.x, t.y, t.z, camera_of[i]);
        poses.add_text(images[i].name);
        poses.add(uint64_t(0));  // observations
    }
    poses.commit();

    core::BinaryFile cloud(model / "points3D.bin");
    cloud.add(uint64_t(points.positions.size()));
    for (size_t i = 0; i < points.positions.size(); ++i) {
        const glm::dvec3& p = points.positions[i];
        const auto& [r, g, b] = points.colors[i];
        cloud.add(uint64_t(i + 1), p.x, p.y, p.z, r, g, b, double(0), uint64_t(0));  // error, track
    }
    cloud.commit();
}

}  // namespace ewa::io
