// SPDX-License-Identifier: Apache-2.0
// The first view of a scene.
#pragma once
#include "ewa/dataset.h"
#include "ewa/gaussians.h"
#include "viewer/view_camera.h"

namespace ewa::viewer {

/// The box between the 5th and the 95th percentile of each coordinate, which excludes the few distant splats
/// of most trainings. Means that are not finite are skipped.
struct SceneBounds {
    glm::dvec3 center{0};
    double radius = 1;  // half the box's diagonal, above zero
};
SceneBounds scene_bounds(const Gaussians& gaussians);

/// Shows the whole scene from the front and slightly above, with y down, as in most COLMAP captures.
Viewpoint framing_view(const Gaussians& gaussians, int width, int height);

/// The frame whose camera is closest in position and direction; -1 without frames. A turn of 90 degrees
/// counts as much as a distance of `radius` (world units).
int nearest_frame(const Dataset& dataset, const Camera& camera, double radius);

/// The size of drawn cameras in world units, above zero: a share of the median distance between neighbours in
/// name order, or of the scene's radius if all are in one place.
double camera_size(const Dataset& dataset, double radius);

/// The camera of a frame. Up is the mean up direction of all cameras; the pivot is at the median depth of the
/// splats in the middle of the image.
Viewpoint dataset_view(const Gaussians& gaussians, const Dataset& dataset, int frame);

}  // namespace ewa::viewer
