// SPDX-License-Identifier: Apache-2.0
#include "capture/world_axes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <set>
#include <vector>

#include "core/random.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "io/splats/tileset.h"
#include "scene/splat_shape.h"
#include "scene/statistics.h"

namespace ewa::capture {
namespace {

using Complex = std::complex<double>;

constexpr double kPerMad = 1.4826;   // of a normal distribution: sigma / median absolute deviation
constexpr double kPerMedian = 0.85;  // of two normal coordinates: sigma / median distance
// Radians by which a direction is probably wrong: that of cameras that turn, of the ground, and of cameras that look one way, where
// only their roll is known.
constexpr double kSureTilt = 0.035, kGroundTilt = 0.05, kPitch = 0.25;

/// A camera's axes in the world, as a viewer of the upright photo sees them.
struct Shot {
    glm::dvec3 center{0}, right{0}, up{0}, forward{0};
    std::optional<image::GpsFix> gps;
};

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

double median_of(std::vector<double> values) {
    return scene::quantile(values, 0.5);
}

/// The axes of a symmetric matrix by its values, the smallest first.
struct Axes {
    std::array<double, 3> values{};
    std::array<glm::dvec3, 3> directions{};
};

Axes axes_of(const glm::dmat3& symmetric) {
    const scene::Decomposition d = scene::decompose(symmetric);
    std::array<int, 3> order{0, 1, 2};
    std::ranges::sort(order, {}, [&](int k) { return d.s[k]; });
    Axes axes;
    for (size_t i = 0; i < 3; ++i) {
        axes.values[i] = d.s[order[i]];
        axes.directions[i] = d.v[order[i]];
    }
    return axes;
}

/// The mean squares of points about their mean, along and across their axes.
struct Spread {
    glm::dvec3 mean{0};
    Axes axes;
};

Spread spread_of(const std::vector<glm::dvec3>& points) {
    Spread spread;
    for (const glm::dvec3& point : points) spread.mean += point / double(points.size());
    glm::dmat3 products(0);
    for (const glm::dvec3& point : points)
        products += glm::outerProduct(point - spread.mean, point - spread.mean) / double(points.size());
    spread.axes = axes_of(products);
    return spread;
}

/// A direction, and the mean squares by which it is probably wrong.
struct Up {
    glm::dvec3 direction{0};
    glm::dmat3 errors{kPitch * kPitch};
    std::string by = "the cameras";
    bool sure = false;
};

/// Whether the photos look along one direction from places in a plane across it, as those of an aerial survey do.
bool are_a_survey(const std::vector<Shot>& shots, const glm::dvec3& mean_forward) {
    constexpr double kAlike = 0.9, kFlat = 0.2, kWide = 0.2;
    if (glm::length(mean_forward) < kAlike) return false;
    std::vector<glm::dvec3> centers;
    for (const Shot& shot : shots) centers.push_back(shot.center);
    const auto& [low, middle, high] = spread_of(centers).axes.values;
    const glm::dvec3 normal = spread_of(centers).axes.directions[0];
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
    Axes axes;
    glm::dvec3 level(0);  // square to the cameras' horizontal axes
    for (int round = 0; round < kRounds; ++round) {
        glm::dmat3 products(0);
        double sum = 0;
        for (const Shot& shot : shots) {
            const double off = glm::dot(shot.right, level) / kTilted, weight = 1 / (1 + off * off);
            products += weight * glm::outerProduct(shot.right, shot.right);
            sum += weight;
        }
        axes = axes_of(products / sum);
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
        constexpr size_t kLeast = 50;
        constexpr uint32_t kTries = 3000;
        constexpr double kShare = 0.1;  // of the points
        constexpr int kRounds = 5;
        constexpr double kWide = 5;  // thicknesses that the ground is wide
        if (points_.size() < kLeast || !(thickness_ > 0)) return {};
        Plane best;
        size_t most = 0;
        for (uint32_t i = 0; i < kTries; ++i) {
            const auto u = core::uniform4({i, 1, 0, 0});
            std::array<glm::dvec3, 3> corners;
            for (size_t k = 0; k < 3; ++k) corners[k] = points_[size_t(u[k] * double(points_.size()))];
            const glm::dvec3 normal = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
            if (!(glm::length(normal) > 0)) continue;
            Plane plane{glm::normalize(normal), corners[0]};
            if (!lies_below(plane)) continue;
            if (const size_t count = on(plane).size(); count > most) {
                most = count;
                best = plane;
            }
        }
        if (double(most) < std::max(kShare * double(points_.size()), double(kLeast))) return {};
        for (int round = 0; round < kRounds; ++round) {
            const Spread spread = spread_of(on(best));
            if (std::sqrt(spread.axes.values[1]) < kWide * thickness_) return {};
            best = {spread.axes.directions[0], spread.mean};
            if (!lies_below(best) || on(best).size() < kLeast) return {};
        }
        return best.normal;
    }

  private:
    struct Plane {
        glm::dvec3 normal{0}, at{0};
    };

    /// Whether most cameras are on one side, to which the normal then points, and up is near it.
    bool lies_below(Plane& plane) const {
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

    std::vector<glm::dvec3> on(const Plane& plane) const {
        std::vector<glm::dvec3> found;
        for (const glm::dvec3& point : points_)
            if (std::abs(glm::dot(point - plane.at, plane.normal)) < thickness_) found.push_back(point);
        return found;
    }

    std::optional<Up> up_;
    std::vector<glm::dvec3> points_, centers_;
    double thickness_ = 0;
};

/// Axes whose y points down, as rows: from the model to them.
glm::dmat3 level_axes(const glm::dvec3& up) {
    // The shortest turn keeps what a user knows of the model.
    const glm::dvec3 y = -up, from(0, 1, 0), axis = glm::cross(y, from);
    const double cosine = glm::dot(y, from);
    if (cosine < -1 + 1e-9) return {1, 0, 0, 0, -1, 0, 0, 0, -1};
    const glm::dmat3 cross{0, axis.z, -axis.y, -axis.z, 0, axis.x, axis.y, -axis.x, 0};
    return glm::dmat3(1) + cross + cross * cross / (1 + cosine);
}

/// Photos with GPS: where they are in the levelled model, and metres from a place. East is real, north imaginary.
struct Places {
    io::Place origin;
    std::vector<glm::dvec3> centers;  // of the model
    std::vector<glm::dvec3> fixes;    // x east, y down, z north
    std::vector<bool> has_altitude;
};

Places places_of(const std::vector<Shot>& shots) {
    Places places;
    std::vector<double> latitudes, longitudes, altitudes;
    std::vector<const Shot*> with;
    for (const Shot& shot : shots)
        if (shot.gps) with.push_back(&shot);
    for (const Shot* shot : with) {
        latitudes.push_back(shot->gps->latitude);
        // Photos on both sides of the 180th meridian are neighbours.
        const double first = with[0]->gps->longitude;
        longitudes.push_back(first + std::remainder(shot->gps->longitude - first, 360.0));
        if (shot->gps->altitude) altitudes.push_back(*shot->gps->altitude);
    }
    places.origin = {median_of(latitudes), std::remainder(median_of(longitudes), 360.0),
                     median_of(altitudes)};
    const glm::dmat4 from_earth = glm::inverse(io::earth_of_place(places.origin));
    for (const Shot* shot : with) {
        const image::GpsFix& gps = *shot->gps;
        const glm::dmat4 there =
            io::earth_of_place({gps.latitude, gps.longitude, gps.altitude.value_or(places.origin.height)});
        places.centers.push_back(shot->center);
        places.fixes.emplace_back(from_earth * there[3]);
        places.has_altitude.push_back(gps.altitude.has_value());
    }
    return places;
}

/// A similarity of the plane: z becomes turn * z + shift.
struct PlaneFit {
    Complex turn{1}, shift{0};
    std::vector<double> errors{}, weights{};
};

Complex in_plane(const glm::dvec3& point) {
    return {point.x, point.z};
}

void measure(PlaneFit& fit, const std::vector<Complex>& from, const std::vector<Complex>& to) {
    fit.errors.resize(from.size());
    for (size_t i = 0; i < from.size(); ++i) fit.errors[i] = std::abs(fit.turn * from[i] + fit.shift - to[i]);
}

/// The least squares (Umeyama 1991).
void solve(PlaneFit& fit, const std::vector<Complex>& from, const std::vector<Complex>& to) {
    Complex mean_from, mean_to, products;
    double sum = 0, square = 0;
    for (size_t i = 0; i < from.size(); ++i) {
        mean_from += fit.weights[i] * from[i];
        mean_to += fit.weights[i] * to[i];
        sum += fit.weights[i];
    }
    mean_from /= sum;
    mean_to /= sum;
    for (size_t i = 0; i < from.size(); ++i) {
        products += fit.weights[i] * std::conj(from[i] - mean_from) * (to[i] - mean_to);
        square += fit.weights[i] * std::norm(from[i] - mean_from);
    }
    if (!(square > 0)) return;
    fit.turn = products / square;
    fit.shift = mean_to - fit.turn * mean_from;
    measure(fit, from, to);
}

/// The similarity that most pairs of places agree with. A few photos have wrong places, and the others are off by metres.
PlaneFit robust_fit(const std::vector<Complex>& from, const std::vector<Complex>& to) {
    constexpr size_t kFew = 6;  // of which none is passed over
    constexpr uint32_t kTries = 1500;
    constexpr int kRounds = 20;
    constexpr double kLeastError = 0.05;  // m
    const size_t count = from.size();
    PlaneFit best;
    best.weights.assign(count, 1);
    solve(best, from, to);
    if (count < kFew) return best;
    double least = median_of(best.errors);
    for (uint32_t i = 0; i < kTries; ++i) {
        const auto u = core::uniform4({i, 2, 0, 0});
        const size_t a = size_t(u[0] * double(count)), b = size_t(u[1] * double(count));
        const Complex apart = from[a] - from[b];
        if (!(std::abs(apart) > 0) || to[a] == to[b]) continue;
        PlaneFit fit{.turn = (to[a] - to[b]) / apart};
        fit.shift = to[a] - fit.turn * from[a];
        measure(fit, from, to);
        if (const double median = median_of(fit.errors); median < least) {
            least = median;
            best = fit;
        }
    }
    best.weights.resize(count);
    for (int round = 0; round < kRounds; ++round) {
        const double usual = 2 * std::max(kPerMedian * median_of(best.errors), kLeastError);
        for (size_t i = 0; i < count; ++i) {  // Geman and McClure 1985
            const double off = best.errors[i] / usual;
            best.weights[i] = 1 / ((1 + off * off) * (1 + off * off));
        }
        solve(best, from, to);
    }
    return best;
}

/// A fit of places, whose levelled axes may follow the altitudes.
struct GpsFit {
    glm::dmat3 level{1};
    PlaneFit plane{};
    Up up{};
};

glm::dvec3 moved(const GpsFit& fit, const glm::dvec3& center) {
    const glm::dvec3 at = fit.level * center;
    const Complex plane = fit.plane.turn * in_plane(at) + fit.plane.shift;
    return {plane.real(), std::abs(fit.plane.turn) * at.y, plane.imag()};
}

/// How the altitudes slope against the model: down by x east and y north, and the mean squares by which that is wrong.
struct Slope {
    glm::dvec2 down{0};
    glm::dmat2 errors{1};
};

std::optional<Slope> slope_of(const GpsFit& fit, const Places& places) {
    constexpr size_t kLeast = 6;
    constexpr double kLeastError = 0.1;  // m
    constexpr double kLine = 1e-6;       // m^2; a line has no slope across
    constexpr double kAlike = 2;  // errors of neighbours are alike, and do not cancel as independent ones
    std::vector<glm::dvec3> rows;
    std::vector<double> left, weights;
    for (size_t i = 0; i < places.centers.size(); ++i) {
        if (!places.has_altitude[i]) continue;
        const glm::dvec3 at = moved(fit, places.centers[i]);
        rows.emplace_back(at.x, at.z, 1);
        left.push_back(places.fixes[i].y - at.y);
        weights.push_back(fit.plane.weights[i]);
    }
    if (rows.size() < kLeast) return {};
    glm::dvec3 values(0);
    glm::dmat3 inverse(1);
    double usual = 0;
    for (int round = 0; round < 10; ++round) {
        glm::dmat3 products(0);
        glm::dvec3 sums(0);
        for (size_t i = 0; i < rows.size(); ++i) {
            const double off = round == 0 ? 0 : (left[i] - glm::dot(rows[i], values)) / (2 * usual);
            const double weight = weights[i] / ((1 + off * off) * (1 + off * off));
            products += weight * glm::outerProduct(rows[i], rows[i]);
            sums += weight * left[i] * rows[i];
        }
        for (int k = 0; k < 2; ++k) products[k][k] += kLine * products[2][2];
        if (!(std::abs(glm::determinant(products)) > 0)) return {};
        inverse = glm::inverse(products);
        values = inverse * sums;
        std::vector<double> errors;
        for (size_t i = 0; i < rows.size(); ++i)
            errors.push_back(std::abs(left[i] - glm::dot(rows[i], values)));
        usual = std::max(kPerMad * median_of(errors), kLeastError);
    }
    const double square = kAlike * kAlike * usual * usual;
    return Slope{{values.x, values.y}, square * glm::dmat2(inverse)};
}

GpsFit fitted(const Places& places, const Up& up) {
    GpsFit fit{.level = level_axes(up.direction), .up = up};
    std::vector<Complex> from, to;
    for (const glm::dvec3& each : places.fixes) to.push_back(in_plane(each));
    for (const glm::dvec3& center : places.centers) from.push_back(in_plane(fit.level * center));
    fit.plane = robust_fit(from, to);
    return fit;
}

std::string metres(double length) {
    return core::shown_number(std::round(10 * length) / 10) + " m";
}

/// The up direction between that of the cameras or the ground and that of the altitudes, as sure as each is.
Up weighed(const GpsFit& fit, const Slope& slope, const Up& before) {
    const double angle = std::arg(fit.plane.turn), c = std::cos(angle), s = std::sin(angle);
    const glm::dmat3 to_world = glm::dmat3(c, 0, s, 0, 1, 0, -s, 0, c) * fit.level;
    const glm::dvec3 down = to_world * -before.direction;
    const glm::dmat3 errors = to_world * before.errors * glm::transpose(to_world);
    const glm::dvec2 expected(down.x / down.y, down.z / down.y);
    const glm::dmat2 square(errors[0][0], errors[0][2], errors[2][0], errors[2][2]);
    const glm::dmat2 gain = square * glm::inverse(square + slope.errors);
    const glm::dvec2 found = expected + gain * (slope.down - expected);
    const double share = gain[0][0] + gain[1][1];  // of two directions
    Up up = before;
    up.direction = -(glm::transpose(to_world) * glm::normalize(glm::dvec3(found.x, 1, found.y)));
    if (share > 0.5) up.by = share > 1.5 ? "the altitudes" : before.by + " and the altitudes";
    return up;
}

/// Scale, heading and place by the GPS of the photos. Empty where it does not determine them; reason: why.
std::optional<WorldAxes> axes_by_gps(const std::vector<Shot>& shots, const Up& first, std::string& reason) {
    constexpr size_t kLeast = 3;
    constexpr int kRounds = 5;
    constexpr double kShare = 0.7, kMostError = 0.3;  // of the photos; of the extent
    const Places places = places_of(shots);
    std::set<std::pair<double, double>> distinct;
    for (const glm::dvec3& fix : places.fixes) distinct.emplace(fix.x, fix.z);
    if (distinct.empty()) return {};
    const std::string of_photos = "the GPS of " + core::counted(places.fixes.size(), "photo");
    if (distinct.size() < kLeast) {
        reason = of_photos + " has too few places to give scale and north";
        return {};
    }
    GpsFit fit = fitted(places, first);
    for (int round = 0; round < kRounds; ++round) {
        const auto slope = slope_of(fit, places);
        if (!slope) break;
        fit = fitted(places, weighed(fit, *slope, first));
    }
    const PlaneFit& plane = fit.plane;
    double sum = 0, square = 0;
    Complex mean;
    for (size_t i = 0; i < plane.weights.size(); ++i) {
        mean += plane.weights[i] * in_plane(places.fixes[i]);
        sum += plane.weights[i];
    }
    mean /= sum;
    for (size_t i = 0; i < plane.weights.size(); ++i)
        square += plane.weights[i] * std::norm(in_plane(places.fixes[i]) - mean) / sum;
    const double extent = std::sqrt(square), scale = std::abs(plane.turn), error = median_of(plane.errors);
    std::vector<double> errors = plane.errors;
    // Three places always fit a similarity about well.
    const double freedom = double(errors.size()) / double(errors.size() - 2);
    const double most = scene::quantile(errors, kShare) * std::sqrt(freedom);
    if (!(most < kMostError * extent) || !(scale > 0)) {
        reason = of_photos + " does not fit the cameras (" + metres(error) +
                 " off in the median, of an extent of " + metres(extent) + ")";
        return {};
    }
    WorldAxes axes;
    const double c = plane.turn.real() / scale, s = plane.turn.imag() / scale;
    axes.scale = scale;
    axes.rotation = glm::dmat3(c, 0, s, 0, 1, 0, -s, 0, c) * fit.level;
    std::vector<double> down;
    for (size_t i = 0; i < places.centers.size(); ++i)
        if (places.has_altitude[i]) down.push_back(places.fixes[i].y - moved(fit, places.centers[i]).y);
    if (down.empty())
        for (const glm::dvec3& center : places.centers) down.push_back(-moved(fit, center).y);
    axes.shift = {plane.shift.real(), median_of(down), plane.shift.imag()};
    axes.place = places.origin;
    axes.text = "scale, north and place are by " + of_photos + " (median error " + metres(error) +
                "); levelled by " + fit.up.by;
    return axes;
}

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
