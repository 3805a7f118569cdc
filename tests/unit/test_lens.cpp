// SPDX-License-Identifier: Apache-2.0
// Lens models against figures of another implementation, and the inversion of them.
#include <algorithm>
#include <cmath>
#include <ctime>
#include <sstream>

#include "ewa/dataset.h"
#include "io/datasets/image_records.h"
#include "scene/lens.h"
#include "scene/native_lens.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using test::bytes_of;
using test::TempFolder;

/// A camera of 160 x 120 pixels; what COLMAP 4.2's undistort_camera makes of it (size and principal point;
/// the focal lengths stay), and where its img_from_cam puts the rays of kRays (px).
struct Case {
    const char* model;
    int32_t id;
    std::vector<double> parameters;
    int width, height;
    double cx, cy;
    glm::dvec2 pixels[3];
};
const glm::dvec2 kRays[3] = {{0.1, -0.2}, {-0.45, 0.3}, {0.4, 0.35}};

const std::vector<Case> kCases = {
    {"SIMPLE_RADIAL",
     2,
     {130, 82, 57, -0.12},
     167,
     121,
     85.5875,
     57.475,
     {{94.922, 31.156}, {25.55335, 94.6311}, {132.2372, 100.95755}}},
    {"RADIAL",
     3,
     {130, 82, 57, 0.1, -0.05},
     152,
     114,
     77.9,
     54.15,
     {{95.063375, 30.87325}, {22.039127031, 96.973915312}, {135.26150375, 103.603815781}}},
    {"OPENCV",
     4,
     {130, 125, 82, 57, -0.2, 0.05, 0.002, -0.001},
     172,
     124,
     88.15,
     58.9,
     {{94.852125, 32.284375}, {26.511122969, 92.618542969}, {131.26397125, 98.549576172}}},
    {"OPENCV_FISHEYE",
     5,
     {90, 88, 82, 57, 0.03, -0.01, 0.004, -0.001},
     209,
     136,
     107.1125,
     64.6,
     {{90.866996987, 39.66009478}, {44.62051631, 81.365885664}, {115.309140288, 85.497820024}}},
    {"FULL_OPENCV",
     6,
     {130, 125, 82, 57, 0.3, 0.1, 0.001, -0.002, 0.02, 0.4, 0.1, 0.01},
     164,
     121,
     84.05,
     57.475,
     {{94.91290613, 32.148738211}, {24.790457444, 93.66059619}, {132.580009934, 99.652406194}}},
    {"FOV",
     7,
     {130, 125, 82, 57, 0.9},
     165,
     117,
     84.5625,
     55.575,
     {{95.743722338, 30.569764734}, {24.132313143, 94.094671062}, {133.568258311, 100.38675579}}},
    {"SIMPLE_RADIAL_FISHEYE",
     8,
     {90, 82, 57, 0.05},
     204,
     134,
     104.55,
     63.65,
     {{90.875770464, 39.248459072}, {44.417647653, 82.054901564}, {115.484242695, 86.298712358}}},
    {"RADIAL_FISHEYE",
     9,
     {90, 82, 57, -0.03, 0.01},
     223,
     139,
     114.2875,
     66.025,
     {{90.841697559, 39.316604882}, {45.125251844, 81.583165438}, {114.871306033, 85.762392779}}},
    {"THIN_PRISM_FISHEYE",
     10,
     {90, 88, 82, 57, 0.03, -0.01, 0.002, -0.003, 0.004, -0.001, 0.005, -0.004},
     211,
     136,
     108.1375,
     64.6,
     {{90.863512568, 39.675426224}, {44.532029907, 81.409145684}, {115.321686096, 85.429793865}}},
    {"RAD_TAN_THIN_PRISM_FISHEYE",
     11,
     {90, 88, 82, 57, 0.03, -0.01, 0.004, -0.002, 0.001, -0.0003, 0.002, -0.003, 0.004, -0.002, 0.003, 0.001},
     207,
     135,
     106.0875,
     64.125,
     {{90.906758371, 39.632968305}, {44.868190427, 81.290322442}, {115.41371562, 85.489711786}}},
    {"SIMPLE_DIVISION",
     12,
     {130, 82, 57, -0.2},
     172,
     123,
     88.15,
     58.425,
     {{94.872536767, 31.254926466}, {26.57223692, 93.951842053}, {131.353449809, 100.184268583}}},
    {"DIVISION",
     13,
     {130, 125, 82, 57, 0.15},
     145,
     109,
     74.3125,
     51.775,
     {{95.098990511, 31.809633633}, {20.679882381, 96.307767704}, {136.412721923, 102.779934311}}},
    {"SIMPLE_FISHEYE",
     14,
     {90, 82, 57},
     216,
     137,
     110.7,
     65.075,
     {{90.85434529, 39.291309419}, {44.873918955, 81.750720697}, {115.089377157, 85.953205012}}},
    {"FISHEYE",
     15,
     {90, 88, 82, 57},
     216,
     138,
     110.7,
     65.55,
     {{90.85434529, 39.684835877}, {44.873918955, 81.200704681}, {115.089377157, 85.309800456}}},
    {"EUCM",
     16,
     {110, 108, 82, 57, 0.6, 1.1},
     192,
     130,
     98.4,
     61.75,
     {{92.823797692, 35.745997259}, {36.579001856, 86.730107876}, {122.481064315, 91.776914344}}}};

DatasetOptions cameras_only() {
    DatasetOptions options;
    options.need_images = false;
    return options;
}

Frame from_text(const Case& c) {
    TempFolder folder;
    std::ostringstream camera;
    camera.precision(17);
    camera << "1 " << c.model << " 160 120";
    for (double v : c.parameters) camera << " " << v;
    folder.write("sparse/0/cameras.txt", camera.str() + "\n");
    folder.write("sparse/0/images.txt", "1 1 0 0 0 0 0 0 1 a.png\n\n");
    return load_dataset(folder.path(), cameras_only()).frames.at(0);
}

Frame from_binary(const Case& c) {
    TempFolder folder;
    std::string camera = bytes_of(uint64_t(1)) + bytes_of(uint32_t(1)) + bytes_of(c.id) +
                         bytes_of(uint64_t(160)) + bytes_of(uint64_t(120));
    for (double v : c.parameters) camera += bytes_of(v);
    std::string image = bytes_of(uint64_t(1)) + bytes_of(uint32_t(1));
    for (double v : {1., 0., 0., 0., 0., 0., 0.}) image += bytes_of(v);
    image += bytes_of(uint32_t(1)) + std::string("a.png") + '\0' + bytes_of(uint64_t(0));
    folder.write("sparse/0/cameras.bin", camera);
    folder.write("sparse/0/images.bin", image);
    return load_dataset(folder.path(), cameras_only()).frames.at(0);
}

TEST(Lens, EveryModelOfColmapGivesItsFigures) {
    for (const Case& c : kCases)
        for (const Frame& frame : {from_text(c), from_binary(c)}) {
            SCOPED_TRACE(c.model);
            const Camera& source = frame.source;
            for (int i = 0; i < 3; ++i) {
                const glm::dvec2 p = scene::distort(frame.distortion, kRays[i]);
                EXPECT_NEAR(source.fx * p.x + source.cx, c.pixels[i].x, 1e-8);
                EXPECT_NEAR(source.fy * p.y + source.cy, c.pixels[i].y, 1e-8);
            }
            EXPECT_EQ(frame.camera.width, c.width);
            EXPECT_EQ(frame.camera.height, c.height);
            EXPECT_NEAR(frame.camera.cx, c.cx, 1e-9);
            EXPECT_NEAR(frame.camera.cy, c.cy, 1e-9);
            EXPECT_EQ(frame.camera.fx, source.fx);
            EXPECT_EQ(frame.camera.fy, source.fy);
        }
}

TEST(Lens, UndistortIsTheInverse) {
    for (const Case& c : kCases) {
        const Distortion lens = from_text(c).distortion;
        for (double x = -0.6; x <= 0.6; x += 0.1)
            for (double y = -0.5; y <= 0.5; y += 0.1) {
                const auto ray = scene::undistort(lens, scene::distort(lens, {x, y}));
                ASSERT_TRUE(ray) << c.model << " " << x << " " << y;
                EXPECT_NEAR(ray->x, x, 1e-10) << c.model;
                EXPECT_NEAR(ray->y, y, 1e-10) << c.model;
            }
    }
}

TEST(Lens, TermsThatColmapLacks) {
    const glm::dvec2 ray(0.45, -0.3);
    const double r2 = glm::dot(ray, ray);
    const auto tangential = [](glm::dvec2 q, double p1, double p2) {
        const double w = glm::dot(q, q);
        return glm::dvec2(2 * p1 * q.x * q.y + p2 * (w + 2 * q.x * q.x),
                          p1 * (w + 2 * q.y * q.y) + 2 * p2 * q.x * q.y);
    };
    // Metashape's: four radial terms, and a shear at the end.
    const Distortion four{.k1 = -0.2,
                          .k2 = 0.1,
                          .p1 = 0.003,
                          .p2 = -0.005,
                          .k3 = -0.04,
                          .k4 = 0.02,
                          .lens = Lens::radial4,
                          .skew = 0.07};
    const double factor = 1 + r2 * (-0.2 + r2 * (0.1 + r2 * (-0.04 + r2 * 0.02)));
    const glm::dvec2 bent = factor * ray + tangential(ray, 0.003, -0.005);
    EXPECT_NEAR(scene::distort(four, ray).x, bent.x + 0.07 * bent.y, 1e-15);
    EXPECT_NEAR(scene::distort(four, ray).y, bent.y, 1e-15);
    // OpenSfM's fisheye624: six radial terms of the angle, to which the others are added.
    const Distortion six{.k1 = 0.03,
                         .k2 = -0.02,
                         .p1 = 0.003,
                         .p2 = -0.002,
                         .k3 = 0.01,
                         .k4 = -0.004,
                         .k5 = 0.002,
                         .k6 = -0.001,
                         .s1 = 0.004,
                         .s2 = -0.003,
                         .s3 = 0.002,
                         .s4 = -0.005,
                         .lens = Lens::fisheye};
    const glm::dvec2 q = ray * (std::atan(std::sqrt(r2)) / std::sqrt(r2));
    const double w = glm::dot(q, q);
    const double six_terms =
        1 + w * (0.03 + w * (-0.02 + w * (0.01 + w * (-0.004 + w * (0.002 + w * -0.001)))));
    const glm::dvec2 expected =
        six_terms * q + tangential(q, 0.003, -0.002) + w * glm::dvec2(0.004 - 0.003 * w, 0.002 - 0.005 * w);
    EXPECT_NEAR(glm::length(scene::distort(six, ray) - expected), 0, 1e-15);
    for (const Distortion& lens : {four, six}) {
        const auto back = scene::undistort(lens, scene::distort(lens, ray));
        ASSERT_TRUE(back);
        EXPECT_NEAR(glm::length(*back - ray), 0, 1e-12);
        EXPECT_FALSE(scene::is_native(lens));
        io::ImageRecord record;
        record.distortion = lens;
        EXPECT_FALSE(io::fits_colmap(record));
    }
    EXPECT_FALSE(scene::is_native({.skew = 0.1}));
    // COLMAP's sphere is whole.
    io::ImageRecord sphere;
    sphere.camera.width = sphere.camera.height = 100;
    sphere.distortion.lens = Lens::equirectangular;
    scene::set_equirectangular(sphere.camera);
    EXPECT_TRUE(io::fits_colmap(sphere));
    sphere.camera.fy = sphere.camera.fx;
    EXPECT_FALSE(io::fits_colmap(sphere));
}

TEST(Lens, StaysOnTheSheetOfTheAxis) {
    // r (1 - 0.3 r^2 + 0.02 r^4) folds at r = 1.1393, where it is 0.7342, and comes back to 0.8 only past r
    // = 3.
    const Distortion folds{-0.3, 0.02};
    for (double r : {0.1, 0.9, 1.13}) {
        const auto ray = scene::undistort(folds, scene::distort(folds, {0, r}));
        ASSERT_TRUE(ray) << r;
        EXPECT_NEAR(ray->y, r, 1e-9);
        EXPECT_TRUE(scene::one_to_one(folds, {0, r}));
    }
    EXPECT_FALSE(scene::one_to_one(folds, {0, 1.15}));
    for (double r : {0.735, 0.8, 100.0}) EXPECT_FALSE(scene::undistort(folds, {0, r})) << r;
    EXPECT_FALSE(scene::undistort(folds, {0, NAN}));
}

TEST(Lens, AFisheyeSeesNothingBesideOrBehindItself) {
    Distortion fisheye;
    fisheye.lens = Lens::fisheye;
    EXPECT_FALSE(fisheye.none());
    const auto ray = scene::undistort(fisheye, {1.5, 0});
    ASSERT_TRUE(ray);
    EXPECT_NEAR(ray->x, std::tan(1.5), 1e-9);
    EXPECT_FALSE(scene::undistort(fisheye, {0, 1.6}));
    // 190 degrees from side to side: the whole border looks to the side or behind. COLMAP's bound on the size
    // holds.
    Camera source;
    source.width = source.height = 200;
    source.fx = source.fy = 60;
    source.cx = source.cy = 100;
    const Camera camera = scene::undistorted_camera(source, fisheye);
    EXPECT_EQ(camera.width, 400);
    EXPECT_EQ(camera.height, 400);
    EXPECT_EQ(camera.cx, 200);
}

Camera enlarged(Camera camera, int times) {
    camera.width *= times;
    camera.height *= times;
    for (double* value : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) *value *= times;
    return camera;
}

/// COLMAP's new size over the old by every pixel of the border.
glm::dvec2 exact_scale(const Camera& c, const Distortion& lens) {
    glm::dvec2 low(-HUGE_VAL), high(HUGE_VAL);
    const auto visit = [&](double x, double y, int axis, bool first) {
        const auto ray = scene::undistort(lens, {(x - c.cx) / c.fx, (y - c.cy) / c.fy});
        if (ray && first) low[axis] = std::max(low[axis], (*ray)[axis]);
        if (ray && !first) high[axis] = std::min(high[axis], (*ray)[axis]);
    };
    for (const bool first : {true, false}) {
        for (int y = 0; y < c.height; ++y) visit(first ? 0.5 : c.width - 0.5, y + 0.5, 0, first);
        for (int x = 0; x < c.width; ++x) visit(x + 0.5, first ? 0.5 : c.height - 0.5, 1, first);
    }
    const double x = std::min(-low.x * c.fx / c.cx, high.x * c.fx / (c.width - 0.5 - c.cx));
    const double y = std::min(-low.y * c.fy / c.cy, high.y * c.fy / (c.height - 0.5 - c.cy));
    return {std::clamp(x, 0.2, 2.0), std::clamp(y, 0.2, 2.0)};
}

TEST(Lens, TheBorderInStepsIsTheWholeBorder) {
    for (const Case& c : kCases) {
        const Frame frame = from_text(c);
        const Camera large = enlarged(frame.source, 11);
        const Camera camera = scene::undistorted_camera(large, frame.distortion);
        glm::dvec2 scale = exact_scale(large, frame.distortion);
        // Where a corner is not covered, both sides shrink in steps of 0.98.
        for (int i = 0; i < 50 && int(scale.x * large.width) > camera.width; ++i) scale *= 0.98;
        EXPECT_EQ(camera.width, int(scale.x * large.width)) << c.model;
        EXPECT_EQ(camera.height, int(scale.y * large.height)) << c.model;
    }
}

/// Of the processor's time, where every pixel of the border of one such picture takes half a minute.
TEST(Lens, TheSizeOfAPictureIsNoWork) {
    constexpr int kTimes = 6000;
    const std::clock_t begin = std::clock();
    for (const Case& c : kCases) {
        const Frame frame = from_text(c);
        const Camera camera = scene::undistorted_camera(enlarged(frame.source, kTimes), frame.distortion);
        // The border's pixels are finer, so that they lie up to half a small picture's pixel farther out.
        EXPECT_NEAR(double(camera.width) / kTimes, frame.camera.width, 4) << c.model;
        EXPECT_NEAR(double(camera.height) / kTimes, frame.camera.height, 4) << c.model;
    }
    EXPECT_LT(double(std::clock() - begin) / CLOCKS_PER_SEC, 10);
}

TEST(Lens, ACornerBeyondTheFoldShrinksThePicture) {
    // The sides have rays, the corners at |q| > 0.7342 have none.
    Camera source;
    source.width = 140;
    source.height = 100;
    source.fx = source.fy = 100;
    source.cx = 70;
    source.cy = 50;
    const Distortion folds{-0.3, 0.02};
    ASSERT_TRUE(scene::undistort(folds, {-0.695, 0}));
    ASSERT_FALSE(scene::undistort(folds, {-0.695, -0.495}));
    const Camera camera = scene::undistorted_camera(source, folds);
    EXPECT_GT(camera.width, source.width);
    for (double x : {0.5, camera.width - 0.5})
        for (double y : {0.5, camera.height - 0.5}) {
            const glm::dvec2 ray{(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy};
            EXPECT_TRUE(scene::one_to_one(folds, ray));
            const glm::dvec2 p = scene::distort(folds, ray);
            EXPECT_LE(std::abs(p.x), 0.7);
            EXPECT_LE(std::abs(p.y), 0.5);
        }
}

TEST(Lens, ALongerFocalLengthKeepsThePixels) {
    const Distortion d{
        .k1 = 0.1, .k2 = -0.05, .p1 = 0.01, .p2 = -0.02, .k3 = 0.01, .k4 = 0.03, .k5 = 0.02, .k6 = 0.04};
    for (const double factor : {0.9, 1.0, 1.2})
        for (const glm::dvec2& ray : kRays) {
            const glm::dvec2 is = scene::distort(scene::for_longer_focal(d, factor), ray);
            const glm::dvec2 want = scene::distort(d, factor * ray) / factor;
            EXPECT_NEAR(is.x, want.x, 1e-14);
            EXPECT_NEAR(is.y, want.y, 1e-14);
        }
}

}  // namespace
