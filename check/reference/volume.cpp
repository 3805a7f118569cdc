// SPDX-License-Identifier: Apache-2.0
#include "reference/volume.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <numbers>

#include "reference/blend.h"
#include "shared/constants.h"

namespace ewa::reference {
namespace {

constexpr double kReach = 6;  // standard deviations; only 1e-9 of a splat is beyond

double normal_cdf(double x) {
    return 0.5 * std::erfc(-x * std::numbers::sqrt2 / 2);
}

/// The optical depth of a splat between two distances.
double depth_between(const RayGaussian& g, double from, double to) {
    return g.depth * (normal_cdf((to - g.middle) / g.sigma) - normal_cdf((from - g.middle) / g.sigma));
}

double density(const RayGaussian& g, double t) {
    const double u = (t - g.middle) / g.sigma;
    return std::abs(u) > kReach
               ? 0
               : g.depth * std::exp(-0.5 * u * u) / (g.sigma * std::sqrt(2 * std::numbers::pi));
}

/// The whitener of the covariance plus `variance` in the plane across `direction`: any root of the inverse will do.
glm::dmat3 widened(const glm::dmat3& rotation, const glm::dvec3& scale, double variance,
                   const glm::dvec3& direction) {
    glm::dmat3 sigma = glm::dmat3(variance) - variance * glm::outerProduct(direction, direction);
    for (int k = 0; k < 3; ++k) sigma += scale[k] * scale[k] * glm::outerProduct(rotation[k], rotation[k]);
    // Sigma = L L^T by Cholesky, and the whitener is L^-1.
    glm::dmat3 l(0);
    for (int column = 0; column < 3; ++column)
        for (int row = column; row < 3; ++row) {
            double rest = sigma[column][row];
            for (int k = 0; k < column; ++k) rest -= l[k][row] * l[k][column];
            l[column][row] = row == column ? std::sqrt(rest) : rest / l[column][column];
        }
    return glm::inverse(l);
}

/// The footprint without its low-pass.
Projected narrowed(Projected p, const ProjectionSteps& steps) {
    p.a -= shared::LOW_PASS;
    p.c -= shared::LOW_PASS;
    p.det = steps.det0;
    return p;
}

/// Borders of the quadrature's intervals: the integrand changes shape a few deviations from a splat.
std::vector<double> borders_of(const std::vector<RayGaussian>& line, double near) {
    std::vector<double> borders{near};
    for (const RayGaussian& g : line)
        for (const double k : {-6.0, -4.0, -2.5, -1.25, 0.0, 1.25, 2.5, 4.0, 6.0})
            if (g.middle + k * g.sigma > near) borders.push_back(g.middle + k * g.sigma);
    std::sort(borders.begin(), borders.end());
    return borders;
}

}  // namespace

Volume::Volume(const Values& values, const Camera& camera, const RenderOptions& options,
               const Approximations& approximations)
    : camera_(camera),
      background_(options.background[0], options.background[1], options.background[2]),
      kernel_(options.kernel),
      approximations_(approximations),
      columns_((camera.width + kTile - 1) / kTile),
      rows_((camera.height + kTile - 1) / kTile),
      tiles_(size_t(columns_) * size_t(rows_)) {
    RenderOptions peak = options;
    peak.kernel = Footprint::peak;
    for (size_t i = 0; i < values.size(); ++i) {
        const Splat splat = read_splat(values, i);
        ProjectionSteps steps;
        const Projected projected = project(splat, camera, peak, &steps);
        if (!projected.visible) continue;
        members_.push_back(member_of(splat, projected, steps));
        list(uint32_t(members_.size() - 1), projected,
             std::max({steps.scale.x, steps.scale.y, steps.scale.z}));
    }
}

Volume::Member Volume::member_of(const Splat& splat, const Projected& projected,
                                 const ProjectionSteps& steps) const {
    Member m;
    m.mean = steps.offset;
    m.z = projected.z;
    m.color = projected.color;
    m.opacity = steps.sigmoid;
    const double z2 = m.z * m.z;
    if (approximations_.low_pass && !approximations_.affine) {
        m.whitener = widened(steps.rotation, steps.scale, shared::LOW_PASS * z2 / (camera_.fx * camera_.fy),
                             glm::normalize(m.mean));
    } else {
        m.whitener = glm::transpose(steps.rotation);
        for (int k = 0; k < 3; ++k)
            for (int j = 0; j < 3; ++j) m.whitener[j][k] /= steps.scale[k];  // row k over scale k
    }
    m.footprint = approximations_.low_pass ? projected : narrowed(projected, steps);
    if (kernel_ != Footprint::density) {
        m.full_depth = -std::log1p(-std::min(steps.sigmoid, shared::ALPHA_MAX));
        return m;
    }
    // The mass over 2 pi, times the determinant of the whitener: over |b|, that is mass over shadow.
    const double mass = softplus(splat.opacity_logit) * mean_shadow(steps.scale);
    m.full_depth = mass * std::abs(glm::determinant(m.whitener));
    if (approximations_.affine) {
        // Zwicker et al. 2001: the Jacobian of ray space, over the footprint.
        const double jacobian =
            camera_.fx * camera_.fy / z2 * std::sqrt(1 + glm::dot(steps.slope, steps.slope));
        m.full_depth = mass * jacobian / std::sqrt(m.footprint.det);
    }
    return m;
}

void Volume::list(uint32_t member, const Projected& p, double size) {
    // If perspective bends a splat's outline, its linear footprint is too small. Every tile lists it.
    const bool bent = kReach * size > 0.25 * p.z;
    const double x = 1.35 * kReach * std::sqrt(p.a) + 1, y = 1.35 * kReach * std::sqrt(p.c) + 1;
    const auto tile = [](double px, int count) {
        return int(std::clamp(std::floor(px / kTile), 0.0, double(count - 1)));
    };
    if (!bent && (p.mean2d.x + x < 0 || p.mean2d.y + y < 0 || p.mean2d.x - x > camera_.width ||
                  p.mean2d.y - y > camera_.height))
        return;
    const int left = bent ? 0 : tile(p.mean2d.x - x, columns_),
              right = bent ? columns_ - 1 : tile(p.mean2d.x + x, columns_);
    const int top = bent ? 0 : tile(p.mean2d.y - y, rows_),
              bottom = bent ? rows_ - 1 : tile(p.mean2d.y + y, rows_);
    for (int row = top; row <= bottom; ++row)
        for (int column = left; column <= right; ++column)
            tiles_[size_t(row) * size_t(columns_) + size_t(column)].push_back(member);
}

double Volume::near_along(double x, double y, glm::dvec3& direction) const {
    const glm::dvec3 view((x - camera_.cx) / camera_.fx, (y - camera_.cy) / camera_.fy, 1);
    const double length = glm::length(view);
    direction = glm::transpose(camera_.rotation) * (view / length);
    return shared::NEAR_PLANE * length;
}

double Volume::optical_depth(const Member& m, double bb, double gaussian) const {
    const bool density = kernel_ == Footprint::density;
    if (approximations_.formula && !density)
        return -std::log1p(-std::min(m.opacity * gaussian, shared::ALPHA_MAX));
    const bool per_chord = density && !approximations_.affine;
    return (per_chord ? m.full_depth / std::sqrt(bb) : m.full_depth) * gaussian;
}

std::vector<RayGaussian> Volume::along(double x, double y, double least) const {
    std::vector<RayGaussian> line;
    glm::dvec3 direction;
    const double near = near_along(x, y, direction);
    const size_t tile = size_t(std::clamp(int(y) / kTile, 0, rows_ - 1)) * size_t(columns_) +
                        size_t(std::clamp(int(x) / kTile, 0, columns_ - 1));
    if (approximations_.cut_off) least = -std::log1p(-shared::ALPHA_MIN);
    for (const uint32_t i : tiles_[tile]) {
        const Member& m = members_[i];
        const glm::dvec3 a = m.whitener * -m.mean, b = m.whitener * direction;
        const double bb = glm::dot(b, b);
        const glm::dvec3 across = glm::cross(a, b);
        double power = -0.5 * glm::dot(across, across) / bb;
        if (approximations_.affine) {
            const Sample flat = sample(m.footprint, whitener(m.footprint), {x, y});
            power = -0.5 * (flat.u * flat.u + flat.v * flat.v);
        }
        const double depth = optical_depth(m, bb, std::exp(power));
        if (!(depth >= least)) continue;
        RayGaussian g{depth, -glm::dot(a, b) / bb, 1 / std::sqrt(bb), m.color};
        // near is the distance of a view depth of NEAR_PLANE.
        if (approximations_.order) g.middle = m.z * near / shared::NEAR_PLANE;
        if (g.middle + kReach * g.sigma > near) line.push_back(g);
    }
    std::stable_sort(line.begin(), line.end(),
                     [](const auto& p, const auto& q) { return p.middle < q.middle; });
    return line;
}

glm::dvec3 Volume::composited(const std::vector<RayGaussian>& line) const {
    glm::dvec3 color(0);
    double transmittance = 1;
    for (const RayGaussian& g : line) {
        const double alpha = -std::expm1(-g.depth);
        const double next = transmittance * (1 - alpha);
        if (approximations_.cut_off && next <= shared::TRANSMITTANCE_STOP) break;
        color += transmittance * alpha * g.color;
        transmittance = next;
    }
    return color + transmittance * background_;
}

glm::dvec3 Volume::exact(double x, double y) const {
    glm::dvec3 direction;
    const double near = near_along(x, y, direction);
    const std::vector<RayGaussian> line = along(x, y);
    if (approximations_.overlap) return composited(line);
    const std::vector<double> borders = borders_of(line, near);
    static constexpr double kNodes[] = {0.06943184420297371, 0.33000947820757187, 0.6699905217924281,
                                        0.9305681557970262};
    static constexpr double kWeights[] = {0.17392742256872692, 0.32607257743127308, 0.32607257743127308,
                                          0.17392742256872692};
    glm::dvec3 color(0);
    double passed = 0;  // optical depth before the interval
    std::vector<const RayGaussian*> here;
    for (size_t i = 0; i + 1 < borders.size() && passed < 30; ++i) {
        const double from = borders[i], to = borders[i + 1];
        if (!(to > from)) continue;
        here.clear();
        for (const RayGaussian& g : line)
            if (g.middle - kReach * g.sigma < to && g.middle + kReach * g.sigma > from) here.push_back(&g);
        if (here.empty()) continue;
        for (int n = 0; n < 4; ++n) {
            const double t = from + (to - from) * kNodes[n];
            double depth = passed;
            glm::dvec3 emitted(0);
            for (const RayGaussian* g : here) {
                depth += depth_between(*g, from, t);
                emitted += density(*g, t) * g->color;
            }
            color += (to - from) * kWeights[n] * std::exp(-depth) * emitted;
        }
        for (const RayGaussian* g : here) passed += depth_between(*g, from, to);
    }
    return color + std::exp(-passed) * background_;
}

glm::dvec3 Volume::marched(double x, double y, int samples) const {
    glm::dvec3 direction;
    const double near = near_along(x, y, direction);
    const std::vector<RayGaussian> line = along(x, y, shared::ALPHA_MIN);
    double first = INFINITY, last = near;
    for (const RayGaussian& g : line) {
        first = std::min(first, std::max(near, g.middle - 3 * g.sigma));
        last = std::max(last, g.middle + 3 * g.sigma);
    }
    glm::dvec3 color(0);
    double transmittance = 1;
    const double step = (last - first) / samples;
    for (int k = 0; k < samples && !line.empty() && transmittance > shared::TRANSMITTANCE_STOP; ++k) {
        const double t = first + (k + 0.5) * step;
        double sum = 0;
        glm::dvec3 emitted(0);
        for (const RayGaussian& g : line) {
            const double rho = density(g, t);
            sum += rho;
            emitted += rho * g.color;
        }
        if (!(sum > 0)) continue;
        const double alpha = -std::expm1(-sum * step);
        color += transmittance * alpha / sum * emitted;
        transmittance *= 1 - alpha;
    }
    return color + transmittance * background_;
}

}  // namespace ewa::reference
