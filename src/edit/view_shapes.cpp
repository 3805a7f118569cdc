// SPDX-License-Identifier: Apache-2.0
#include "edit/view_shapes.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat2x2.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <optional>

#include "core/parallel.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "scene/splat_shape.h"
#include "shared/constants.h"

namespace ewa::edit {
namespace {

constexpr double kExtent = 2;  // standard deviations that belong to a splat, with ;extent
constexpr double kFar = std::numeric_limits<double>::infinity();

/// A pinhole, or parallel rays.
struct View {
    double fx = 1, fy = 1, cx = 0, cy = 0;
    glm::dmat3 rotation{1.0};
    glm::dvec3 translation{0.0};
    bool parallel = false;
};

/// A splat in the image of a view.
struct Seen {
    glm::dvec2 at{0};
    double depth = 0;            // camera z
    glm::dmat2 covariance{0.0};  // squared px; zero unless it is asked for
    double deviation = 0;        // the largest, world units
};

struct Bounds {
    glm::dvec2 low{kFar}, high{-kFar};
    void add(const glm::dvec2& p) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    bool has(const glm::dvec2& p, double margin = 0) const {
        return p.x >= low.x - margin && p.x <= high.x + margin && p.y >= low.y - margin &&
               p.y <= high.y + margin;
    }
};

struct Region {
    std::vector<glm::dvec2> points;
    std::optional<double> brush;  // radius, px; empty: a polygon
    Bounds bounds;
    View view;
    bool front = false, extent = false;
};

/// Empty behind the near plane, and where a value is not finite.
std::optional<Seen> seen_splat(const Gaussians& g, size_t i, const View& view, bool shape) {
    const glm::dvec3 p = view.rotation * g.world_mean(i) + view.translation;
    if (!(p.z > double(shared::NEAR_PLANE) && std::isfinite(p.x + p.y + p.z))) return std::nullopt;
    Seen seen;
    const double scale = view.parallel ? 1 : 1 / p.z;
    seen.at = {view.fx * p.x * scale + view.cx, view.fy * p.y * scale + view.cy};
    seen.depth = p.z;
    if (!std::isfinite(seen.at.x + seen.at.y)) return std::nullopt;
    if (!shape) return seen;
    if (!drawable(g, i)) return std::nullopt;
    const glm::dmat3 covariance = view.rotation * scene::covariance_of(g, i) * glm::transpose(view.rotation);
    // The rows of the projection's Jacobian.
    const glm::dvec3 x(view.fx * scale, 0, view.parallel ? 0 : -view.fx * p.x * scale * scale);
    const glm::dvec3 y(0, view.fy * scale, view.parallel ? 0 : -view.fy * p.y * scale * scale);
    const glm::dvec3 sx = covariance * x, sy = covariance * y;
    seen.covariance = glm::dmat2(glm::dot(x, sx), glm::dot(x, sy), glm::dot(x, sy), glm::dot(y, sy));
    seen.deviation = std::sqrt(std::max({covariance[0][0], covariance[1][1], covariance[2][2]}));
    if (!std::isfinite(seen.covariance[0][0] * seen.covariance[1][1] + seen.deviation)) return std::nullopt;
    return seen;
}

/// By the even-odd rule.
bool in_polygon(const std::vector<glm::dvec2>& corners, const glm::dvec2& p) {
    bool inside = false;
    for (size_t i = 0, k = corners.size() - 1; i < corners.size(); k = i++) {
        const glm::dvec2 &a = corners[i], &b = corners[k];
        if ((a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x)
            inside = !inside;
    }
    return inside;
}

/// The point of a segment that is nearest to p.
glm::dvec2 nearest_on(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& p) {
    const glm::dvec2 along = b - a;
    const double length = glm::dot(along, along);
    return length > 0 ? a + std::clamp(glm::dot(p - a, along) / length, 0.0, 1.0) * along : a;
}

/// Calls meets(a, b) for each segment until it returns true.
template <class Meets>
bool any_segment(const Region& region, const Meets& meets) {
    const auto& p = region.points;
    for (size_t i = 0; i + 1 < p.size(); ++i)
        if (meets(p[i], p[i + 1])) return true;
    const glm::dvec2 &last = p.back(), &next = region.brush ? p.back() : p.front();
    return meets(last, next);
}

/// Whether an ellipse about 0, of points x with x' ellipse^-1 x <= 1, touches the band of this half width along a segment.
bool meets_band(const glm::dmat2& ellipse, const glm::dvec2& from, const glm::dvec2& to, double half) {
    const double length = glm::distance(from, to);
    if (!(length > 0)) return false;
    const glm::dvec2 u = (to - from) / length, n(-u.y, u.x);
    const double uu = glm::dot(u, ellipse * u), un = glm::dot(u, ellipse * n),
                 nn = std::max(glm::dot(n, ellipse * n), 0.0), reach = std::sqrt(nn);
    const double low = glm::dot(from, n) - half, high = low + 2 * half;
    if (low > reach || high < -reach) return false;
    // How far the part of the ellipse that is between low and high reaches along the segment.
    const auto end = [&](double sign) {
        const double y = std::clamp(uu > 0 ? sign * un / std::sqrt(uu) : 0.0, low, high);
        const double lean = nn > 0 ? un / nn : 0, left = nn > 0 ? 1 - y * y / nn : 1;
        return lean * y + sign * std::sqrt(std::max((uu - un * lean) * left, 0.0));
    };
    const double begin = glm::dot(from, u);
    return end(-1) <= begin + length && end(1) >= begin;
}

/// Whether that ellipse touches a disc. The point of the ellipse nearest to `center` is ellipse (ellipse + t)^-1 center with the t >= 0
/// that puts it on the border, and its distance rises with t.
bool meets_disc(const glm::dmat2& ellipse, const glm::dvec2& center, double radius) {
    constexpr int kHalvings = 60;
    double low = 0, high = glm::length(center) * std::sqrt(ellipse[0][0] + ellipse[1][1]);
    for (int i = 0; i < kHalvings; ++i) {
        const double t = (low + high) / 2;
        const glm::dvec2 v = glm::inverse(ellipse + glm::dmat2(t)) * center;
        const bool farther = glm::dot(v, ellipse * v) > 1, near = t * glm::length(v) <= radius;
        if (farther != near) return near;
        (farther ? low : high) = t;
    }
    return true;  // they touch in a point
}

bool in_region(const Region& region, const Seen& seen) {
    const glm::dmat2 ellipse = (region.extent ? kExtent * kExtent : 0.0) * seen.covariance;
    const double radius = region.brush.value_or(0);
    if (!region.bounds.has(seen.at, radius + std::sqrt(std::max(ellipse[0][0], ellipse[1][1])))) return false;
    if (!region.brush && in_polygon(region.points, seen.at)) return true;
    if (!region.brush && !region.extent) return false;
    const double farthest = radius + std::sqrt(ellipse[0][0] + ellipse[1][1]);
    return any_segment(region, [&](const glm::dvec2& a, const glm::dvec2& b) {
        const glm::dvec2 from = a - seen.at, to = b - seen.at;
        const double distance = glm::length(nearest_on(from, to, glm::dvec2(0)));
        if (distance <= radius || distance > farthest) return distance <= radius;
        return meets_band(ellipse, from, to, radius) ||
               (region.brush && (meets_disc(ellipse, from, radius) || meets_disc(ellipse, to, radius)));
    });
}

/// The depth behind which splats of a region are covered: where the transmittance falls below a half, in cells of its bounds.
class Cover {
  public:
    Cover(const EditedSplats& all, const Region& region) : bounds_(region.bounds) {
        const double margin = region.brush.value_or(0);
        bounds_.low -= margin;
        bounds_.high += margin;
        const glm::dvec2 size = bounds_.high - bounds_.low;
        edge_ = std::max({1.0, size.x / kMostCells, size.y / kMostCells});
        columns_ = int(size.x / edge_) + 1;
        rows_ = int(size.y / edge_) + 1;
        depths_.assign(size_t(columns_) * size_t(rows_), kFar);
        blend(all, region.view);
    }

    bool shows(const Seen& seen) const {
        const glm::dvec2 at = seen.at - bounds_.low;
        const size_t k = size_t(cell(at.y, rows_)) * size_t(columns_) + size_t(cell(at.x, columns_));
        return seen.depth <= depths_[k] + seen.deviation;
    }

  private:
    static constexpr double kMostCells = 256;  // a side
    static constexpr double kReach = 3;        // standard deviations that are blended
    struct Drawn {
        Seen seen;
        double opacity;
    };

    /// The nearest of `count` cells along an axis.
    int cell(double at, int count) const { return int(std::clamp(at / edge_, 0.0, double(count - 1))); }

    void blend(const EditedSplats& all, const View& view) {
        std::vector<Drawn> drawn;
        const Gaussians& g = *all.splats();
        for (size_t i = 0; i < all.size(); ++i) {
            if ((all.states()[i] & (kDeleted | kHidden)) != 0) continue;
            const auto seen = seen_splat(g, i, view, true);
            if (!seen) continue;
            const double reach = kReach * std::sqrt(std::max(seen->covariance[0][0], seen->covariance[1][1]));
            if (bounds_.has(seen->at, reach)) drawn.push_back({*seen, opacity_of(g, i)});
        }
        std::ranges::stable_sort(drawn, {}, [](const Drawn& d) { return d.seen.depth; });
        std::vector<double> transmittance(depths_.size(), 1);
        for (const Drawn& splat : drawn) blend(splat, transmittance);
    }

    void blend(const Drawn& splat, std::vector<double>& transmittance) {
        // Smaller than a cell, a splat still covers a part of one.
        const double least = edge_ * edge_ / 12;
        const double a = splat.seen.covariance[0][0] + least, b = splat.seen.covariance[0][1],
                     c = splat.seen.covariance[1][1] + least, determinant = a * c - b * b;
        if (!(determinant > 0)) return;
        const double peak =
            splat.opacity * std::sqrt(std::max((a - least) * (c - least) - b * b, 0.0) / determinant);
        const double rx = kReach * std::sqrt(a), ry = kReach * std::sqrt(c);
        const glm::dvec2 at = splat.seen.at - bounds_.low;
        for (int y = cell(at.y - ry, rows_); y <= cell(at.y + ry, rows_); ++y)
            for (int x = cell(at.x - rx, columns_); x <= cell(at.x + rx, columns_); ++x) {
                const size_t k = size_t(y) * size_t(columns_) + size_t(x);
                if (depths_[k] < kFar) continue;
                const double dx = (x + 0.5) * edge_ - at.x, dy = (y + 0.5) * edge_ - at.y;
                const double square = (c * dx * dx - 2 * b * dx * dy + a * dy * dy) / determinant;
                if (!(square < kReach * kReach)) continue;
                transmittance[k] *= 1 - peak * std::exp(-square / 2);
                if (transmittance[k] < 0.5) depths_[k] = splat.seen.depth;
            }
    }

    Bounds bounds_;
    double edge_ = 1;
    int columns_ = 1, rows_ = 1;
    std::vector<double> depths_;
};

std::vector<bool> splats_in(const Region& region, const EditedSplats& all) {
    const Gaussians& g = *all.splats();
    const std::optional<Cover> cover =
        region.front ? std::optional<Cover>(std::in_place, all, region) : std::nullopt;
    constexpr size_t kChunk = 65536;
    std::vector<uint8_t> flags(all.size());
    core::on_all_cores((all.size() + kChunk - 1) / kChunk, [&](size_t chunk) {
        for (size_t i = chunk * kChunk; i < std::min(all.size(), (chunk + 1) * kChunk); ++i) {
            if (!all.selectable(i)) continue;
            const auto seen = seen_splat(g, i, region.view, region.extent || region.front);
            flags[i] = seen && in_region(region, *seen) && (!cover || cover->shows(*seen));
        }
    });
    return {flags.begin(), flags.end()};
}

constexpr double kFarthest = 1e9;  // px, of a point of a region

std::optional<View> parse_view(std::string text) {
    View view;
    constexpr std::string_view kParallel = "parallel:";
    view.parallel = text.starts_with(kParallel);
    if (view.parallel) text.erase(0, kParallel.size());
    const auto n = core::parse_list(text);
    constexpr size_t kNumbers = 11;
    if (!n || n->size() != kNumbers) return std::nullopt;
    const glm::dquat q((*n)[4], (*n)[5], (*n)[6], (*n)[7]);
    const double length = glm::length(q);
    if (!(length > 0 && std::isfinite(length)) || (*n)[0] == 0 || (*n)[1] == 0) return std::nullopt;
    view.fx = (*n)[0], view.fy = (*n)[1], view.cx = (*n)[2], view.cy = (*n)[3];
    view.rotation = glm::mat3_cast(glm::normalize(q));
    view.translation = {(*n)[8], (*n)[9], (*n)[10]};
    return view;
}

/// value: what is behind polygon= or brush=.
bool parse_points(Region& region, const std::string& value, bool brush) {
    const auto n = core::parse_list(value);
    if (!n || std::ranges::any_of(*n, [](double v) { return std::abs(v) > kFarthest; })) return false;
    if (brush) region.brush = n->front();
    for (size_t i = brush; i + 1 < n->size(); i += 2) {
        region.points.emplace_back((*n)[i], (*n)[i + 1]);
        region.bounds.add(region.points.back());
    }
    if (brush) return *region.brush > 0 && n->size() % 2 == 1 && n->size() > 1;
    return n->size() % 2 == 0 && region.points.size() > 2;
}

Region parse_region(const std::string& text, const std::string& what) {
    Region region;
    bool has_view = false;
    for (const std::string_view word : core::split_list(text, ';')) {
        const std::string part(word), value = part.substr(part.find('=') + 1);  // without "=", all
        if (region.points.empty()) {
            const bool brush = part.starts_with("brush");
            if (!parse_points(region, value, brush))
                refuse_shape(what, part,
                             brush ? "brush=R,x,y,x,y,... with a radius R above 0, in px up to 1e9"
                                   : "polygon=x,y,x,y,x,y,... with three points or more, in px up to 1e9");
        } else if (part.starts_with("view=")) {
            const auto view = parse_view(value);
            if (!view)
                refuse_shape(what, part,
                             "view=fx,fy,cx,cy,w,x,y,z,tx,ty,tz, with parallel: before fx for parallel rays; "
                             "neither a focal length nor the quaternion w,x,y,z is 0");
            region.view = *view;
            has_view = true;
        } else if (part == "front") {
            region.front = true;
        } else if (part == "extent") {
            region.extent = true;
        } else {
            refuse_shape(what, part, "view=VIEW, front or extent");
        }
    }
    if (!has_view) refuse_shape(what, text, "a polygon or a brush with ;view=VIEW behind its points");
    return region;
}

std::string points_text(const std::vector<glm::dvec2>& points) {
    std::string text;
    for (const glm::dvec2& p : points)
        text += fmt::format("{}{:.7g},{:.7g}", text.empty() ? "" : ",", p.x, p.y);
    return text;
}

}  // namespace

void refuse_shape(const std::string& what, const std::string& text, const std::string& form) {
    constexpr size_t kShown = 120;
    throw InputError(what + ": '" + text.substr(0, kShown) +
                     (text.size() > kShown ? "...' is not " : "' is not ") + form);
}

Shape parse_view_shape(const std::string& text, const std::string& what) {
    return [region = parse_region(text, what)](const EditedSplats& all) { return splats_in(region, all); };
}

std::string view_text(const Camera& camera) {
    const glm::dquat q = glm::quat_cast(camera.rotation);
    const glm::dvec3& t = camera.translation;
    return fmt::format("{}{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}",
                       camera.distortion.lens == Lens::orthographic ? "parallel:" : "", camera.fx, camera.fy,
                       camera.cx, camera.cy, q.w, q.x, q.y, q.z, t.x, t.y, t.z);
}

std::string polygon_shape(const Camera& camera, const std::vector<glm::dvec2>& points) {
    return "polygon=" + points_text(points) + ";view=" + view_text(camera);
}

std::string rectangle_shape(const Camera& camera, const glm::dvec2& from, const glm::dvec2& to) {
    return polygon_shape(camera, {from, {to.x, from.y}, to, {from.x, to.y}});
}

std::string brush_shape(const Camera& camera, double radius, const std::vector<glm::dvec2>& points) {
    return fmt::format("brush={:.7g},{};view={}", radius, points_text(points), view_text(camera));
}

}  // namespace ewa::edit
