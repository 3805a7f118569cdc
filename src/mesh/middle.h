// SPDX-License-Identifier: Apache-2.0
// The middle of a scene by its cameras.
#pragma once
#include <span>

#include "ewa/camera.h"
#include "mesh/depth_map.h"
#include "mesh/space.h"

namespace ewa::mesh {

/// The side of a usual voxel in pixels. One pixel gives four times as many triangles, which are no nearer to the surface.
inline constexpr double kVoxelPixels = 2;

/// The space of a scene with a background. The middle is the point nearest to the axes of all cameras, in the least-squares sense. If
/// the axes are almost parallel, it is at the median depth. The radius is the median distance of the cameras from it. The radius
/// grows until a tenth of the pixels show surfaces within it. Views without surfaces are skipped. cameras: pinholes.
Space space_of_views(std::span<const Camera> cameras, const DepthOfView& depth);

/// kVoxelPixels times the side of a pixel on the surfaces within the radius, world units: the median over the pixels of all views. 0 if no
/// view shows a surface. cameras: pinholes.
double usual_voxel(std::span<const Camera> cameras, const DepthOfView& depth, const Space& space = {});

}  // namespace ewa::mesh
