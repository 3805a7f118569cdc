// SPDX-License-Identifier: Apache-2.0
// One surface from the depth of many views (Curless and Levoy 1996).
//
// A voxel at depth z of a view that shows depth d there gets v = clamp((d - z) / truncation, -1, 1), unless z - d > truncation:
// then it is behind the surface, and the view says nothing. Its value is the mean over the views. The surface is where the
// values cross 0, in cells whose eight corners all have a value. Memory is proportional to the area of the surfaces.
//
// Where space is contracted, voxels and distances along rays are those of the contracted space (2DGS, Huang et al. 2024).
#pragma once
#include <functional>
#include <span>

#include "ewa/camera.h"
#include "mesh/depth_map.h"
#include "mesh/space.h"
#include "scene/triangle_mesh.h"

namespace ewa::mesh {

/// The truncation in voxels. It is larger than differences in depth between neighbouring views, and smaller than most objects.
inline constexpr double kTruncation = 4;
/// Pixels that cover more voxels than this from side to side are too coarse to locate the surface.
inline constexpr double kCoarsestPixel = 2;

struct FusionOptions {
    double voxel = 0;           // world units, in the middle; 0: usual_voxel
    double coarser = 1;         // times usual_voxel
    bool unbounded = false;     // surfaces far from the middle get larger voxels: space_of_views
    bool closed = false;        // a surface has a back within the truncation, where no view sees it
    double least_part = 0;      // voxels; parts whose box has a smaller diagonal are dropped
    size_t most_triangles = 0;  // as simplify has it; 0: all
    uint64_t most_bytes = 0;    // of the volume; 0: no limit
};

struct Fused {
    scene::TriangleMesh mesh;  // without colours
    double voxel = 0;
    Space space;
    size_t blocks = 0;
    /// The longest side of the voxel at a point of the world, world units.
    double voxel_at(const glm::dvec3& world) const { return voxel * space.outward_growth(world); }
};

/// cameras: pinholes, one a view. done(steps): is called after each of 2 steps a view. Throws InputError where the voxels are too small
/// for the scene or for most_bytes, or no view shows a surface.
Fused fuse(std::span<const Camera> cameras, const DepthOfView& depth, const FusionOptions& options,
           const std::function<void(size_t)>& done = {});

}  // namespace ewa::mesh
