// SPDX-License-Identifier: Apache-2.0
// One scene for the tests of the importers. Each test writes it as its format's description says, and states where the format puts
// the scene's points.
#pragma once
#include <cmath>
#include <functional>
#include <glm/gtc/quaternion.hpp>
#include <string>
#include <vector>

#include "ewa/dataset.h"
#include "scene/lens.h"
#include "scene/native_lens.h"
#include "support/temp_folder.h"

namespace ewa::test {

/// A camera of the scene. Its rotation goes from the world to the camera (x right, y down, z forward).
struct SceneView {
    std::string name;
    glm::dmat3 rotation;
    glm::dvec3 center;

    glm::dvec3 seen(const glm::dvec3& point) const { return rotation * (point - center); }
    glm::dvec3 translation() const { return -(rotation * center); }
};

inline constexpr int kSceneWidth = 48, kSceneHeight = 22;

/// No axis, no angle and no coordinate of a view occurs twice.
inline std::vector<SceneView> scene_views() {
    const auto turned = [](double x, double y, double z) { return glm::mat3_cast(glm::dquat({x, y, z})); };
    return {{"b 1.png", turned(0.31, -0.22, 0.13), {0.4, -0.7, -3.1}},
            {"a2.png", turned(-0.17, 0.41, -0.29), {-1.2, 0.3, -2.6}},
            {"c.png", turned(0.23, 0.12, 2.5), {0.6, 0.9, -3.7}}};
}

inline std::vector<glm::dvec3> scene_points() {
    return {{0.11, 0.23, 0.37}, {-0.41, 0.19, -0.29}, {0.53, -0.31, 0.17}, {-0.13, -0.47, 0.59}};
}

/// Images of the scene's size, under the views' names.
inline void write_scene_images(const TempFolder& folder, const std::string& inside = "images") {
    std::filesystem::create_directories(folder / inside);
    for (const SceneView& view : scene_views())
        save_image(folder / inside / view.name, Image(kSceneWidth, kSceneHeight, 3));
}

/// Where ewa puts the point in the frame's file; it must be in front of the camera.
inline glm::dvec2 pixel_in(const Frame& frame, const glm::dvec3& point) {
    const Camera& camera = frame.source;
    const glm::dvec3 seen = camera.rotation * point + camera.translation;
    if (!frame.camera.distortion.none()) {
        const auto pixel = scene::pixel_of(frame.camera, scene::lens_limit(frame.camera), seen);
        return pixel ? *pixel : glm::dvec2(NAN);
    }
    const glm::dvec2 plane = scene::distort(frame.distortion, glm::dvec2(seen) / seen.z);
    return {camera.fx * plane.x + camera.cx, camera.fy * plane.y + camera.cy};
}

/// The dataset has the scene's views, and each puts the scene's points where `pixel` does. pixel gets a point in the camera's axes.
inline void expect_scene(const Dataset& dataset, const std::function<glm::dvec2(const glm::dvec3&)>& pixel,
                         double tolerance = 1e-9) {
    ASSERT_EQ(dataset.frames.size(), scene_views().size());
    for (const SceneView& view : scene_views()) {
        SCOPED_TRACE(view.name);
        const auto frame = std::find_if(dataset.frames.begin(), dataset.frames.end(), [&](const Frame& f) {
            return std::filesystem::path(f.name).filename() == view.name;
        });
        ASSERT_NE(frame, dataset.frames.end());
        EXPECT_TRUE(frame->image_exists);
        EXPECT_EQ(frame->source.width, kSceneWidth);
        EXPECT_EQ(frame->source.height, kSceneHeight);
        for (const glm::dvec3& point : scene_points()) {
            const glm::dvec2 expected = pixel(view.seen(point)), found = pixel_in(*frame, point);
            EXPECT_NEAR(found.x, expected.x, tolerance);
            EXPECT_NEAR(found.y, expected.y, tolerance);
        }
    }
}

/// x and y over z.
inline glm::dvec2 tangents(const glm::dvec3& p) {
    return glm::dvec2(p) / p.z;
}

/// The angle from the axis, in the direction of x and y.
inline glm::dvec2 angles(const glm::dvec3& p) {
    const double r = std::hypot(p.x, p.y);
    return r > 0 ? std::atan2(r, p.z) / r * glm::dvec2(p) : glm::dvec2(0);
}

}  // namespace ewa::test
