// SPDX-License-Identifier: Apache-2.0
// The tree of nodes that a glTF's scene places in the world.
#pragma once
#include <functional>
#include <glm/mat4x4.hpp>

#include "io/gltf/gltf_document.h"

namespace ewa::io {

/// Calls visit(node's index, its matrix to the world) for every node of the file's default scene (else the
/// first), parents before children, siblings in order; the world is glTF's turned by `world`. Throws
/// InputError that names the node and its property, also where there is no scene or a node is met twice.
void visit_nodes(const GltfDocument& document, const glm::dmat4& world,
                 const std::function<void(int, const glm::dmat4&)>& visit);

}  // namespace ewa::io
