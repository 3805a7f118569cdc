// SPDX-License-Identifier: Apache-2.0
// The camera of the window: the first view of a scene, and motions by mouse and keys. They turn around a pivot, approach it, or
// fly freely. Independent of the window.
#pragma once
#include <glm/geometric.hpp>

#include "ewa/camera.h"
#include "ewa/dataset.h"
#include "ewa/gaussians.h"
#include "scene/framing.h"

namespace ewa::viewer {

/// A camera, and the point that it orbits.
struct Viewpoint {
    Camera camera;
    glm::dvec3 pivot{0, 0, 1};  // world; the centre of orbiting
    glm::dvec3 up{0, -1, 0};    // world, unit length
    double radius = 1;          // of the scene, world units
};

class ViewCamera {
  public:
    explicit ViewCamera(const Viewpoint& start) : start_(start) { reset(); }

    /// orbit() and look() turn by angles in radians, for a drag to the right and down. The scene follows the pointer.
    void orbit(double right, double down);  // about the pivot
    void look(double right, double down);   // about the camera itself
    /// Moves sideways. right, down: the drag in px of an image of this size. Points at the pivot's distance follow the pointer.
    void pan(double right, double down, int width, int height);
    /// Moves towards the pivot. A step reduces the distance to it by a tenth; negative steps move away.
    void zoom(double steps);
    /// Moves along the camera axes (x right, y down, z forward), in units of the distance to the pivot.
    void fly(const glm::dvec3& amount);
    /// Turns to a point and makes it the pivot.
    void focus(const glm::dvec3& point);
    void reset() { now_ = start_; }
    void restart(const Viewpoint& start) { now_ = start_ = start; }
    void set_up(const glm::dvec3& up) { now_.up = glm::normalize(up); }

    /// Moves to another place. reset() still returns to the start.
    void stand(const Viewpoint& place) { now_ = place; }
    const glm::dvec3& pivot() const { return now_.pivot; }
    const glm::dvec3& up() const { return now_.up; }
    double radius() const { return start_.radius; }
    double distance() const;
    Camera camera(int width, int height) const { return scene::fitted(now_.camera, width, height); }

  private:
    void turn(double yaw, double pitch, const glm::dvec3& center);
    void place(const glm::dmat3& rotation, const glm::dvec3& position);

    Viewpoint start_, now_;
};

/// The box between the 5th and the 95th percentile of each coordinate, which excludes the few distant splats
/// of most trainings. Means that are not finite are skipped.
struct SceneBounds {
    glm::dvec3 center{0};
    double radius = 1;  // half the box's diagonal, above zero
};
SceneBounds scene_bounds(const Gaussians& gaussians);

/// A view of the whole scene from the front and slightly above, as `ewa render` has. dataset: gives the up direction and the
/// front; may be null.
Viewpoint framing_view(const Gaussians& gaussians, const Dataset* dataset, int width, int height);

/// The frame whose camera is closest in position and direction; -1 without frames. A turn of 90 degrees
/// counts as much as a distance of `radius` (world units).
int nearest_frame(const Dataset& dataset, const Camera& camera, double radius);

/// The size of drawn cameras in world units, above zero: a share of the median distance between cameras next in name
/// order. If all cameras are in one place, a share of the scene's radius.
double camera_size(const Dataset& dataset, double radius);

/// The camera of a frame. Up is the mean up direction of all cameras; the pivot is at the median depth of the
/// splats in the middle of the image.
Viewpoint dataset_view(const Gaussians& gaussians, const Dataset& dataset, int frame);

}  // namespace ewa::viewer
