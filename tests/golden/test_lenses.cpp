// SPDX-License-Identifier: Apache-2.0
// A pattern seen through each kind of lens, and undistorted: the result is the pattern itself, as
// the pinhole camera sees it. The image is made by inverting the lens's formula, written out here once
// more.
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/mat2x2.hpp>
#include <glm/vec2.hpp>
#include <sstream>

#include "ewa/dataset.h"
#include "golden/golden.h"
#include "support/temp_folder.h"

namespace ewa::test {
namespace {

using Vec = glm::dvec2;
constexpr int kLensWidth = 64, kLensHeight = 48;

struct LensCase {
    std::string name, model;
    std::vector<double> parameters;  // COLMAP's: focal lengths and principal point first
    std::function<Vec(Vec)> bend;    // a ray (x, y, 1) to the plane
};

/// The angle to the axis in place of its tangent.
Vec fisheye_plane(Vec ray) {
    const double r = glm::length(ray);
    return r > 1e-12 ? ray * (std::atan(r) / r) : ray;
}

Vec tangential(Vec p, double p1, double p2) {
    const double r2 = glm::dot(p, p);
    return {2 * p1 * p.x * p.y + p2 * (r2 + 2 * p.x * p.x), p1 * (r2 + 2 * p.y * p.y) + 2 * p2 * p.x * p.y};
}

/// Formulas of COLMAP's src/colmap/sensor/models.h.
std::vector<LensCase> lens_cases() {
    const auto full_opencv = [](Vec q) {
        const double r2 = glm::dot(q, q), r4 = r2 * r2, r6 = r4 * r2;
        return q * ((1 + 0.3 * r2 + 0.1 * r4 + 0.02 * r6) / (1 + 0.4 * r2 + 0.1 * r4 + 0.01 * r6)) +
               tangential(q, 0.01, -0.02);
    };
    const auto thin_prism = [](Vec ray) {
        const Vec q = fisheye_plane(ray);
        const double r2 = glm::dot(q, q);
        return q * (1 + 0.03 * r2 - 0.01 * r2 * r2 + 0.004 * std::pow(r2, 3) - 0.001 * std::pow(r2, 4)) +
               tangential(q, 0.02, -0.03) + r2 * Vec(0.03, -0.02);
    };
    const auto rad_tan = [](Vec ray) {
        const Vec q = fisheye_plane(ray);
        const double r2 = glm::dot(q, q);
        const Vec p = q * (1 + 0.03 * r2 - 0.01 * r2 * r2 + 0.004 * std::pow(r2, 3) -
                           0.002 * std::pow(r2, 4) + 0.001 * std::pow(r2, 5) - 0.0003 * std::pow(r2, 6));
        const double p2 = glm::dot(p, p);
        // This model's first tangential parameter is the one along x.
        return p + tangential(p, -0.03, 0.02) + p2 * Vec(0.02 - 0.01 * p2, 0.015 + 0.005 * p2);
    };
    const auto fov = [](Vec q) {
        const double r = glm::length(q), omega = 0.9;
        return r > 1e-12 ? q * (std::atan(2 * r * std::tan(omega / 2)) / (r * omega)) : q;
    };
    const auto division = [](Vec q) { return q * (2 / (1 + std::sqrt(1 + 4 * 0.2 * glm::dot(q, q)))); };
    const auto unified = [](Vec q) { return q / (0.6 * std::sqrt(1.1 * glm::dot(q, q) + 1) + 0.4); };
    return {
        {"lens_brown",
         "FULL_OPENCV",
         {53, 51, 33, 23, 0.3, 0.1, 0.01, -0.02, 0.02, 0.4, 0.1, 0.01},
         full_opencv},
        {"lens_fisheye",
         "THIN_PRISM_FISHEYE",
         {40, 39, 33, 23, 0.03, -0.01, 0.02, -0.03, 0.004, -0.001, 0.03, -0.02},
         thin_prism},
        {"lens_fisheye624",
         "RAD_TAN_THIN_PRISM_FISHEYE",
         {40, 39, 33, 23, 0.03, -0.01, 0.004, -0.002, 0.001, -0.0003, 0.02, -0.03, 0.02, -0.01, 0.015, 0.005},
         rad_tan},
        {"lens_fov", "FOV", {53, 51, 33, 23, 0.9}, fov},
        {"lens_division", "SIMPLE_DIVISION", {53, 33, 23, -0.2}, division},
        {"lens_unified", "EUCM", {44, 43, 33, 23, 0.6, 1.1}, unified}};
}

/// Smooth over the directions, without symmetry, of another rhythm in each colour.
std::array<double, 3> pattern(Vec ray) {
    const double length = std::sqrt(1 + glm::dot(ray, ray)), x = ray.x / length, y = ray.y / length;
    return {0.5 + 0.4 * std::sin(7 * x + 2 * y + 0.3), 0.5 + 0.4 * std::sin(6 * y - 3 * x * y - 0.4),
            0.5 + 0.4 * std::cos(5 * (x + y) + 3 * x * x)};
}

/// The ray that `bend` puts there, by Newton's method with a numerical derivative.
Vec ray_of(const std::function<Vec(Vec)>& bend, Vec point) {
    Vec ray = point;
    for (int i = 0; i < 60; ++i) {
        constexpr double h = 1e-6;
        const Vec at = bend(ray);
        const glm::dmat2 slope((bend(ray + Vec(h, 0)) - at) / h, (bend(ray + Vec(0, h)) - at) / h);
        ray -= 0.8 * (glm::inverse(slope) * (at - point));
    }
    return ray;
}

class GoldenLensTest : public testing::TestWithParam<LensCase> {};

TEST_P(GoldenLensTest, Undistorted) {
    const LensCase& lens = GetParam();
    const std::vector<double>& p = lens.parameters;
    const bool one_focal = lens.model == "SIMPLE_DIVISION";
    const Vec focal(p[0], p[one_focal ? 0 : 1]), centre(p[one_focal ? 1 : 2], p[one_focal ? 2 : 3]);
    Image photo(kLensWidth, kLensHeight, 3);
    for (int y = 0; y < kLensHeight; ++y)
        for (int x = 0; x < kLensWidth; ++x) {
            const Vec ray = ray_of(lens.bend, (Vec(x + 0.5, y + 0.5) - centre) / focal);
            const auto color = pattern(ray);
            for (int c = 0; c < 3; ++c) photo.at(x, y)[c] = float(color[size_t(c)]);
        }
    const TempFolder folder;
    std::ostringstream camera;
    camera << "1 " << lens.model << " " << kLensWidth << " " << kLensHeight;
    for (const double value : p) camera << " " << value;
    folder.write("sparse/0/cameras.txt", camera.str() + "\n");
    folder.write("sparse/0/images.txt", "1 1 0 0 0 0 0 0 1 a.exr\n\n");
    folder.write("sparse/0/points3D.txt", "");
    std::filesystem::create_directories(folder / "images");
    save_image(folder / "images/a.exr", photo);

    const Frame frame = load_dataset(folder.path(), {}).frames.at(0);
    Image expected(frame.camera.width, frame.camera.height, 3);
    for (int y = 0; y < expected.height; ++y)
        for (int x = 0; x < expected.width; ++x) {
            const auto color = pattern({(x + 0.5 - frame.camera.cx) / frame.camera.fx,
                                        (y + 0.5 - frame.camera.cy) / frame.camera.fy});
            for (int c = 0; c < 3; ++c) expected.at(x, y)[c] = float(color[size_t(c)]);
        }
    EXPECT_TRUE(is_reference(lens.name, expected));
    // Bilinear interpolation of that pattern: a quarter of a squared pixel times its curvature.
    EXPECT_TRUE(matches_golden(lens.name, load_frame_image(frame), {0.005, 0.003, 20}, "load_frame_image"));
}

INSTANTIATE_TEST_SUITE_P(Golden, GoldenLensTest, testing::ValuesIn(lens_cases()),
                         [](const auto& test) { return test.param.name; });

void PrintTo(const LensCase& lens, std::ostream* out) {
    *out << lens.model;
}

}  // namespace
}  // namespace ewa::test
