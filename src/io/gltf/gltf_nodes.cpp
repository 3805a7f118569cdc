// SPDX-License-Identifier: Apache-2.0
#include "io/gltf/gltf_nodes.h"

#include <glm/gtc/quaternion.hpp>

namespace ewa::io {

namespace {

const std::vector<int>& roots(const GltfDocument& document) {
    const tinygltf::Model& model = document.model();
    if (model.scenes.empty()) document.fail("there is no \"scenes\", so nothing is placed in the world");
    const int index = std::max(model.defaultScene, 0);
    if (size_t(index) >= model.scenes.size())
        document.fail("\"scene\" is " + std::to_string(index) + ", and there is none of this number");
    return model.scenes[size_t(index)].nodes;
}

glm::dmat4 local(const GltfDocument& document, const tinygltf::Node& node, int index) {
    const auto size = [&](const std::vector<double>& values, size_t n, const char* property) {
        if (!values.empty() && values.size() != n)
            document.fail("node " + std::to_string(index) + ": \"" + property + "\" has not " +
                          std::to_string(n) + " numbers");
        return !values.empty();
    };
    glm::dmat4 matrix(1.0);
    if (size(node.matrix, 16, "matrix")) {
        for (int i = 0; i < 16; ++i) matrix[i / 4][i % 4] = node.matrix[size_t(i)];
        return matrix;
    }
    if (size(node.rotation, 4, "rotation")) {
        const glm::dquat q(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]);
        if (!(glm::length(q) > 0)) document.fail("node " + std::to_string(index) + ": \"rotation\" is zero");
        matrix = glm::mat4_cast(glm::normalize(q));
    }
    if (size(node.scale, 3, "scale"))
        for (int i = 0; i < 3; ++i) matrix[i] *= node.scale[size_t(i)];
    if (size(node.translation, 3, "translation"))
        for (int i = 0; i < 3; ++i) matrix[3][i] = node.translation[size_t(i)];
    return matrix;
}

}  // namespace

void visit_nodes(const GltfDocument& document, const glm::dmat4& world,
                 const std::function<void(int, const glm::dmat4&)>& visit) {
    const std::vector<tinygltf::Node>& nodes = document.model().nodes;
    std::vector<bool> visited(nodes.size());
    std::vector<std::pair<int, glm::dmat4>> open;
    const std::vector<int>& first = roots(document);
    for (size_t i = first.size(); i-- > 0;) open.emplace_back(first[i], world);
    while (!open.empty()) {
        const auto [index, parent] = open.back();
        open.pop_back();
        if (index < 0 || size_t(index) >= nodes.size())
            document.fail("node " + std::to_string(index) + ": there is none of this number");
        if (visited[size_t(index)])
            document.fail("node " + std::to_string(index) + " has two parents or is its own ancestor");
        visited[size_t(index)] = true;
        const tinygltf::Node& node = nodes[size_t(index)];
        const glm::dmat4 matrix = parent * local(document, node, index);
        visit(index, matrix);
        for (size_t i = node.children.size(); i-- > 0;) open.emplace_back(node.children[i], matrix);
    }
}

}  // namespace ewa::io
