// SPDX-License-Identifier: Apache-2.0
// Textures of mesh scenes.
#pragma once
#include <vector>

#include "ewa/image.h"
#include "scene/mesh_scene.h"

namespace ewa::pathtracer {

/// The decoded images of the scene's textures: PNG and JPEG, as in glTF, of at most 8192 x 8192 pixels.
/// Throws InputError that names the image.
std::vector<Image> decode_images(const scene::MeshScene& scene);

}  // namespace ewa::pathtracer
