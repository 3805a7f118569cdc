// SPDX-License-Identifier: Apache-2.0
#include "capture/doubts.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <glm/geometric.hpp>
#include <map>
#include <numbers>
#include <optional>

#include "capture/steps.h"
#include "core/text.h"
#include "core/typing.h"
#include "scene/lens.h"
#include "scene/statistics.h"

namespace ewa::capture {
namespace {

constexpr size_t kManyMatches = 30;    // that a wrong pair hardly has
constexpr double kOfStrongest = 0.25;  // of the matches of a photo's strongest pair
constexpr double kFarMatch = 0.012;    // of the longer side; a placed photo's errors are a tenth of that
constexpr double kFarStep = 5;         // times the usual one
constexpr double kLeastTurn = 30;      // degrees
constexpr double kSteady =
    0.5;  // the usual step by the usual distance of any two, at most: the order is a path
constexpr size_t kLeastStations = 6;

glm::dmat3 cross_matrix(const glm::dvec3& t) {
    return {0, t.z, -t.y, -t.z, 0, t.x, t.y, -t.x, 0};
}

/// The direction of a pixel, at a distance of one along the axis.
std::optional<glm::dvec3> ray_of(const Camera& camera, const glm::dvec2& at) {
    const auto ray =
        scene::undistort(camera.distortion, {(at.x - camera.cx) / camera.fx, (at.y - camera.cy) / camera.fy});
    return ray ? std::optional(glm::dvec3(ray->x, ray->y, 1)) : std::nullopt;
}

/// Degrees.
double turn_between(const glm::dmat3& a, const glm::dmat3& b) {
    const glm::dmat3 turn = a * glm::transpose(b);
    const double cosine = 0.5 * (turn[0][0] + turn[1][1] + turn[2][2] - 1);
    return std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi;
}

/// What is usual from a photo to the next: a length, and degrees.
struct Step {
    double length = 0, turn = 0;
};

/// Empty where the photos are not taken along a path.
std::optional<Step> usual_step(const std::vector<Station>& stations) {
    const size_t count = stations.size();
    if (count < kLeastStations) return {};
    std::vector<double> steps, turns, apart;
    for (size_t i = 0; i + 1 < count; ++i) {
        steps.push_back(glm::distance(stations[i].center, stations[i + 1].center));
        turns.push_back(turn_between(stations[i].rotation, stations[i + 1].rotation));
        apart.push_back(glm::distance(stations[i].center, stations[(i + count / 2) % count].center));
    }
    const Step step{scene::quantile(steps, 0.5), scene::quantile(turns, 0.5)};
    return step.length > 0 && step.length < kSteady * scene::quantile(apart, 0.5) ? std::optional(step)
                                                                                  : std::nullopt;
}

/// How many usual steps two photos are apart, in space or by their turn.
double distance_by(const Step& usual, const Station& a, const Station& b) {
    const double turn = std::max(usual.turn, kLeastTurn / kFarStep);
    return std::max(glm::distance(a.center, b.center) / usual.length,
                    turn_between(a.rotation, b.rotation) / turn);
}

}  // namespace

bool contradict(const Camera& first, const Camera& second,
                const std::vector<std::pair<glm::dvec2, glm::dvec2>>& matches) {
    const glm::dmat3 rotation = second.rotation * glm::transpose(first.rotation);
    const glm::dvec3 translation = second.translation - rotation * first.translation;
    if (!(glm::length(translation) > 0)) return false;
    const glm::dmat3 essential = cross_matrix(glm::normalize(translation)) * rotation,
                     back = glm::transpose(essential);
    const double focal = 0.25 * (first.fx + first.fy + second.fx + second.fy);
    std::vector<double> errors;
    for (const auto& [at, other] : matches) {
        const auto a = ray_of(first, at), b = ray_of(second, other);
        if (!a || !b) continue;
        const glm::dvec3 line = essential * *a, line_back = back * *b;
        const double slope = std::hypot(std::hypot(line.x, line.y), std::hypot(line_back.x, line_back.y));
        // The first-order distance to the epipolar lines (Sampson 1982).
        errors.push_back(focal * std::abs(glm::dot(*b, line)) / std::max(slope, 1e-12));
    }
    const double side = std::max(std::max(first.width, first.height), std::max(second.width, second.height));
    return errors.size() >= kManyMatches && scene::quantile(errors, 0.5) > kFarMatch * side;
}

std::vector<Contradiction> contradictions_in(const SparseModel& model, const FeatureDatabase& database) {
    struct Pair {
        std::int64_t first, second;
        size_t matches;
        bool bad;
    };
    std::vector<Pair> pairs;
    std::map<std::int64_t, size_t> strongest;
    std::map<std::int64_t, Camera> cameras;
    for (const auto& [id, image] : model.images) cameras[id] = camera_of(model, image);
    database.visit_verified([&](std::int64_t first, std::int64_t second, const auto& matches) {
        if (!cameras.contains(first) || !cameras.contains(second) || matches.size() < kManyMatches) return;
        const auto &a = model.images.at(uint32_t(first)).features,
                   &b = model.images.at(uint32_t(second)).features;
        std::vector<std::pair<glm::dvec2, glm::dvec2>> places;
        for (const FeatureMatch& match : matches)
            if (match.first < a.size() && match.second < b.size())
                places.emplace_back(a[match.first].at, b[match.second].at);
        pairs.push_back({first, second, matches.size(), contradict(cameras[first], cameras[second], places)});
        for (const std::int64_t image : {first, second})
            strongest[image] = std::max(strongest[image], matches.size());
    });
    std::map<std::string, int> order;
    for (const auto& [name, number] : database.images()) order.emplace(name, int(order.size()));
    std::vector<Contradiction> found;
    for (const Pair& pair : pairs) {
        const auto usual = double(std::min(strongest[pair.first], strongest[pair.second]));
        if (!pair.bad || double(pair.matches) < kOfStrongest * usual) continue;
        const std::string &first = model.images.at(uint32_t(pair.first)).name,
                          &second = model.images.at(uint32_t(pair.second)).name;
        found.push_back({first, second, pair.matches, std::abs(order[first] - order[second]) <= 2});
    }
    std::ranges::stable_sort(
        found, [](const Contradiction& a, const Contradiction& b) { return a.matches > b.matches; });
    return found;
}

std::vector<Station> stations_of(const SparseModel& model) {
    std::vector<Station> stations;
    for (const auto& [id, image] : model.images) {
        const Camera camera = camera_of(model, image);
        stations.push_back({image.name, camera.position(), camera.rotation});
    }
    std::ranges::sort(stations, {}, &Station::name);
    return stations;
}

std::vector<std::string> strays_among(const std::vector<Station>& stations) {
    const auto usual = usual_step(stations);
    if (!usual) return {};
    const auto is_far = [&](const Station& a, const Station& b, double times) {
        return distance_by(*usual, a, b) > times * kFarStep;
    };
    std::vector<std::string> strays;
    for (size_t i = 1; i + 1 < stations.size(); ++i)
        if (is_far(stations[i - 1], stations[i], 1) && is_far(stations[i], stations[i + 1], 1) &&
            !is_far(stations[i - 1], stations[i + 1], 0.5))
            strays.push_back(stations[i].name);
    return strays;
}

std::vector<size_t> jumps_among(const std::vector<Station>& stations, const std::vector<size_t>& matches) {
    const auto usual = usual_step(stations);
    if (!usual) return {};
    std::vector<size_t> jumps;
    for (size_t i = 0; i + 1 < stations.size(); ++i)
        if (matches[i] >= kManyMatches && distance_by(*usual, stations[i], stations[i + 1]) > kFarStep)
            jumps.push_back(i);
    return jumps;
}

size_t parted_by(const std::vector<size_t>& jumps, size_t stations) {
    size_t longest = 0, begin = 0;
    for (const size_t jump : jumps) {
        longest = std::max(longest, jump + 1 - begin);
        begin = jump + 1;
    }
    return stations - std::max(longest, stations - begin);
}

std::vector<size_t> matches_along(const std::vector<Station>& stations, const FeatureDatabase& database) {
    std::map<std::string, size_t> place;
    for (size_t i = 0; i < stations.size(); ++i) place[stations[i].name] = i;
    std::map<std::int64_t, size_t> place_of;
    for (const auto& [name, number] : database.images())
        if (const auto found = place.find(name); found != place.end()) place_of[number] = found->second;
    std::vector<size_t> along(stations.size(), 0);
    database.visit_verified([&](std::int64_t first, std::int64_t second, const auto& matches) {
        const auto a = place_of.find(first), b = place_of.find(second);
        if (a == place_of.end() || b == place_of.end()) return;
        const auto [low, high] = std::minmax(a->second, b->second);
        if (high == low + 1) along[low] = matches.size();
    });
    return along;
}

std::vector<std::string> doubts_of(const Grade& grade, const std::vector<Contradiction>& contradictions,
                                   const std::vector<std::string>& strays,
                                   const std::vector<std::string>& jumps) {
    std::vector<std::string> lines;
    std::map<std::string, std::vector<std::string>> by_fault;
    for (const auto& [name, fault] : grade.faults) by_fault[fault].push_back(core::one_line(name));
    for (const auto& [fault, names] : by_fault)
        lines.push_back("the cameras of " + core::counted(names.size(), "photo") +
                        " are probably wrong, since " + fault + ": " + names_text(names));
    std::vector<std::string> pairs;
    for (const Contradiction& each : contradictions)
        pairs.push_back(core::one_line(each.first) + " with " + core::one_line(each.second));
    if (!pairs.empty())
        lines.push_back(
            "some cameras may be wrong, or things look alike: " + core::counted(pairs.size(), "pair") +
            " of photos have matches that do not fit their cameras: " + names_text(pairs));
    std::vector<std::string> names;
    for (const std::string& name : strays) names.push_back(core::one_line(name));
    if (!names.empty())
        lines.push_back("the cameras of " + core::counted(names.size(), "photo") +
                        " may be wrong, far from those before and after: " + names_text(names));
    if (!jumps.empty())
        lines.push_back("the path of the photos jumps, and cameras behind a jump may be wrong: " +
                        names_text(jumps));
    return lines;
}

}  // namespace ewa::capture
