// SPDX-License-Identifier: Apache-2.0
// One surface from the depth of many views (Curless and Levoy 1996).
//
// A voxel at depth z of a view that shows depth d there gets v = clamp((d - z) / truncation, -1, 1), unless z - d > truncation:
// then it is behind the surface, and the view says nothing. Its value is the mean over the views. The surface is where the
// values cross 0, in cells whose eight corners all have a value. Memory is proportional to the area of the surfaces.
#pragma once
#include <functional>
#include <span>

#include "ewa/camera.h"
#include "ewa/image.h"
#include "scene/triangle_mesh.h"

namespace ewa::mesh {

/// The truncation in voxels: wider than the depths of neighbouring views disagree, narrower than most things are thick.
inline constexpr double kTruncation = 4;
/// A pixel that covers more voxels than this from side to side is too coarse to say where the surface is.
inline constexpr double kCoarsestPixel = 2;
/// The side of a usual voxel in pixels. One pixel gives four times as many triangles, which are no nearer to the surface.
inline constexpr double kVoxelPixels = 2;

/// The depth of view i: one channel, view z, 0 where no surface is. It is asked for several times.
using DepthOfView = std::function<const Image&(size_t)>;

struct FusionOptions {
    double voxel = 0;         // world units; 0: usual_voxel
    uint64_t most_bytes = 0;  // of the volume; 0: no limit
};

struct Fused {
    scene::TriangleMesh mesh;  // without colours
    double voxel = 0;
    size_t blocks = 0;
};

/// kVoxelPixels times the side of a pixel on the surfaces, world units: the median over all pixels of all views. 0 if no view shows a
/// surface. cameras: pinholes.
double usual_voxel(std::span<const Camera> cameras, const DepthOfView& depth);

/// cameras: pinholes, one a view. done(steps): is called after each of 2 steps a view. Throws InputError where the voxels are too small
/// for the scene or for most_bytes, or no view shows a surface.
Fused fuse(std::span<const Camera> cameras, const DepthOfView& depth, const FusionOptions& options,
           const std::function<void(size_t)>& done = {});

}  // namespace ewa::mesh
