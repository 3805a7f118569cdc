// SPDX-License-Identifier: Apache-2.0
#include "mesh/scene_mesh.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <numbers>
#include <utility>

#include "ewa/error.h"
#include "mesh/colors.h"
#include "mesh/depth_cache.h"
#include "mesh/meshing.h"
#include "mesh/parts.h"
#include "platform/system.h"
#include "scene/framing.h"
#include "scene/splat_shape.h"

namespace ewa::mesh {
namespace {

constexpr int kOwnViews = 64, kOwnViewSide = 512;
/// A part that is smaller than this was seen within the truncation alone.
constexpr double kLeastPart = 4 * kTruncation;  // voxels
/// A collision mesh: its voxels in usual ones, and its triangles unless they have another limit.
constexpr double kCollisionVoxels = 4;
constexpr size_t kCollisionTriangles = 10000;

/// The mean depth where the splats take at least half of the light; elsewhere 0.
Image solid_mean_depth(const Rendering& seen) {
    constexpr float kSolid = 0.5f;
    Image depth = seen.depth;
    for (size_t i = 0; i < depth.pixels.size(); ++i)
        if (!(seen.alpha.pixels[i] >= kSolid)) depth.pixels[i] = 0;
    return depth;
}

/// Half of the machine's memory.
uint64_t memory_for_volume() {
    return platform::installed_memory() / 2;
}

FusionOptions fusion_options(const SceneMeshOptions& asked) {
    FusionOptions options{.voxel = asked.voxel,
                          .unbounded = asked.unbounded,
                          .closed = asked.collision,
                          .least_part = kLeastPart,
                          .most_triangles = asked.triangles,
                          .most_bytes = memory_for_volume()};
    if (asked.collision) {
        options.coarser = kCollisionVoxels;
        if (asked.triangles == 0) options.most_triangles = kCollisionTriangles;
    }
    return options;
}

void place(Fused& fused, const glm::dmat4& placement) {
    if (placement == glm::dmat4(1.0)) return;
    transform_mesh(fused.mesh, placement);
    const double scale = std::cbrt(std::abs(glm::determinant(glm::dmat3(placement))));
    fused.voxel *= scale;
    fused.space.radius *= scale;
}

/// A line where nobody chose voxels that are too large to show the scene; else nothing.
std::string coarse_voxels(const Fused& fused, const SceneMeshOptions& options) {
    constexpr double kFew = 80, kMany = 200;  // voxels from corner to corner
    if (options.voxel > 0 || options.collision) return {};
    glm::vec3 low(fused.mesh.positions.at(0)), high(low);
    for (const glm::vec3& p : fused.mesh.positions) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    const double voxels = double(glm::length(high - low)) / fused.voxel;
    if (voxels >= kFew) return {};
    return fmt::format(
        "voxels of {:.3g}, two pixels of the images, are coarse: the mesh is {:.0f} of them from "
        "corner to corner; --voxel {:.1g} makes it {:.0f}",
        fused.voxel, voxels, voxels * fused.voxel / kMany, kMany);
}

}  // namespace

Pinholes cameras_around(const Gaussians& gaussians) {
    const scene::Framing framing = scene::frame_scene(gaussians, kOwnViewSide, kOwnViewSide);
    const double distance = glm::length(framing.camera.position() - framing.target);
    std::vector<Camera> cameras;
    for (int i = 0; i < kOwnViews; ++i) {  // on Fibonacci's spiral
        const double z = 1 - (2 * i + 1.0) / kOwnViews, turn = i * std::numbers::pi * (3 - std::sqrt(5.0));
        const glm::dvec3 to(std::sqrt(1 - z * z) * std::cos(turn), std::sqrt(1 - z * z) * std::sin(turn), z);
        cameras.push_back(scene::look_at(framing.target + distance * to, framing.target, framing.up,
                                         kOwnViewSide, kOwnViewSide));
    }
    return Pinholes(std::move(cameras));
}

size_t steps_of_mesh(const Pinholes& pinholes, const SceneMeshOptions& options) {
    return (options.collision ? 2 : 3) * pinholes.cameras().size();
}

SceneMesh mesh_of_scene(Renderer& renderer, const Pinholes& pinholes, const SceneMeshOptions& options,
                        const std::function<void(size_t)>& done) {
    scene::check_transform(options.placement);
    meshing();  // says at once that it is missing
    const std::span<const Camera> cameras = pinholes.cameras();
    DepthCache cache(cameras.size(), [&](size_t i) {
        Image seen = options.mean_depth ? solid_mean_depth(renderer.render(cameras[i], Drawing::depth))
                                        : renderer.render(cameras[i], Drawing::median_depth).median_depth;
        pinholes.cut(i, seen);
        return seen;
    });
    const DepthOfView depth = [&](size_t i) -> const Image& { return cache.at(i); };
    const FusionOptions fusion = fusion_options(options);
    SceneMesh made{fuse(cameras, depth, fusion, done), fusion.most_triangles, {}};
    scene::TriangleMesh& mesh = made.fused.mesh;
    if (mesh.triangles.empty())
        throw InputError(fmt::format(
            "no surface is as large as {:g} voxels of {:.3g}; take a smaller --voxel, such as {:.1g}",
            kLeastPart, made.fused.voxel, made.fused.voxel / 8));
    set_normals(mesh);
    if (!options.collision)
        set_colors(
            mesh, cameras, depth, [&](size_t i) { return renderer.render(cameras[i]).color; },
            [&](const glm::dvec3& at) { return kTruncation * made.fused.voxel_at(at); },
            [&](size_t views) { done(2 * cameras.size() + views); });
    made.note = coarse_voxels(made.fused, options);
    place(made.fused, options.placement);
    return made;
}

}  // namespace ewa::mesh
