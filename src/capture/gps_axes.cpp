// SPDX-License-Identifier: Apache-2.0
#include "capture/gps_axes.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <set>

#include "core/random.h"
#include "core/text.h"
#include "core/typing.h"
#include "io/splats/tileset.h"
#include "scene/statistics.h"

namespace ewa::capture {

double median_of(std::vector<double> values) {
    return scene::quantile(values, 0.5);
}

glm::dmat3 level_axes(const glm::dvec3& up) {
    // The shortest turn keeps what a user knows of the model.
    const glm::dvec3 y = -up, from(0, 1, 0), axis = glm::cross(y, from);
    const double cosine = glm::dot(y, from);
    if (cosine < -1 + 1e-9) return {1, 0, 0, 0, -1, 0, 0, 0, -1};
    const glm::dmat3 cross{0, axis.z, -axis.y, -axis.z, 0, axis.x, axis.y, -axis.x, 0};
    return glm::dmat3(1) + cross + cross * cross / (1 + cosine);
}

namespace {

using Complex = std::complex<double>;

constexpr double kPerMedian = 0.85;  // of two normal coordinates: sigma / median distance

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

}  // namespace

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

}  // namespace ewa::capture
