// SPDX-License-Identifier: Apache-2.0
#include "reference/rays.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_access.hpp>
#include <glm/matrix.hpp>
#include <numbers>

#include "scene/native_lens.h"
#include "shared/constants.h"

namespace ewa::reference {
namespace {

double share_below(double y) {
    return 0.5 * std::erfc(-y * std::numbers::sqrt2 / 2);
}

/// The same of an even distribution with the same standard deviation.
double spread_below(double y) {
    return std::clamp(0.5 + y / std::sqrt(12), 0.0, 1.0);
}

double normal_density(double y) {
    return std::exp(-0.5 * y * y) / std::sqrt(2 * std::numbers::pi);
}

/// (1 - exp(-x)) / x, and its derivative.
double mean_transmittance(double x) {
    return std::abs(x) < 1e-12 ? 1 : -std::expm1(-x) / x;
}
double mean_transmittance_slope(double x) {
    return std::abs(x) < 1e-4 ? -0.5 + x / 3 - x * x / 8 : (std::exp(-x) - mean_transmittance(x)) / x;
}

/// The smallest optical depth of a ray that a march counts.
double march_floor(const Smoothing& smoothing) {
    return smoothing.cut == AlphaCut::none ? 1e-18 : shared::MARCH_DEPTH_MIN;
}

RenderOptions with_peak(RenderOptions options) {
    options.kernel = Footprint::peak;
    return options;
}

}  // namespace

Rays::Rays(const Values& values, const Camera& camera, const RenderOptions& options,
           const Smoothing& smoothing, const Rays* fixed)
    : values_(values),
      camera_(camera),
      options_(options),
      smoothing_(smoothing),
      fixed_(fixed),
      by_distance_(scene::ordered_by_distance(camera.distortion.lens)),
      lens_limit_(scene::lens_limit(camera)) {
    const RenderOptions peak = with_peak(options);
    for (size_t i = 0; i < values.size(); ++i) {
        const Splat splat = read_splat(values, i);
        ProjectionSteps steps;
        projected_.push_back(project(splat, camera, peak, &steps));
        if (!projected_.back().visible) continue;
        Member m;
        m.splat = uint32_t(i);
        m.scale = steps.scale;
        m.full_depth = softplus(splat.opacity_logit);
        if (options.kernel == Footprint::density)
            m.full_depth *= mean_shadow(m.scale) / (m.scale.x * m.scale.y * m.scale.z);
        else
            m.full_depth = std::min(m.full_depth, -std::log1p(-shared::ALPHA_MAX));
        if (options.kernel == Footprint::antialias) widen(m, splat, steps.rotation, steps.offset);
        m.whitener = glm::transpose(steps.rotation);
        for (int k = 0; k < 3; ++k)
            for (int j = 0; j < 3; ++j) m.whitener[j][k] /= m.scale[k];  // row k over scale k
        m.a = m.whitener * -steps.offset;
        m.color = projected_.back().color;
        members_.push_back(m);
    }
}

void Rays::widen(Member& m, const Splat& splat, const glm::dmat3& axes, const glm::dvec3& mean) const {
    Widening& w = m.widening;
    w.own = m.scale;
    w.mean = glm::transpose(axes) * mean;
    w.depth = by_distance_ ? glm::length(mean) : (camera_.rotation * mean).z;
    w.deeper = by_distance_ ? mean / w.depth : glm::row(camera_.rotation, 2);
    w.squared = shared::LOW_PASS_ANTIALIAS * w.depth * w.depth / (camera_.fx * camera_.fy);
    const auto shadow = [&](const glm::dvec3& s) { return s.x * s.y * s.z * glm::length(w.mean / s); };
    for (int k = 0; k < 3; ++k) m.scale[k] = std::sqrt(w.own[k] * w.own[k] + w.squared);
    const double opacity = 1 / (1 + std::exp(-splat.opacity_logit));
    w.opacity = std::min(opacity, shared::ALPHA_MAX) * shadow(w.own) / shadow(m.scale);
    m.full_depth = -std::log1p(-w.opacity);
}

std::optional<glm::dvec3> Rays::view_of(int x, int y) const {
    const glm::dvec2 pixel = pixel_centre(x, y);
    const auto ray = scene::ray_of(camera_, lens_limit_, pixel.x, pixel.y);
    if (!ray) return std::nullopt;
    return by_distance_ ? ray->direction : ray->direction / ray->direction.z;
}

std::vector<Rays::Met> Rays::met(int x, int y, double least) const {
    std::vector<Met> line;
    const auto seen = view_of(x, y);
    if (!seen) return line;
    const glm::dvec3 view = *seen, direction = glm::transpose(camera_.rotation) * view;
    for (size_t i = 0; i < members_.size(); ++i) {
        const Member& m = members_[i];
        const glm::dvec3 b = m.whitener * direction, normal = glm::cross(m.a, b);
        const double bb = glm::dot(b, b), length = std::sqrt(bb);
        const double factor = options_.kernel == Footprint::density ? glm::length(view) / length : 1;
        Met met;
        met.depth = m.full_depth * factor * std::exp(-0.5 * glm::dot(normal, normal) / bb);
        if (!(met.depth >= least)) continue;
        met.member = i;
        met.middle = -glm::dot(m.a, b) / bb;
        met.sharpness = length;
        met.across = glm::cross(b, normal) / bb;
        met.along = b / length;
        line.push_back(met);
    }
    return line;
}

std::vector<Rays::Met> Rays::met_in_order(int x, int y) const {
    std::vector<Met> line = met(x, y, -std::log1p(-alpha_floor(smoothing_)));
    std::erase_if(line, [](const Met& m) { return !(m.middle > shared::NEAR_PLANE); });
    const bool by_mean = options_.integrator == Integrator::fast_ray;
    std::stable_sort(line.begin(), line.end(), [&](const Met& p, const Met& q) {
        if (by_mean) return projected_[members_[p.member].splat].z < projected_[members_[q.member].splat].z;
        return p.middle < q.middle;
    });
    return line;
}

template <class Visit>
double Rays::walk(int x, int y, Visit visit) const {
    double transmittance = 1;
    for (const Met& m : met_in_order(x, y)) {
        const Alpha alpha = alpha_of(-std::expm1(-m.depth), smoothing_);
        if (!alpha.kept) continue;
        const double next = transmittance * (1 - alpha.value);
        if (smoothing_.transmittance_stop && stops(next)) break;
        visit(m, alpha, transmittance);
        transmittance = next;
    }
    return transmittance;
}

std::vector<double> Rays::borders(int x, int y) const {
    if (fixed_) return fixed_->borders(x, y);
    constexpr uint32_t kBins = shared::MARCH_BINS;
    const double near = shared::NEAR_PLANE;
    const std::vector<Met> line = met(x, y, march_floor(smoothing_));
    double first = INFINITY, last = 0;
    for (const Met& m : line) {
        const double reach = shared::MARCH_BIN_REACH / m.sharpness;
        if (!(m.middle + reach > near)) continue;
        first = std::min(first, std::max(m.middle - reach, near));
        last = std::max(last, m.middle + reach);
    }
    if (!(last > 0)) return {};
    const double step = std::log(last / first) / kBins;
    double reached[kBins + 1] = {};
    for (uint32_t b = 1; b <= kBins; ++b) {
        const double at = first * std::exp(step * b);
        for (const Met& m : line)
            reached[b] += m.depth * (spread_below((at - m.middle) * m.sharpness) -
                                     spread_below((near - m.middle) * m.sharpness));
        reached[b] = -std::expm1(-0.5 * reached[b]);
    }
    std::vector<double> borders{near};
    for (int j = 1; j < options_.samples; ++j) {
        const double wanted = reached[kBins] * j / options_.samples;
        double bins = 0;
        for (uint32_t b = 0; b < kBins; ++b)
            bins +=
                std::clamp((wanted - reached[b]) / std::max(reached[b + 1] - reached[b], 1e-12), 0.0, 1.0);
        borders.push_back(first * std::exp(step * bins));
    }
    borders.push_back(INFINITY);
    return borders;
}

template <class Visit>
double Rays::march(const std::vector<Met>& line, const std::vector<double>& borders, Visit visit) const {
    double transmittance = 1;
    std::vector<double> before(line.size());
    for (size_t j = 0; j < borders.size(); ++j) {
        double depth = 0;
        glm::dvec3 emitted(0);
        for (size_t i = 0; i < line.size(); ++i) {
            const double share = share_below((borders[j] - line[i].middle) * line[i].sharpness);
            if (j > 0) {
                depth += line[i].depth * (share - before[i]);
                emitted += line[i].depth * (share - before[i]) * members_[line[i].member].color;
            }
            before[i] = share;
        }
        if (j == 0) continue;
        visit(j - 1, depth, emitted, transmittance);
        transmittance *= std::exp(-depth);
    }
    return transmittance;
}

Blended Rays::blended() const {
    const Raster plane(camera_.width, camera_.height, 1);
    const std::vector<uint32_t> counts(plane.values.size());
    Blended out{Raster(camera_.width, camera_.height, 3), plane, plane, plane, counts, counts};
    for (int y = 0; y < camera_.height; ++y)
        for (int x = 0; x < camera_.width; ++x) {
            glm::dvec3 color(0);
            double left = 1, depth = 0;
            if (options_.integrator != Integrator::march)
                left = walk(x, y, [&](const Met& m, const Alpha& alpha, double transmittance) {
                    color += alpha.value * transmittance * members_[m.member].color;
                    depth += alpha.value * transmittance * m.middle;
                    ++out.blended[size_t(y) * size_t(camera_.width) + size_t(x)];
                });
            else
                left = march(met(x, y, march_floor(smoothing_)), borders(x, y),
                             [&](size_t, double d, const glm::dvec3& emitted, double transmittance) {
                                 color += transmittance * mean_transmittance(d) * emitted;
                             });
            for (int k = 0; k < 3; ++k)
                out.color.at(x, y)[k] = color[k] + left * options_.background[size_t(k)];
            *out.transmittance.at(x, y) = left;
            *out.depth_sum.at(x, y) = depth;
            *out.depth.at(x, y) = left < 1 ? depth / (1 - left) : 0;
        }
    return out;
}

void Rays::add(Sums& sums, const Met& m, double g, double s1, double s2) const {
    const double share = options_.kernel == Footprint::density ? 1 : 0;
    sums.w += -g * glm::outerProduct(m.across, m.across) +
              s1 * (glm::outerProduct(m.along, m.across) + glm::outerProduct(m.across, m.along)) +
              (s2 - share * g) * glm::outerProduct(m.along, m.along);
    sums.v += -g * m.across + s1 * m.along;
    sums.depth += g;
}

void Rays::ray_gradient(int x, int y, const glm::dvec3& up, std::vector<Sums>& sums) const {
    const glm::dvec3 background(options_.background[0], options_.background[1], options_.background[2]);
    glm::dvec3 behind(0);
    const double left = walk(x, y, [&](const Met& m, const Alpha& alpha, double transmittance) {
        behind += alpha.value * transmittance * members_[m.member].color;
    });
    behind += left * background;
    walk(x, y, [&](const Met& m, const Alpha& alpha, double transmittance) {
        const glm::dvec3& color = members_[m.member].color;
        const double weight = alpha.value * transmittance;
        behind -= weight * color;
        const double by_alpha = glm::dot(up, transmittance * color - behind / (1 - alpha.value));
        add(sums[m.member], m, by_alpha * alpha.slope * m.depth * std::exp(-m.depth), 0, 0);
        sums[m.member].color += weight * up;
    });
}

void Rays::march_gradient(int x, int y, const glm::dvec3& up, std::vector<Sums>& sums) const {
    const glm::dvec3 background(options_.background[0], options_.background[1], options_.background[2]);
    const std::vector<Met> line = met(x, y, march_floor(smoothing_));
    const std::vector<double> borders = this->borders(x, y);
    glm::dvec3 behind(0);
    const double left =
        march(line, borders, [&](size_t, double d, const glm::dvec3& emitted, double transmittance) {
            behind += transmittance * mean_transmittance(d) * emitted;
        });
    behind += left * background;
    // dL/d(d_ij) = by_depth_j + by_emitted_j . c_i
    std::vector<double> by_depth(borders.size());
    std::vector<glm::dvec3> by_emitted(borders.size(), glm::dvec3(0));
    march(line, borders, [&](size_t j, double d, const glm::dvec3& emitted, double transmittance) {
        behind -= transmittance * mean_transmittance(d) * emitted;
        by_emitted[j] = transmittance * mean_transmittance(d) * up;
        by_depth[j] = glm::dot(up, transmittance * mean_transmittance_slope(d) * emitted - behind);
    });
    for (const Met& m : line) {
        Sums& own = sums[m.member];
        double g = 0, s1 = 0, s2 = 0, last = 0, before = 0;
        for (size_t j = 0; j < borders.size(); ++j) {
            const double at = (borders[j] - m.middle) * m.sharpness, share = share_below(at);
            if (j > 0) {
                g += last * (share - before);
                own.color += m.depth * (share - before) * by_emitted[j - 1];
            }
            const double next =
                j + 1 < borders.size()
                    ? m.depth * (by_depth[j] + glm::dot(by_emitted[j], members_[m.member].color))
                    : 0;
            const double moved = std::isinf(at) ? 0 : (last - next) * normal_density(at);
            s1 += moved;
            s2 += std::isinf(at) ? 0 : moved * at;
            last = next;
            before = share;
        }
        add(own, m, g, s1, s2);
    }
}

void Rays::narrow(const Member& m, const glm::dmat3& axes, double by_opacity, Splat& gradient,
                  glm::dvec3& torque) const {
    const Widening& w = m.widening;
    const glm::dvec3 shares = w.mean * w.mean / (w.own * w.own),
                     wider = w.mean * w.mean / (m.scale * m.scale);
    const double all = shares.x + shares.y + shares.z, all_wider = wider.x + wider.y + wider.z;
    glm::dvec3 turned(0);
    double by_width = 0;
    for (int k = 0; k < 3; ++k) {
        const double by_wider = gradient.log_scale[k] + by_opacity * (wider[k] / all_wider - 1);
        const double narrower = w.own[k] * w.own[k] / (m.scale[k] * m.scale[k]);
        gradient.log_scale[k] = narrower * by_wider + by_opacity * (1 - shares[k] / all);
        by_width += (1 - narrower) * by_wider;
        turned[k] = by_opacity * w.mean[k] *
                    (1 / (w.own[k] * w.own[k] * all) - 1 / (m.scale[k] * m.scale[k] * all_wider));
    }
    torque += glm::cross(turned, w.mean);
    gradient.mean += axes * turned + by_width / w.depth * w.deeper;
}

Splat Rays::splat_gradient(const Member& m, const Sums& sums) const {
    const Splat splat = read_splat(values_, m.splat);
    ScreenGradient by_color;
    by_color.color = sums.color;
    Splat out = project_backward(splat, camera_, with_peak(options_), by_color);
    const double norm = robust_norm(splat.quaternion);
    std::array<double, 4> q = splat.quaternion;
    for (double& each : q) each /= norm;
    const glm::dmat3 axes = rotation_matrix(q);
    out.mean += -glm::transpose(m.whitener) * sums.v;
    glm::dvec3 torque(0);
    const glm::dvec3& s = m.scale;
    for (int k = 0; k < 3; ++k) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        out.log_scale[k] = -sums.w[k][k];
        torque[k] = (s[j] / s[i] - s[i] / s[j]) * sums.w[i][j];
    }
    const double sigmoid = 1 / (1 + std::exp(-splat.opacity_logit));
    const double depth = softplus(splat.opacity_logit);
    out.opacity_logit = sums.depth * sigmoid / depth;
    if (options_.kernel == Footprint::antialias) {
        const double peak = m.widening.opacity, by_opacity = sums.depth * peak / (1 - peak) / m.full_depth;
        narrow(m, axes, by_opacity, out, torque);
        out.opacity_logit = sigmoid > shared::ALPHA_MAX ? 0 : by_opacity * (1 - sigmoid);
    } else if (options_.kernel == Footprint::density) {
        const glm::dvec3 areas(s.y * s.y * s.z * s.z, s.z * s.z * s.x * s.x, s.x * s.x * s.y * s.y);
        const double all = areas.x + areas.y + areas.z;
        for (int k = 0; k < 3; ++k) out.log_scale[k] += sums.depth * ((all - areas[k]) / all - 1);
    } else if (sigmoid > shared::ALPHA_MAX) {
        out.opacity_logit = 0;
    }
    // A rotation by small angles w about the splat's own axes is q (1, w / 2).
    const glm::dvec3 vector(q[1], q[2], q[3]);
    const glm::dvec3 turned = q[0] * torque + glm::cross(vector, torque);
    out.quaternion = {-2 * glm::dot(vector, torque) / norm, 2 * turned.x / norm, 2 * turned.y / norm,
                      2 * turned.z / norm};
    return out;
}

Values Rays::gradient(const Raster& image_gradient) const {
    std::vector<Sums> sums(members_.size());
    for (int y = 0; y < camera_.height; ++y)
        for (int x = 0; x < camera_.width; ++x) {
            const double* up = image_gradient.at(x, y);
            if (options_.integrator != Integrator::march)
                ray_gradient(x, y, {up[0], up[1], up[2]}, sums);
            else
                march_gradient(x, y, {up[0], up[1], up[2]}, sums);
        }
    Values out = zeros_like(values_);
    for (size_t i = 0; i < members_.size(); ++i)
        write_splat(out, members_[i].splat, splat_gradient(members_[i], sums[i]));
    return out;
}

std::vector<uint8_t> Rays::at_threshold(double relative) const {
    std::vector<uint8_t> at(size_t(camera_.width) * size_t(camera_.height));
    if (options_.integrator == Integrator::march) return at;
    // A middle is one quotient: float32 is nearer to it than to an alpha.
    constexpr double kOrderShare = 0.05;
    const auto near = [&](double value, double threshold) {
        return std::abs(value - threshold) <= relative * threshold;
    };
    for (int y = 0; y < camera_.height; ++y)
        for (int x = 0; x < camera_.width; ++x) {
            double transmittance = 1, middle = 0;
            bool hangs = false;
            for (const Met& m : met(x, y, 0.5 * shared::ALPHA_MIN)) {
                const double raw = -std::expm1(-m.depth);
                hangs = hangs || near(raw, shared::ALPHA_MIN) || near(m.middle, shared::NEAR_PLANE);
            }
            for (const Met& m : met_in_order(x, y)) {
                const double raw = -std::expm1(-m.depth);
                const double next = transmittance * (1 - std::min(raw, shared::ALPHA_MAX));
                const bool exact = stops(next) && raw > shared::ALPHA_MAX;
                const bool order = options_.integrator == Integrator::ray &&
                                   std::abs(m.middle - middle) <= kOrderShare * relative * middle;
                hangs = hangs || order || near(raw, shared::ALPHA_MAX) ||
                        (!exact && near(next, shared::TRANSMITTANCE_STOP));
                if (stops(next)) break;
                transmittance = next;
                middle = m.middle;
            }
            at[size_t(y) * size_t(camera_.width) + size_t(x)] = hangs;
        }
    return at;
}

}  // namespace ewa::reference
