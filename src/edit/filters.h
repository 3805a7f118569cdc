// SPDX-License-Identifier: Apache-2.0
// Filters, which decide for each splat of a scene whether it stays.
#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "ewa/camera.h"
#include "ewa/gaussians.h"

namespace ewa::edit {

/// Returns the cameras of the run that trained the splats. Throws InputError if there are none.
struct Cameras : std::function<std::vector<Camera>()> {
    using function::function;
    /// Returns for each splat whether the run's photos contradict it (pipeline/contradicted.h). left: indices of the splats that there
    /// are. Empty: there are no photos. Throws InputError and RunError.
    std::function<std::vector<bool>(const Gaussians&, const std::vector<uint32_t>& left)> contradicted;
};

/// Returns for each splat whether it stays.
using Filter = std::function<std::vector<bool>(const Gaussians&, const Cameras&)>;

/// What a filter COLUMN=LOW..HIGH compares.
struct Column {
    const char* name;
    double (*value)(const Gaussians&, size_t);  // of a splat
    bool decades = false;                       // the values spread over powers of ten
};
/// The colour of a splat without what depends on the view.
glm::dvec3 color_of(const Gaussians& gaussians, size_t i);
double opacity_of(const Gaussians& gaussians, size_t i);
double scale_of(const Gaussians& gaussians, size_t i, bool largest = true);  // else the smallest
/// All columns but kViews.
std::span<const Column> columns();
/// The column whose values depend on cameras: scene::views_of_splats.
inline constexpr const char* kViews = "views";

/// Parses a filter of --where. Throws InputError that begins with `what`.
///   COLUMN=LOW..HIGH   a range of x, y, z, opacity, scale (the largest), thickness (the smallest), red, green, blue, or of the number of
///                      the run's images in which the centre is (views). One bound is enough.
///   box=x,y,z,X,Y,Z    the centre is in this box: its low corner, then its high one
///   sphere=x,y,z,R     the centre is in this sphere
Filter parse_filter(const std::string& text, const std::string& what);

/// A filter that keeps drawable splats (ewa/gaussians.h).
std::vector<bool> drawable_splats(const Gaussians& gaussians);
/// A filter that keeps splats in groups of at least 10 splats that touch (scene::touching_groups).
std::vector<bool> grounded_splats(const Gaussians& gaussians);
/// Cameras::contradicted. Throws InputError that begins with `what` if there are no photos.
std::vector<bool> contradicted_splats(const Gaussians& gaussians, const std::vector<uint32_t>& left,
                                      const Cameras& cameras, const std::string& what);
/// A filter that keeps the largest group of splats that touch.
std::vector<bool> largest_cluster(const Gaussians& gaussians);

/// The scene in grey, with splats that are not in `left` in red. left: ascending indices into `all`.
Gaussians with_removed_in_red(const Gaussians& all, const std::vector<uint32_t>& left);

}  // namespace ewa::edit
