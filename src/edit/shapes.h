// SPDX-License-Identifier: Apache-2.0
// Shapes of --select: which splats they take. A shape is evaluated on the host in float64, so that a journal selects the same
// splats on every machine.
#pragma once
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "edit/edited_splats.h"
#include "edit/view_shapes.h"

namespace ewa::edit {

enum class Operation { set, add, remove, intersect };
inline constexpr std::string_view kOperationWords[] = {"", "add:", "remove:", "and:"};

/// A parsed --select.
struct Selection {
    Operation operation = Operation::set;
    Shape shape;
};

/// Parses "[add:|remove:|and:]SHAPE". Throws InputError that begins with `what`. SHAPE is one of
///   all, none, invert
///   a filter of --where (edit/filters.h): COLUMN=LOW..HIGH, box=x,y,z,X,Y,Z, sphere=x,y,z,R
///   polygon=x,y,x,y,...;view=VIEW     centres inside this polygon in the image of a view, px
///   brush=R,x,y,x,y,...;view=VIEW     centres within R px of this line
///     Both may end in ;front (only splats that others do not cover) and ;extent (any part of a splat, to 2 standard deviations).
///     Their numbers are up to 1e9.
///   color=r,g,b,T                     colours within T >= 0 of this one in each channel, 0 to 1
///   flood=x,y,z,T                     the splats that touch the nearest one to this point, and so on, with colours within T of its
///   flood=x,y,z,T,o                   the same among splats with an opacity of o or more, 0 to 1, of which none is more than 4 times
///                                     as large as the first one
///   cluster=x,y,z                     the group of touching splats that the nearest one to this point is in
///   floaters                          groups of fewer than 10 touching splats
///   far                               all but the largest group
///   contradicted                      splats as they were at first, which the photos of their run contradict. Results of devices differ:
///                                     a history writes splats= in its place.
///   splats=3,7,9-12                   these splats, by their numbers from 0 on
///   grow=R, shrink=R                  of the present selection, by R world units
/// VIEW is "fx,fy,cx,cy,w,x,y,z,tx,ty,tz": a pinhole's intrinsics (px), and the pose of world points in camera axes. With "parallel:"
/// before it, fx and fy are px per world unit of parallel rays.
Selection parse_selection(const std::string& text, const std::string& what = "--select");

/// Parses a SHAPE alone.
Shape parse_shape(const std::string& text, const std::string& what);

/// Replaces `contradicted` in a --select or --remove by the numbers of its splats, as splats= or none. Returns whether the text was one.
bool write_contradicted(std::string& selection, const EditedSplats& splats);

// What tools write; edit/view_shapes.h has the others.
std::string box_shape(const glm::dvec3& low, const glm::dvec3& high);
std::string sphere_shape(const glm::dvec3& center, double radius);
std::string splats_shape(const std::vector<bool>& flags);  // `none` if no flag is set

/// Selects. The states that do not change stay.
void select(EditedSplats& splats, const Selection& selection);
/// Deletes the splats of a shape. The others that are selected stay so.
void delete_shape(EditedSplats& splats, const Shape& shape);

}  // namespace ewa::edit
