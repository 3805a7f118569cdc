// SPDX-License-Identifier: Apache-2.0
#include "bench/cases.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <numbers>
#include <sstream>
#include <string_view>

#include "core/random.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "shared/constants.h"

namespace ewa::bench {
namespace {

std::string count_text(uint32_t count) {
    if (count % 1000000 == 0) return std::to_string(count / 1000000) + "m";
    if (count % 1000 == 0) return std::to_string(count / 1000) + "k";
    return std::to_string(count);
}

constexpr const char* kKindNames[] = {"forward", "train", "sort", "update", "first_step"};
constexpr const char* kLayoutNames[] = {"capture", "cloud", "sparse", "dense"};

Case frame_case(Kind kind, Layout layout, uint32_t splats, int width, int height, int sh_degree, bool large) {
    const std::string name = std::string(kLayoutNames[int(layout)]) + "_" + count_text(splats) + "_" +
                             std::to_string(width) + "x" + std::to_string(height) + "_sh" +
                             std::to_string(sh_degree) + "_" + name_of(kind);
    return {name, kind, layout, splats, width, height, sh_degree, large};
}

/// In the pattern, * stands for any characters, and ? for one.
bool fits(std::string_view name, std::string_view pattern) {
    if (pattern.empty()) return name.empty();
    if (pattern[0] == '*')
        return fits(name, pattern.substr(1)) || (!name.empty() && fits(name.substr(1), pattern));
    return !name.empty() && (pattern[0] == '?' || pattern[0] == name[0]) &&
           fits(name.substr(1), pattern.substr(1));
}

bool matches(const std::string& name, const std::string& pattern) {
    if (pattern.find_first_of("*?") == std::string::npos) return name.find(pattern) != std::string::npos;
    return fits(name, pattern);
}

/// The parameters of a layout.
struct Style {
    int objects = 0;
    double radius = 0;                       // of an object, relative to its distance
    double size = 0;                         // of a splat, relative to the spacing
    double size_spread = 0;                  // standard deviation of the logarithm
    std::array<double, 3> opacity_shares{};  // faint, middling, opaque; they add up to 1
};

constexpr Style kStyles[] = {{12, 0.22, 0.36, 0.6, {0.35, 0.35, 0.30}},  // in the order of Layout
                             {60, 0.10, 0.45, 0.7, {0.30, 0.40, 0.30}},
                             {60, 0.10, 0.15, 0.4, {0.0, 0.1, 0.9}},
                             {60, 0.10, 1.6, 0.4, {1.0, 0.0, 0.0}}};

/// An ellipsoid that splats lie on, in view coordinates.
struct Object {
    glm::dvec3 centre{0}, radii{0};
    double area = 0;  // about
    glm::dvec3 color{0};
};

constexpr double kBackdropShare = 0.25;  // of the splats
enum Stream : uint32_t { kObject = 1, kObjectShape, kPlace, kNormal, kShape, kSpin, kOpacity, kColor, kSh };

std::array<double, 4> uniform(Stream stream, uint32_t i, uint32_t part = 0) {
    return core::uniform4({i, stream, part, 0x62656e63u});
}
std::array<double, 3> normal(Stream stream, uint32_t i, uint32_t part = 0) {
    return core::normal3({i, stream, part, 0x62656e63u});
}

Camera camera_of(const Case& one) {
    const double focal = 0.9 * std::max(one.width, one.height);
    // A rotation that is not the identity, so that nothing is aligned with the axes.
    const double c = std::cos(0.4), s = std::sin(0.4), d = std::cos(-0.3), e = std::sin(-0.3);
    const glm::dmat3 about_y(c, 0, -s, 0, 1, 0, s, 0, c), about_x(1, 0, 0, 0, d, e, 0, -e, d);
    return {one.width,        one.height,        focal,           focal, 0.5 * one.width,
            0.5 * one.height, about_x * about_y, {0.3, -0.2, 0.5}};
}

std::vector<Object> make_objects(const Style& style, const Camera& camera) {
    const glm::dvec2 reach(0.5 * camera.width / camera.fx, 0.5 * camera.height / camera.fy);  // tangents
    std::vector<Object> objects;
    for (uint32_t i = 0; i < uint32_t(style.objects); ++i) {
        const auto place = uniform(kObject, i);
        const auto shape = uniform(kObjectShape, i);
        Object object;
        const double z = 2.5 * std::pow(4.0, place[0]);
        // A quarter of the width beyond each border: an image never shows the whole scene.
        object.centre = {2.5 * (place[1] - 0.5) * reach.x * z, 2.5 * (place[2] - 0.5) * reach.y * z, z};
        const double radius = style.radius * z * (0.5 + place[3]);
        object.radii = radius * glm::dvec3(0.4 + shape[0], 0.4 + shape[1], 0.4 + shape[2]);
        const glm::dvec3 r = object.radii;
        object.area = 4.0 / 3.0 * std::numbers::pi * (r.x * r.y + r.y * r.z + r.z * r.x);
        object.color = {0.2 + 0.7 * shape[3], 0.2 + 0.7 * place[3], 0.2 + 0.7 * shape[0]};
        objects.push_back(object);
    }
    return objects;
}

/// A part of a sphere around the camera, 1.5 times as large as the view.
struct Backdrop {
    double radius = 18;
    glm::dvec2 tangents{0};
    double area() const { return 4 * tangents.x * tangents.y * radius * radius; }
};

/// The unit quaternion (w x y z) that turns the z axis to `axis` after a spin about z.
std::array<double, 4> quaternion_to(const glm::dvec3& axis, double spin) {
    glm::dvec3 v(-axis.y, axis.x, 0);  // z x axis
    double w = 1 + axis.z;
    if (w < 1e-9) w = 0, v = {1, 0, 0};
    const double norm = std::sqrt(w * w + glm::dot(v, v)), c = std::cos(spin / 2), s = std::sin(spin / 2);
    w /= norm;
    v /= norm;
    return {w * c, v.x * c + v.y * s, v.y * c - v.x * s, w * s};
}

struct Surface {
    glm::dvec3 point{0}, normal{0, 0, 1};  // view coordinates
    double spacing = 0;
    glm::dvec3 color{0.5};
};

class Surfaces {
  public:
    Surfaces(const Style& style, const Camera& camera, uint32_t splats)
        : objects_(make_objects(style, camera)), splats_(splats) {
        backdrop_.tangents = {0.75 * camera.width / camera.fx, 0.75 * camera.height / camera.fy};
        for (const Object& object : objects_) areas_.push_back(total_area() + object.area);
    }

    Surface point(uint32_t i) const {
        const auto u = uniform(kPlace, i);
        return u[0] < kBackdropShare ? on_backdrop(u) : on_object(i, u);
    }

  private:
    double total_area() const { return areas_.empty() ? 0 : areas_.back(); }

    Surface on_backdrop(const std::array<double, 4>& u) const {
        Surface surface;
        const glm::dvec3 ray((2 * u[1] - 1) * backdrop_.tangents.x, (2 * u[2] - 1) * backdrop_.tangents.y, 1);
        surface.normal = glm::normalize(ray);
        surface.point = backdrop_.radius * surface.normal;
        surface.spacing = std::sqrt(backdrop_.area() / (kBackdropShare * splats_));
        surface.color = {0.3 + 0.4 * u[1], 0.4, 0.3 + 0.4 * u[2]};
        return surface;
    }

    Surface on_object(uint32_t i, const std::array<double, 4>& u) const {
        const auto found = std::lower_bound(areas_.begin(), areas_.end(), u[1] * total_area());
        const Object& object = objects_[std::min(size_t(found - areas_.begin()), objects_.size() - 1)];
        const auto n = normal(kNormal, i);
        const glm::dvec3 direction = glm::normalize(glm::dvec3(n[0], n[1], n[2]));
        Surface surface;
        surface.point = object.centre + object.radii * direction;
        surface.normal = glm::normalize(direction / object.radii);
        surface.spacing = std::sqrt(total_area() / ((1 - kBackdropShare) * splats_));
        surface.color = object.color + 0.15 * glm::dvec3(u[2] - 0.5, u[3] - 0.5, u[2] - u[3]);
        return surface;
    }

    std::vector<Object> objects_;
    std::vector<double> areas_;  // running sums
    Backdrop backdrop_;
    double splats_;
};

double opacity_logit(const Style& style, uint32_t i) {
    const auto u = uniform(kOpacity, i);
    const auto between = [&](double low, double high) {
        const double opacity = low + (high - low) * u[1];
        return std::log(opacity / (1 - opacity));
    };
    if (u[0] < style.opacity_shares[0]) return between(0.03, 0.15);
    if (u[0] < style.opacity_shares[0] + style.opacity_shares[1]) return between(0.2, 0.8);
    return between(0.9, 0.99);
}

void write_splat(Gaussians& g, uint32_t i, const Surface& surface, const Style& style, const Camera& camera) {
    const glm::dmat3 to_world = glm::transpose(camera.rotation);
    const glm::dvec3 mean = to_world * (surface.point - camera.translation);
    const auto spin = uniform(kSpin, i);
    const auto q = quaternion_to(to_world * surface.normal, 2 * std::numbers::pi * spin[0]);
    const auto shape = normal(kShape, i);
    const double base = std::log(style.size * surface.spacing) + style.size_spread * shape[0];
    const double log_scales[3] = {base + 0.3 * shape[1], base - 0.3 * shape[1], base - 2 + 0.3 * shape[2]};
    for (int k = 0; k < 3; ++k) {
        g.means[3 * i + k] = float(mean[k]);
        g.log_scales[3 * i + k] = float(log_scales[k]);
    }
    for (int k = 0; k < 4; ++k) g.quaternions[4 * i + k] = float(q[size_t(k)]);
    g.opacity_logits[i] = float(opacity_logit(style, i));

    const auto tint = normal(kColor, i);
    float* sh = &g.sh[i * g.sh_stride()];
    for (int c = 0; c < 3; ++c)
        sh[c] = float((surface.color[c] + 0.05 * tint[size_t(c)] - shared::COLOR_OFFSET) / shared::SH_C0);
    for (uint32_t j = 1; j < uint32_t(sh_coefficients(g.sh_degree)); ++j) {
        const auto wave = normal(kSh, i, j);
        for (int c = 0; c < 3; ++c) sh[3 * j + c] = float(0.05 * wave[size_t(c)]);
    }
}

Image training_image(int width, int height) {
    Image image(width, height, 3);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const auto grain = uniform(kPlace, uint32_t(y) * uint32_t(width) + uint32_t(x), 7);
            for (int c = 0; c < 3; ++c) {
                const double wave = 0.5 + 0.3 * std::sin(0.021 * (c + 1) * x + 0.5 * c) * std::cos(0.017 * y);
                image.at(x, y)[c] = float(std::round(255 * (wave + 0.2 * (grain[size_t(c)] - 0.5)))) / 255.0f;
            }
        }
    return image;
}

}  // namespace

const char* name_of(Kind kind) {
    return kKindNames[int(kind)];
}

std::vector<Case> all_cases() {
    std::vector<Case> cases;
    const auto add = [&](Layout layout, uint32_t splats, int width, int height, int sh_degree, bool train,
                         bool large = false) {
        cases.push_back(frame_case(Kind::forward, layout, splats, width, height, sh_degree, large));
        if (train) cases.push_back(frame_case(Kind::train, layout, splats, width, height, sh_degree, large));
    };
    add(Layout::capture, 2000, 64, 48, 1, true);  // for tests: fast on any device
    add(Layout::capture, 14000, 270, 480, 3, true);
    add(Layout::capture, 70000, 270, 480, 3, true);
    for (const auto& [width, height] : {std::pair{960, 540}, {1920, 1080}}) {
        for (const uint32_t splats : {10000u, 30000u, 100000u, 300000u, 1000000u})
            add(Layout::cloud, splats, width, height, 3, splats <= 100000u);
        add(Layout::cloud, 2000000, width, height, 3, false, true);
    }
    add(Layout::cloud, 100000, 960, 540, 0, true);
    add(Layout::cloud, 1000000, 1920, 1080, 0, false);
    add(Layout::sparse, 100000, 960, 540, 0, true);
    add(Layout::dense, 100000, 960, 540, 0, true);
    add(Layout::cloud, 100000, 3840, 2160, 3, false);
    cases.push_back(frame_case(Kind::train, Layout::cloud, 100000, 3840, 2160, 3, true));
    cases.push_back(frame_case(Kind::train, Layout::cloud, 1000000, 1920, 1080, 3, true));
    cases.push_back({"sort_1m", Kind::sort, {}, 1000000, 0, 0, 0, false});
    cases.push_back(frame_case(Kind::update, Layout::cloud, 100000, 960, 540, 3, false));
    cases.push_back(frame_case(Kind::update, Layout::cloud, 100000, 960, 540, 0, false));
    cases.push_back({"first_step", Kind::first_step, Layout::capture, 14000, 270, 480, 3, false});
    return cases;
}

bool name_matches(const std::string& name, const std::string& patterns) {
    std::istringstream words(patterns);
    for (std::string word; std::getline(words, word, ',');)
        if (!word.empty() && matches(name, word)) return true;
    return false;
}

std::vector<Case> select_cases(const std::string& patterns, bool large) {
    const bool all = patterns.find_first_not_of(',') == std::string::npos;
    std::vector<Case> selected;
    for (const Case& one : all_cases())
        if (all ? large || !one.large : name_matches(one.name, patterns)) selected.push_back(one);
    if (selected.empty()) throw InputError("no case matches '" + patterns + "'; --list names them all");
    return selected;
}

BenchScene make_scene(const Case& one) {
    BenchScene scene;
    scene.camera = camera_of(one);
    scene.gaussians.sh_degree = one.sh_degree;
    scene.gaussians.resize(one.splats);
    const Style& style = kStyles[int(one.layout)];
    const Surfaces surfaces(style, scene.camera, one.splats);
    for (uint32_t i = 0; i < one.splats; ++i)
        write_splat(scene.gaussians, i, surfaces.point(i), style, scene.camera);
    select_splats(scene.gaussians, morton_order(scene.gaussians));
    if (one.kind == Kind::train || one.kind == Kind::update || one.kind == Kind::first_step)
        scene.image = training_image(one.width, one.height);
    return scene;
}

}  // namespace ewa::bench
