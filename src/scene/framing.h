// SPDX-License-Identifier: Apache-2.0
// Cameras for a view of a whole splat scene, for scenes without cameras. World units; cameras in the OpenCV convention.
#pragma once
#include <glm/vec3.hpp>
#include <optional>

#include "ewa/camera.h"
#include "ewa/dataset.h"
#include "ewa/gaussians.h"
#include "scene/mesh_scene.h"

namespace ewa::scene {

struct Framing {
    Camera camera;
    glm::dvec3 target{0};     // world; the middle of the framed box, which the camera looks at
    glm::dvec3 up{0, -1, 0};  // world, unit length
    double radius = 1;        // half the diagonal of the framed box, above zero
};

/// Facts about a scene besides its splats. Directions are in the world, of any length above zero.
struct FramingHints {
    std::optional<glm::dvec3> up;       // empty: guessed_up
    std::optional<glm::dvec3> forward;  // of the view, made horizontal; empty: see frame_scene
    bool all_round = false;             // the scene fits from every side, not only from the front
};

/// The box with the whole scene but without its floaters. Splats below an opacity of 0.1 and values that are not
/// finite do not count, unless there are no others.
/// - A splat whose mean is far outside the 5th to 95th percentile of a coordinate is a floater: by more than
///   0.6 times their distance.
/// - If floaters are more than 3 % on an axis, the scene has no edge there: the box ends at the percentiles.
/// - Else it ends where 0.2 % of the other splats, each with one standard deviation, are cut.
/// Empty (low above high) without splats.
Box framed_box(const Gaussians& gaussians);

/// The up direction, one of -y, +z and +y. It is -y, that of most COLMAP captures, unless the scene has a ground
/// that says otherwise: splats all over the box's face at low z or low y, and few at the opposite face.
glm::dvec3 guessed_up(const Gaussians& gaussians);

/// The mean up direction of the cameras; -y if they have all orientations.
glm::dvec3 mean_up(const Dataset& dataset);

/// Shows the whole framed box from the front and slightly above. Without FramingHints::forward, the view is along the horizontal
/// direction in which the scene is thinnest. The shorter side of the image has a field of view of 50 degrees. width, height: px,
/// above zero.
Framing frame_scene(const Gaussians& gaussians, int width, int height, const FramingHints& hints = {});

/// A camera at `eye` that looks at `target` with `up` towards the top of the image. If the view is along `up`,
/// another axis replaces it. The field of view is that of frame_scene. eye and target must differ.
Camera look_at(const glm::dvec3& eye, const glm::dvec3& target, const glm::dvec3& up, int width, int height);

/// The camera itself if it is a pinhole. Otherwise, a pinhole camera with the same position and rotation, and with the field of
/// view of frame_scene.
Camera pinhole_at(const Camera& camera);

/// The camera turned about the axis `up` (unit length) through `target` by `angle` radians, counterclockwise as
/// seen from above. The target keeps its pixel.
Camera orbited(const Camera& camera, const glm::dvec3& target, const glm::dvec3& up, double angle);

/// The camera for an image of another size (px, above zero). The view of `camera` stays visible and centred; pixels
/// stay square. The same size returns the same camera, bit for bit.
Camera fitted(const Camera& camera, int width, int height);

}  // namespace ewa::scene
