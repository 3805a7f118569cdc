// SPDX-License-Identifier: Apache-2.0
#include "scene/plane_sweep.h"

#include <algorithm>
#include <cmath>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

namespace ewa::scene {
namespace {

constexpr int kReach = 2;  // px: a window has 5 x 5
constexpr float kWindow = (2 * kReach + 1) * (2 * kReach + 1);
constexpr float kLeastVariance = 2e-5f;  // a standard deviation of about one of 255 levels
constexpr float kNone = -1;

using Plane = std::vector<float>;

/// Sums over the windows round the pixels, of an image whose border pixels continue outwards. rows: scratch.
void window_sums(const Plane& values, int width, int height, Plane& rows, Plane& sums) {
    rows.resize(size_t(width));
    for (int y = 0; y < height; ++y) {
        const float* row[2 * kReach + 1];
        for (int k = -kReach; k <= kReach; ++k)
            row[k + kReach] = &values[size_t(std::clamp(y + k, 0, height - 1)) * size_t(width)];
        for (int x = 0; x < width; ++x)
            rows[size_t(x)] = row[0][x] + row[1][x] + row[2][x] + row[3][x] + row[4][x];
        float* out = &sums[size_t(y) * size_t(width)];
        const auto at = [&](int x) { return rows[size_t(std::clamp(x, 0, width - 1))]; };
        const auto sum = [&](int x) { return at(x - 2) + at(x - 1) + at(x) + at(x + 1) + at(x + 2); };
        const int begin = std::min(kReach, width), end = std::max(width - kReach, begin);
        for (int x = 0; x < begin; ++x) out[x] = sum(x);
        for (int x = begin; x < end; ++x) {
            const float* in = &rows[size_t(x)];
            out[x] = in[-2] + in[-1] + in[0] + in[1] + in[2];
        }
        for (int x = end; x < width; ++x) out[x] = sum(x);
    }
}

/// Means over 3 x 3 pixels, without those that have none.
void smooth(const Plane& scores, int width, int height, Plane& out) {
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            float sum = 0;
            int count = 0;
            for (int v = std::max(y - 1, 0); v <= std::min(y + 1, height - 1); ++v)
                for (int u = std::max(x - 1, 0); u <= std::min(x + 1, width - 1); ++u)
                    if (const float score = scores[size_t(v * width + u)]; score > kNone)
                        sum += score, ++count;
            out[size_t(y * width + x)] = scores[size_t(y * width + x)] > kNone ? sum / float(count) : kNone;
        }
}

glm::dmat3 intrinsics_of(const Camera& camera) {
    return {camera.fx, 0, 0, 0, camera.fy, 0, camera.cx, camera.cy, 1};
}

/// Another image as the reference camera would see it.
class Warp {
  public:
    Warp(const SweptImage& reference, const SweptImage& other) : image_(other.gray) {
        const glm::dmat3 turn = other.camera.rotation * glm::transpose(reference.camera.rotation);
        const glm::dvec3 shift = other.camera.translation - turn * reference.camera.translation;
        far_ = intrinsics_of(other.camera) * turn * glm::inverse(intrinsics_of(reference.camera));
        near_ = intrinsics_of(other.camera) * shift;
    }

    /// inverse: of the plane's depth. seen: whether the other image shows the pixel's window.
    void onto(double inverse, int width, int height, Plane& values, std::vector<uint8_t>& seen) {
        const glm::vec3 across(far_[0]);
        u_.resize(size_t(width));
        v_.resize(size_t(width));
        for (int y = 0; y < height; ++y) {
            const glm::vec3 first(far_ * glm::dvec3(0.5, y + 0.5, 1) + near_ * inverse);
            // Pixel centres have whole coordinates here. What lies behind the camera is nowhere in the image.
            for (int x = 0; x < width; ++x) {
                const float t = float(x), z = first.z + t * across.z;
                const float scale = z > 0 ? 1 / z : -1e30f;
                u_[size_t(x)] = (first.x + t * across.x) * scale - 0.5f;
                v_[size_t(x)] = (first.y + t * across.y) * scale - 0.5f;
            }
            const size_t row = size_t(y) * size_t(width);
            for (int x = 0; x < width; ++x)
                sample(u_[size_t(x)], v_[size_t(x)], values[row + size_t(x)], seen[row + size_t(x)]);
        }
    }

  private:
    void sample(float u, float v, float& value, uint8_t& seen) const {
        const int right = image_.width - 1, bottom = image_.height - 1;
        seen = u >= kReach && v >= kReach && u <= float(right - kReach) && v <= float(bottom - kReach);
        // A window that is not wholly in the image does not count, so that its values may be anything.
        if (!(u >= 0 && v >= 0 && u < float(right) && v < float(bottom))) {
            value = 0;
            return;
        }
        const int x = int(u), y = int(v);
        const float a = u - float(x), b = v - float(y);
        const float* top = &image_.pixels[size_t(y) * size_t(image_.width) + size_t(x)];
        const float* below = top + image_.width;
        value = (1 - b) * ((1 - a) * top[0] + a * top[1]) + b * ((1 - a) * below[0] + a * below[1]);
    }

    std::vector<float> u_, v_;  // of a row, px
    const Image& image_;
    glm::dmat3 far_{1.0};   // pixels of the reference to those of the image, for a plane infinitely far away
    glm::dvec3 near_{0.0};  // what a plane at the depth 1 adds
};

class Sweep {
  public:
    Sweep(const SweptImage& reference, std::span<const SweptImage* const> others)
        : width_(reference.gray.width), height_(reference.gray.height), own_(reference.gray.pixels) {
        for (const SweptImage* other : others) warps_.emplace_back(reference, *other);
        for (Plane* plane : {&own_sum_, &own_spread_, &values_, &squares_, &products_, &sum_, &square_sum_,
                             &product_sum_, &best_, &second_, &smoothed_})
            plane->resize(own_.size());
        seen_.resize(own_.size());
        window_sums(own_, width_, height_, rows_, own_sum_);
        for (size_t i = 0; i < own_.size(); ++i) squares_[i] = own_[i] * own_[i];
        window_sums(squares_, width_, height_, rows_, square_sum_);
        for (size_t i = 0; i < own_.size(); ++i)
            own_spread_[i] = kWindow * square_sum_[i] - own_sum_[i] * own_sum_[i];
    }

    /// The scores of the pixels on a plane.
    const Plane& scores(double inverse) {
        std::ranges::fill(best_, kNone);
        std::ranges::fill(second_, kNone);
        for (Warp& warp : warps_) add(warp, inverse);
        for (size_t i = 0; i < best_.size(); ++i)
            if (second_[i] > kNone) best_[i] = 0.5f * (best_[i] + second_[i]);
        smooth(best_, width_, height_, smoothed_);
        return smoothed_;
    }

  private:
    void add(Warp& warp, double inverse) {
        warp.onto(inverse, width_, height_, values_, seen_);
        for (size_t i = 0; i < own_.size(); ++i) {
            squares_[i] = values_[i] * values_[i];
            products_[i] = values_[i] * own_[i];
        }
        window_sums(values_, width_, height_, rows_, sum_);
        window_sums(squares_, width_, height_, rows_, square_sum_);
        window_sums(products_, width_, height_, rows_, product_sum_);
        constexpr float kLeast = kLeastVariance * kWindow * kWindow;
        for (size_t i = 0; i < own_.size(); ++i) {
            const float spread = kWindow * square_sum_[i] - sum_[i] * sum_[i];
            const bool textured = own_spread_[i] > kLeast && spread > kLeast;
            const float both = textured ? own_spread_[i] * spread : 1;
            const float correlation = (kWindow * product_sum_[i] - own_sum_[i] * sum_[i]) / std::sqrt(both);
            const float score = seen_[i] && textured ? std::max(correlation, kNone) : kNone;
            second_[i] = std::max(second_[i], std::min(best_[i], score));
            best_[i] = std::max(best_[i], score);
        }
    }

    int width_, height_;
    const Plane& own_;
    std::vector<Warp> warps_;
    Plane own_sum_, own_spread_, values_, squares_, products_, sum_, square_sum_, product_sum_, best_,
        second_, smoothed_, rows_;
    std::vector<uint8_t> seen_;
};

/// Where the parabola through three equally spaced scores has its peak, -0.5 to 0.5 from the middle one, which is the largest.
float peak(float before, float middle, float after) {
    const float bend = before - 2 * middle + after;
    return bend < 0 ? std::clamp(0.5f * (before - after) / bend, -0.5f, 0.5f) : 0;
}

}  // namespace

SweptDepths sweep_planes(const SweptImage& reference, std::span<const SweptImage* const> others,
                         const SweepPlanes& planes) {
    const size_t pixels = reference.gray.pixels.size();
    Sweep sweep(reference, others);
    Plane before(pixels, kNone), best(pixels, kNone), left(pixels, kNone), right(pixels, kNone);
    std::vector<int> at(pixels, 0);
    const double step = planes.most / (planes.count - 1);
    for (int k = 0; k < planes.count; ++k) {
        const Plane& scores = sweep.scores(k * step);
        for (size_t i = 0; i < pixels; ++i) {
            if (at[i] == k - 1) right[i] = scores[i];
            if (scores[i] > best[i]) {
                best[i] = scores[i];
                left[i] = before[i];
                right[i] = kNone;
                at[i] = k;
            }
        }
        before = scores;
    }
    SweptDepths depths{std::vector<float>(pixels, 0), std::vector<float>(pixels, kNone)};
    for (size_t i = 0; i < pixels; ++i) {
        if (!(left[i] > kNone && right[i] > kNone)) continue;
        depths.inverse[i] = float(step * (at[i] + double(peak(left[i], best[i], right[i]))));
        depths.score[i] = best[i];
    }
    return depths;
}

}  // namespace ewa::scene
