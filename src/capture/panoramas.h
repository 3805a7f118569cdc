// SPDX-License-Identifier: Apache-2.0
// Photos of all directions (360°, equirectangular). COLMAP knows no such lens, so it gets pinhole views of each photo. They have
// one place, and turn against each other by known angles: a rig.
#pragma once
#include <filesystem>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "capture/matching.h"
#include "capture/steps.h"
#include "ewa/image.h"

namespace ewa::capture {

constexpr int kPanoramaViews = 6;  // pinholes that look at the horizon, 90 degrees wide

/// Whether all photos are 360° photos: twice as wide as high, and marked as such by XMP, or with a left border that continues the
/// right one. Throws InputError if a photo cannot be read.
bool are_panoramas(const std::filesystem::path& folder, const std::vector<std::filesystem::path>& names);

/// The rotation from the photo's axes to those of view k. View 0 looks at the photo's middle, and the others follow to the right,
/// in equal steps.
glm::dmat3 view_rotation(int k);

/// View k of a photo: a pinhole with the photo's pixels per degree in its middle.
Image panorama_view(const Image& photo, int k);

/// The name of view k of a photo, without white space. photo_of_view() is the inverse; its photo is empty for other names.
std::filesystem::path view_name(int k, const std::filesystem::path& photo);
std::pair<int, std::string> photo_of_view(const std::string& view);

/// Pinhole views of panoramas, which COLMAP gets instead of these. All photos of one width share a camera for their view k.
struct PanoramaViews {
    Photos photos;
    /// By width of the views, px, and k.
    std::map<std::pair<int, int>, std::vector<std::filesystem::path>> cameras;
};

/// Writes the pinhole views of all photos into the folder. Does not replace existing views. Throws RunError, Stopped.
PanoramaViews views_of_panoramas(const Photos& photos, const std::filesystem::path& folder,
                                 const ProgressFunction& progress);

/// The pairs of views for these pairs of photos, by indices into PanoramaViews::photos. Views of one photo are no pair, because
/// they have no baseline.
std::vector<ImagePair> pairs_of_views(const std::vector<ImagePair>& photos);

/// The pose of a photo.
struct Pose {
    glm::dquat rotation{1, 0, 0, 0};  // world to camera
    glm::dvec3 center{0};
};

/// Sets `pose` to the one that most poses agree with: rotations within about a degree, and near centres. scale: a typical length of
/// the model, in its units. Returns the number of poses that agree.
int agreed(const std::vector<Pose>& poses, double scale, Pose& pose);

/// The photos' poses that follow from a model of their views. A photo whose views all disagree has none.
struct RigPoses {
    std::map<std::string, Pose> photos;  // by name
    int views = 0, dropped = 0;  // with a pose; of these, those that disagree with others of their photo
};
RigPoses rig_poses(const std::filesystem::path& model);

/// Writes a model (.txt) of all views of the placed photos, without points, and the rig's description for COLMAP.
void write_rig(const std::map<std::string, Pose>& poses, const PanoramaViews& views,
               const std::filesystem::path& model, const std::filesystem::path& rig);

/// Writes the model of the photos, with EQUIRECTANGULAR cameras, and with the points of the views' model.
void join_views(const std::map<std::string, Pose>& poses, const std::filesystem::path& views_model,
                const Photos& photos, const std::filesystem::path& model);

}  // namespace ewa::capture
