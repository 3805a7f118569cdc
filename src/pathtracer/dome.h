// SPDX-License-Identifier: Apache-2.0
// Cameras for a scene that brings none.
#pragma once
#include <vector>

#include "ewa/camera.h"
#include "scene/mesh_scene.h"

namespace ewa::pathtracer {

/// `count` pinholes on a dome over the box's centre that look at it, y up, heights above the horizon between
/// 8 and 65 degrees by equal area, turned by the golden angle from one to the next (so every k-th of them
/// covers the dome too). The angle of view is 45 degrees in the smaller direction, and each stands as near as
/// the box's corners all lie in its picture. count, width, height >= 1; a box of no extent is looked at from
/// one unit away.
std::vector<Camera> dome_cameras(const scene::Box& box, int count, int width, int height);

/// The pinhole of a file's camera in a picture of this size: its vertical angle, square pixels.
Camera pinhole_of(const scene::FileCamera& camera, int width, int height);

}  // namespace ewa::pathtracer
