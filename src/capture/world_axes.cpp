// SPDX-License-Identifier: Apache-2.0
#include "capture/world_axes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <vector>

#include "capture/gps_axes.h"
#include "ewa/error.h"
#include "scene/planes.h"
#include "scene/statistics.h"

namespace ewa::capture {
namespace {

// Radians by which a direction is probably wrong: that of cameras that turn, and of the ground.
constexpr double kSureTilt = 0.035, kGroundTilt = 0.05;

std::vector<Shot> shots_of(const SparseModel& model, const std::map<std::string, PhotoFacts>& facts) {
    std::vector<Shot> shots;
    for (const auto& [id, image] : model.images) {
        const Camera camera = camera_of(model, image);
        const glm::dmat3 axes = glm::transpose(camera.rotation);
        const auto found = facts.find(image.name);
        const PhotoFacts fact = found == facts.end() ? PhotoFacts() : found->second;
        Shot shot{camera.position(), axes[0], -axes[1], axes[2], fact.gps};
        // Where the first row and column of the pixels are in the upright photo: EXIF 2.32, tag 274.
        const int turn = (fact.orientation - 1) / 2;
        if (turn == 1) shot.up = axes[1];
        if (turn == 2) shot.up = -axes[0];
        if (turn == 3) shot.up = axes[0];
        if (turn > 1) shot.right = axes[1];
        const double sum = shot.center.x + shot.center.y + shot.center.z + shot.up.x + shot.up.y + shot.up.z;
        if (std::isfinite(sum)) shots.push_back(shot);
    }
    return shots;
}

/// Whether the photos look along one direction from places in a plane across it, as those of an aerial survey do.
bool are_a_survey(const std::vector<Shot>& shots, const glm::dvec3& mean_forward) {
    constexpr double kAlike = 0.9, kFlat = 0.2, kWide = 0.2;
    if (glm::length(mean_forward) < kAlike) return false;
    std::vector<glm::dvec3> centers;
    for (const Shot& shot : shots) centers.push_back(shot.center);
    const auto& [low, middle, high] = scene::spread_of(centers).axes.values;
    const glm::dvec3 normal = scene::spread_of(centers).axes.directions[0];
    const double across = std::abs(glm::dot(normal, glm::normalize(mean_forward)));
    return low < kFlat * kFlat * middle && middle > kWide * kWide * high && across > kAlike;
}

std::optional<Up> up_of(const std::vector<Shot>& shots) {
    constexpr int kRounds = 8;
    constexpr double kTilted = 0.1;    // of a horizontal axis; more is no level photo
    constexpr double kClear = 0.3;     // of a mean of unit vectors
    constexpr double kTurning = 0.15;  // the mean square of horizontal axes across most of them
    const double count = double(shots.size());
    glm::dvec3 up(0), forward(0);
    for (const Shot& shot : shots) {
        up += shot.up / count;
        forward += shot.forward / count;
    }
    scene::Axes axes;
    glm::dvec3 level(0);  // square to the cameras' horizontal axes
    for (int round = 0; round < kRounds; ++round) {
        glm::dmat3 products(0);
        double sum = 0;
        for (const Shot& shot : shots) {
            const double off = glm::dot(shot.right, level) / kTilted, weight = 1 / (1 + off * off);
            products += weight * glm::outerProduct(shot.right, shot.right);
            sum += weight;
        }
        axes = scene::axes_of(products / sum);
        level = axes.directions[0];
    }
    std::vector<double> tilts;
    for (const Shot& shot : shots) tilts.push_back(std::abs(glm::dot(shot.right, level)));
    // Photos of nearly one direction that are wrong together would tilt this by far more than they are wrong.
    if (kPerMad * median_of(tilts) < kTilted && axes.values[1] > kTurning) {
        const double upwards = glm::dot(level, up), against_view = -glm::dot(level, forward);
        const double sign = std::abs(upwards) > kClear ? upwards : against_view;
        if (std::abs(sign) > kClear)
            return Up{.direction = sign > 0 ? level : -level,
                      .errors = glm::dmat3(kSureTilt * kSureTilt),
                      .sure = true};
    }
    if (are_a_survey(shots, forward)) return Up{-glm::normalize(forward)};
    const glm::dvec3 side = axes.directions[2];  // the horizontal axis of most
    const glm::dvec3 square = up - glm::dot(up, side) * side;
    if (glm::length(square) > kClear)
        return Up{.direction = glm::normalize(square),
                  .errors = glm::dmat3(kPitch * kPitch) -
                            (kPitch * kPitch - kSureTilt * kSureTilt) * glm::outerProduct(side, side)};
    // Rows of an aerial survey, there and back: up directions cancel, and views do not.
    if (glm::length(forward) > 1 - kClear) return Up{-glm::normalize(forward)};
    return {};
}

/// The plane with the most points below the cameras.
class Ground {
  public:
    Ground(const SparseModel& model, const std::vector<Shot>& shots, const std::optional<Up>& up) : up_(up) {
        constexpr size_t kMostPoints = 5000, kMostCameras = 500, kTrack = 3;
        constexpr double kThickness = 0.01;  // of the usual distance of a point
        for (size_t i = 0; i < shots.size(); i += shots.size() / kMostCameras + 1)
            centers_.push_back(shots[i].center);
        std::array<std::vector<double>, 3> sides;
        for (const glm::dvec3& center : centers_)
            for (int k = 0; k < 3; ++k) sides[size_t(k)].push_back(center[k]);
        const glm::dvec3 middle(median_of(sides[0]), median_of(sides[1]), median_of(sides[2]));
        std::vector<double> distances;
        for (const auto& [id, point] : model.points) {
            const double distance = glm::distance(point.position, middle);
            const bool unsure =
                !point.track.empty() && point.track.size() < kTrack;  // 360° photos have no tracks
            if (unsure || !std::isfinite(distance)) continue;
            points_.push_back(point.position);
            distances.push_back(distance);
        }
        thickness_ = kThickness * scene::quantile(distances, 0.5);
        const size_t step = points_.size() / kMostPoints + 1;
        for (size_t i = 0; i * step < points_.size(); ++i) points_[i] = points_[i * step];
        points_.resize((points_.size() + step - 1) / step);
    }

    std::optional<glm::dvec3> normal() const {
        const auto plane = scene::largest_plane(points_, thickness_,
                                                [this](scene::Plane& found) { return lies_below(found); });
        return plane ? std::optional(plane->normal) : std::nullopt;
    }

  private:
    /// Whether most cameras are on one side, to which the normal then points, and up is near it.
    bool lies_below(scene::Plane& plane) const {
        constexpr double kMostCameras = 0.9;
        const double near = std::cos(glm::radians(up_ && up_->sure ? 8.0 : 20.0));
        size_t above = 0;
        if (up_ && std::abs(glm::dot(plane.normal, up_->direction)) < near) return false;
        for (const glm::dvec3& center : centers_) above += glm::dot(center - plane.at, plane.normal) > 0;
        if (2 * above < centers_.size()) {
            plane.normal = -plane.normal;
            above = centers_.size() - above;
        }
        return double(above) >= kMostCameras * double(centers_.size()) &&
               (!up_ || glm::dot(plane.normal, up_->direction) > 0);
    }

    std::optional<Up> up_;
    std::vector<glm::dvec3> points_, centers_;
    double thickness_ = 0;
};

}  // namespace

WorldAxes world_axes(const SparseModel& model, const std::map<std::string, PhotoFacts>& facts) {
    const std::vector<Shot> shots = shots_of(model, facts);
    if (shots.empty()) return {};
    const std::optional<Up> up = up_of(shots);
    std::optional<Up> ground;
    if (const auto normal = Ground(model, shots, up).normal())
        ground =
            Up{.direction = *normal, .errors = glm::dmat3(kGroundTilt * kGroundTilt), .by = "the ground"};
    WorldAxes axes;
    std::string reason;
    // Streets slope, and level cameras do not.
    const std::optional<Up> with_gps = up && (up->sure || !ground) ? up : ground;
    if (with_gps)
        if (auto by_gps = axes_by_gps(shots, *with_gps, reason)) return *by_gps;
    if (const std::optional<Up> without = ground ? ground : up) {
        axes.rotation = level_axes(without->direction);
        axes.text = "levelled by " + without->by;
    }
    if (!reason.empty()) axes.text = reason + (axes.text.empty() ? "" : "; " + axes.text);
    return axes;
}

std::string set_world_axes(const std::filesystem::path& folder, const std::filesystem::path& photos,
                           const std::filesystem::path& place) {
    SparseModel model = read_sparse(folder);
    std::map<std::string, PhotoFacts> facts;
    for (const auto& [id, image] : model.images) {
        PhotoFacts& fact = facts[image.name];
        fact.gps = image::shot_of(photos / image.name).gps;
        try {
            const ImageSize size = read_image_size(photos / image.name);
            const SparseCamera& camera = model.cameras.at(image.camera);
            // COLMAP may have turned the pixels upright.
            if (camera.width == uint64_t(size.width) && camera.height == uint64_t(size.height))
                fact.orientation = size.orientation;
        } catch (const InputError&) {
            continue;  // it was readable when COLMAP placed it
        }
    }
    const WorldAxes axes = world_axes(model, facts);
    if (axes.rotation != glm::dmat3(1) || axes.place) {
        move(model, axes.scale, axes.rotation, axes.shift);
        write_sparse(model, folder);
    }
    if (axes.place) io::write_place(place, *axes.place);
    return axes.text;
}

}  // namespace ewa::capture
