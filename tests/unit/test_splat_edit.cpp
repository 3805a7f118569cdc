// SPDX-License-Identifier: Apache-2.0
// Moving, turning, selecting and ordering splats.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <numeric>

#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "scene/color.h"
#include "support/splat_scenes.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using test::expect_error;
using test::storable_splats;

glm::dmat3 covariance(const Gaussians& g, size_t i) {
    const float* q = &g.quaternions[4 * i];
    glm::dmat3 factor = glm::mat3_cast(glm::normalize(glm::dquat(q[0], q[1], q[2], q[3])));
    for (int axis = 0; axis < 3; ++axis) factor[axis] *= std::exp(double(g.log_scales[3 * i + size_t(axis)]));
    return factor * glm::transpose(factor);
}

double color(const Gaussians& g, size_t i, const glm::dvec3& direction) {
    const auto basis = scene::sh_basis(g.sh_degree, glm::normalize(direction));
    double sum = 0;
    for (size_t k = 0; k < g.sh_stride() / 3; ++k) sum += basis[k] * g.sh[g.sh_stride() * i + 3 * k];
    return sum;
}

double norm(const glm::dmat3& m) {
    return std::sqrt(glm::dot(m[0], m[0]) + glm::dot(m[1], m[1]) + glm::dot(m[2], m[2]));
}

/// Covariances and colours after the transform are those of the formulas, in any direction. orthogonal: the
/// turn of M.
void expect_transformed(const glm::dmat4& matrix, const glm::dmat3& orthogonal) {
    const Gaussians before = storable_splats(11, 50, 3);
    Gaussians after = before;
    transform_splats(after, matrix);
    const glm::dmat3 linear(matrix);
    test::Random random(5);
    for (size_t i = 0; i < before.size(); ++i) {
        const glm::dvec3 mean(before.means[3 * i], before.means[3 * i + 1], before.means[3 * i + 2]);
        const glm::dvec4 moved = matrix * glm::dvec4(mean, 1);
        for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(after.means[3 * i + k], moved[int(k)], 1e-5);
        const glm::dmat3 expected = linear * covariance(before, i) * glm::transpose(linear);
        EXPECT_LT(norm(covariance(after, i) - expected), 1e-5 * norm(expected)) << i;
        const glm::dvec3 direction(random.normal(), random.normal(), random.normal());
        EXPECT_NEAR(color(after, i, orthogonal * direction), color(before, i, direction), 1e-5) << i;
    }
}

glm::dmat4 some_rotation() {
    return glm::mat4_cast(glm::normalize(glm::dquat(0.3, -0.5, 0.7, 0.2)));
}

TEST(Transform, TurnsScalesAndMoves) {
    const glm::dmat4 turn = some_rotation();
    expect_transformed(turn, glm::dmat3(turn));
    expect_transformed(glm::translate(glm::dmat4(1.0), glm::dvec3(1, -2, 3)) * turn *
                           glm::scale(glm::dmat4(1.0), glm::dvec3(2.5)),
                       glm::dmat3(turn));
}

TEST(Transform, StretchesAndShears) {
    const glm::dmat4 turn = some_rotation();
    // With positive scales on the right of a rotation the polar decomposition's turn is that rotation.
    expect_transformed(turn * glm::scale(glm::dmat4(1.0), glm::dvec3(0.5, 2, 3)), glm::dmat3(turn));
    glm::dmat4 symmetric(1.0);
    symmetric[0][1] = symmetric[1][0] = 0.4;
    expect_transformed(turn * symmetric, glm::dmat3(turn));
}

TEST(Transform, Mirrors) {
    const glm::dmat4 mirror = glm::scale(glm::dmat4(1.0), glm::dvec3(1, -1, 1)), turn = some_rotation();
    expect_transformed(mirror, glm::dmat3(mirror));
    expect_transformed(turn * mirror, glm::dmat3(turn * mirror));
    expect_transformed(glm::scale(glm::dmat4(1.0), glm::dvec3(-1)), glm::dmat3(-1.0));
    expect_transformed(turn * mirror * glm::scale(glm::dmat4(1.0), glm::dvec3(1, 2, 3)),
                       glm::dmat3(turn * mirror));
}

TEST(Transform, HalfTurnsAreExact) {
    const Gaussians before = storable_splats(3, 100, 3);
    glm::dmat4 half(1.0);
    half[0][0] = half[1][1] = -1;
    Gaussians g = before;
    transform_splats(g, half);
    EXPECT_NE(g.sh, before.sh);
    transform_splats(g, half);
    EXPECT_EQ(g.means, before.means);
    EXPECT_EQ(g.sh, before.sh);
    EXPECT_EQ(g.log_scales, before.log_scales);
    for (size_t i = 0; i < g.quaternions.size(); ++i) EXPECT_EQ(g.quaternions[i], -before.quaternions[i]);
}

TEST(Transform, NeedlesAndFlatSplatsStayFinite) {
    Gaussians g = storable_splats(3, 4, 1);
    g.log_scales = {-80, 80, 0, -80, -80, -80, 5, -30, 5, 80, 80, 80};
    g.means[9] = NAN;  // stays what it is
    transform_splats(g, some_rotation() * glm::scale(glm::dmat4(1.0), glm::dvec3(1, 2, 3)));
    for (size_t i = 0; i < 3; ++i) EXPECT_TRUE(drawable(g, i)) << i;
    EXPECT_FALSE(drawable(g, 3));
    EXPECT_NEAR(*std::max_element(g.log_scales.begin(), g.log_scales.begin() + 3), 80.5, 1);
}

TEST(Transform, InfiniteValuesKeepTheirMeaning) {
    constexpr float inf = std::numeric_limits<float>::infinity();
    for (const glm::dvec3 size : {glm::dvec3(2), glm::dvec3(1, 2, 3)}) {
        Gaussians g = storable_splats(3, 4, 1);
        g.log_scales = {-inf, -inf, -inf, 1, -inf, 2, 3e38f, 1, 2, 88, 88, 88};
        g.opacity_logits = {inf, -inf, 0, 0};
        transform_splats(g, some_rotation() * glm::scale(glm::dmat4(1.0), size));
        for (size_t i = 0; i < 4; ++i) EXPECT_TRUE(drawable(g, i)) << i;
        EXPECT_EQ(g.opacity_logits, (std::vector<float>{inf, -inf, 0, 0}));
        EXPECT_LT(*std::max_element(g.log_scales.begin(), g.log_scales.begin() + 3), -80);
        EXPECT_LT(*std::min_element(g.log_scales.begin() + 3, g.log_scales.begin() + 6), -80);
        EXPECT_GT(*std::max_element(g.log_scales.begin() + 6, g.log_scales.begin() + 9), 1e38f);
    }
}

TEST(Transform, RefusesWhatIsNone) {
    Gaussians g = storable_splats(3, 4, 1);
    glm::dmat4 m(1.0);
    m[1][1] = 0;
    expect_error<InputError>([&] { transform_splats(g, m); }, {"flattens"});
    m[1][1] = NAN;
    expect_error<InputError>([&] { transform_splats(g, m); }, {"not finite"});
    m = glm::dmat4(1.0);
    m[0][3] = 1;
    expect_error<InputError>([&] { transform_splats(g, m); }, {"not affine"});
}

TEST(Select, KeepsInTheOrderGiven) {
    Gaussians g = storable_splats(3, 4, 1);
    const Gaussians all = g;
    select_splats(g, {3, 1, 1});
    ASSERT_EQ(g.size(), 3u);
    EXPECT_EQ(g.means[0], all.means[9]);
    EXPECT_EQ(g.sh[12 * 2 + 5], all.sh[12 * 1 + 5]);
    EXPECT_EQ(g.quaternions[4], all.quaternions[4]);
}

TEST(Append, TakesTheHigherDegree) {
    const Gaussians a = storable_splats(3, 2, 1), b = storable_splats(4, 3, 2);
    for (const bool swap : {false, true}) {
        Gaussians joined = swap ? b : a;
        append_splats(joined, swap ? a : b);
        ASSERT_EQ(joined.size(), 5u);
        EXPECT_EQ(joined.sh_degree, 2);
        const size_t at_a = swap ? 3 : 0, at_b = swap ? 0 : 2;
        EXPECT_EQ(joined.sh[27 * (at_a + 1) + 11], a.sh[12 + 11]);
        EXPECT_EQ(joined.sh[27 * (at_a + 1) + 12], 0);
        EXPECT_EQ(joined.sh[27 * (at_b + 2) + 26], b.sh[27 * 2 + 26]);
        EXPECT_EQ(joined.means[3 * at_b], b.means[0]);
    }
}

TEST(Append, FitsADensityToTheOtherKernels) {
    Gaussians density = storable_splats(3, 2, 1);
    density.density = true;
    Gaussians fitted = density;
    fit_opacities(fitted, false);
    EXPECT_FALSE(fitted.density);
    const Gaussians plain = storable_splats(4, 3, 1);
    Gaussians joined = density;
    append_splats(joined, plain);
    EXPECT_FALSE(joined.density);
    EXPECT_EQ(joined.opacity_logits[1], fitted.opacity_logits[1]);
    EXPECT_EQ(joined.opacity_logits[2], plain.opacity_logits[0]);
    joined = plain;
    append_splats(joined, density);
    EXPECT_FALSE(joined.density);
    EXPECT_EQ(joined.opacity_logits[4], fitted.opacity_logits[1]);
    joined = Gaussians();
    append_splats(joined, density);
    append_splats(joined, density);
    EXPECT_TRUE(joined.density);
    EXPECT_EQ(joined.opacity_logits[3], density.opacity_logits[1]);
}

TEST(FitOpacities, IsUndoneAndKeepsWhatIsTransparent) {
    Gaussians g = storable_splats(3, 400, 0);
    test::Random random(8);
    for (size_t i = 0; i < g.size(); ++i) {
        g.opacity_logits[i] = float(random.uniform(-1, 1) * std::pow(10.0, random.uniform(-3, 6)));
    }
    const Gaussians before = g;
    fit_opacities(g, false);
    EXPECT_EQ(g.opacity_logits, before.opacity_logits) << "they are of that kind already";
    g.density = true;
    fit_opacities(g, false);
    for (size_t i = 0; i < g.size(); ++i) {
        const float logit = before.opacity_logits[i];
        const auto depth = [](double x) { return std::max(x, 0.0) + std::log1p(std::exp(-std::abs(x))); };
        const double own = depth(logit), shown = depth(g.opacity_logits[i]);
        if (logit < -20)
            EXPECT_EQ(g.opacity_logits[i], logit);
        else
            EXPECT_NEAR(shown, own + own * own / 4, 1e-6 * shown * (1 + std::abs(double(logit)))) << logit;
    }
    fit_opacities(g, true);
    EXPECT_TRUE(g.density);
    for (size_t i = 0; i < g.size(); ++i)
        EXPECT_NEAR(g.opacity_logits[i], before.opacity_logits[i],
                    1e-6 * (1 + std::abs(before.opacity_logits[i])));

    // What is not finite stays, and does not become finite.
    g.opacity_logits[0] = NAN;
    g.opacity_logits[1] = INFINITY;
    g.opacity_logits[2] = 1e30f;
    fit_opacities(g, false);
    EXPECT_TRUE(std::isnan(g.opacity_logits[0]));
    EXPECT_EQ(g.opacity_logits[1], INFINITY);
    EXPECT_TRUE(std::isfinite(g.opacity_logits[2]));
}

TEST(Morton, NeighboursStayNeighbours) {
    Gaussians g = storable_splats(3, 4000, 0);
    g.means[30] = NAN;
    const std::vector<uint32_t> order = morton_order(g);
    std::vector<uint32_t> sorted = order, every(g.size());
    std::sort(sorted.begin(), sorted.end());
    std::iota(every.begin(), every.end(), 0u);
    EXPECT_EQ(sorted, every);
    EXPECT_EQ(order.back(), 10u);
    const auto walk = [](const Gaussians& s) {
        double length = 0;
        for (size_t i = 3; i + 3 < s.means.size(); i += 3)
            length += std::hypot(s.means[i] - s.means[i - 3], s.means[i + 1] - s.means[i - 2],
                                 s.means[i + 2] - s.means[i - 1]);
        return length;
    };
    std::vector<uint32_t> finite = order;
    finite.pop_back();
    Gaussians before = g;
    std::vector<uint32_t> plain = every;
    plain.erase(plain.begin() + 10);
    select_splats(before, plain);
    select_splats(g, finite);
    EXPECT_LT(walk(g), 0.2 * walk(before));
    // What is in order stays.
    std::vector<uint32_t> again = morton_order(g);
    for (size_t i = 0; i < again.size(); ++i) ASSERT_EQ(again[i], i);
}

}  // namespace
