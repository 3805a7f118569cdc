// SPDX-License-Identifier: Apache-2.0
#include "mesh/colors.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>
#include <vector>

#include "core/parallel.h"
#include "mesh/depth_map.h"
#include "scene/depth_map.h"

namespace ewa::mesh {
namespace {

glm::vec3 color_at(const Image& picture, const glm::vec2& at) {
    const float x = std::clamp(at.x - 0.5f, 0.0f, float(picture.width - 1));
    const float y = std::clamp(at.y - 0.5f, 0.0f, float(picture.height - 1));
    const int left = int(x), top = int(y);
    const int right = std::min(left + 1, picture.width - 1), bottom = std::min(top + 1, picture.height - 1);
    const float u = x - float(left), v = y - float(top);
    glm::vec3 color(0);
    for (int c = 0; c < 3; ++c)
        color[c] = (1 - v) * ((1 - u) * picture.at(left, top)[c] + u * picture.at(right, top)[c]) +
                   v * ((1 - u) * picture.at(left, bottom)[c] + u * picture.at(right, bottom)[c]);
    return color;
}

/// Gives vertices without a colour the mean of those of their neighbours, ring by ring.
void spread(const scene::TriangleMesh& mesh, std::vector<glm::vec4>& sums) {
    for (bool changed = true; changed;) {
        changed = false;
        std::vector<glm::vec4> found(sums.size(), glm::vec4(0));
        for (const auto& t : mesh.triangles)
            for (const uint32_t to : t)
                for (const uint32_t from : t)
                    if (sums[to].w == 0 && sums[from].w > 0) found[to] += sums[from] / sums[from].w;
        for (size_t i = 0; i < sums.size(); ++i)
            if (found[i].w > 0) {
                sums[i] = found[i];
                changed = true;
            }
    }
}

}  // namespace

void set_colors(scene::TriangleMesh& mesh, std::span<const Camera> cameras, const DepthOfView& depth,
                const std::function<Image(size_t)>& picture,
                const std::function<double(const glm::dvec3&)>& within,
                const std::function<void(size_t)>& done) {
    constexpr size_t kTogether = 4096;
    std::vector<glm::vec4> sums(mesh.positions.size(), glm::vec4(0));  // weight in w
    const size_t groups = (sums.size() + kTogether - 1) / kTogether;
    for (size_t view = 0; view < cameras.size(); ++view) {
        const Camera& camera = cameras[view];
        const Image& seen = depth(view);
        const Image colors = picture(view);
        const glm::dvec3 eye = camera.position();
        core::on_all_cores(groups, [&](size_t group) {
            for (size_t i = group * kTogether; i < std::min(sums.size(), (group + 1) * kTogether); ++i) {
                const glm::dvec3 world = mesh.origin + glm::dvec3(mesh.positions[i]);
                const glm::dvec3 p = camera.rotation * world + camera.translation;
                if (!(p.z > 0)) continue;
                const glm::vec2 at(pixel_of(camera, p));
                const double most = within(world), d = double(depth_at(seen, at, float(most)));
                if (!(d > 0) || std::abs(d - p.z) > most) continue;
                const double cosine = glm::dot(glm::dvec3(mesh.normals[i]), glm::normalize(eye - world));
                if (cosine > 0) sums[i] += float(cosine * cosine) * glm::vec4(color_at(colors, at), 1);
            }
        });
        if (done) done(view + 1);
    }
    spread(mesh, sums);
    mesh.colors.clear();
    for (const glm::vec4& sum : sums) {
        auto& color = mesh.colors.emplace_back();
        for (int c = 0; c < 3; ++c)
            color[size_t(c)] = sum.w > 0 ? uint8_t(std::clamp(sum[c] / sum.w, 0.0f, 1.0f) * 255 + 0.5f) : 128;
    }
}

}  // namespace ewa::mesh
