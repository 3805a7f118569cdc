// SPDX-License-Identifier: Apache-2.0
// Where to look from, when a scene opens.
#pragma once
#include "ewa/dataset.h"
#include "ewa/gaussians.h"
#include "viewer/view_camera.h"

namespace ewa::viewer {

/// Where most splats are: the box between the 5th and the 95th percentile of each coordinate, so that the few
/// far ones that every training leaves do not count. Means that are not finite are left out.
struct SceneBounds {
    glm::dvec3 center{0};
    double radius = 1;  // half the box's diagonal, above zero
};
SceneBounds scene_bounds(const Gaussians& gaussians);

/// The whole scene in view, from the front and a little above, with y down as COLMAP has it for most
/// captures.
Viewpoint framing_view(const Gaussians& gaussians, int width, int height);

/// The frame whose camera stands and looks most like this one; -1 without frames. A turn of 90 degrees counts
/// as much as `radius` (world units) between them.
int nearest_frame(const Dataset& dataset, const Camera& camera, double radius);

/// How large to draw the cameras: a share of the median distance from each to the next in name order, and of
/// the scene's radius where they stand in one place. World units, above zero.
double camera_size(const Dataset& dataset, double radius);

/// A frame's own camera. Up is the mean of what is up in the dataset's pictures; the pivot is where most
/// splats in the middle of this one are.
Viewpoint dataset_view(const Gaussians& gaussians, const Dataset& dataset, int frame);

}  // namespace ewa::viewer
