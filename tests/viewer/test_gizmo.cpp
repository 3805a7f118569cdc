// SPDX-License-Identifier: Apache-2.0
// The geometry of the editor's tools.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "scene/frustum.h"
#include "viewer/editor/gizmo.h"

namespace ewa::viewer {
namespace {

/// From (1, 2, -4), turned about two axes.
Camera tool_camera() {
    Camera camera;
    camera.width = 400;
    camera.height = 300;
    camera.fx = camera.fy = 350;
    camera.cx = 210;
    camera.cy = 140;
    camera.rotation = turn_about({0, 1, 0}, 0.3) * turn_about({1, 0, 0}, -0.2);
    camera.translation = -(camera.rotation * glm::dvec3(1, 2, -4));
    return camera;
}

Camera parallel_camera() {
    Camera camera = tool_camera();
    camera.fx = camera.fy = 80;
    camera.distortion.lens = Lens::orthographic;
    return camera;
}

void expect_point(const glm::dvec3& point, const glm::dvec3& expected, double tolerance = 1e-9) {
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(point[axis], expected[axis], tolerance) << axis;
}

glm::dvec3 transformed(const glm::dmat4& matrix, const glm::dvec3& point) {
    return glm::dvec3(matrix * glm::dvec4(point, 1));
}

TEST(Gizmo, RaysPassThroughThePointsOfTheirPixels) {
    const glm::dvec3 point(0.4, 1.1, 2);
    for (const Camera& camera : {tool_camera(), parallel_camera()}) {
        const auto pixel = projected(point, camera);
        ASSERT_TRUE(pixel);
        const auto ray = ray_through(camera, *pixel);
        ASSERT_TRUE(ray);
        EXPECT_NEAR(glm::length(ray->direction), 1, 1e-12);
        const double along = glm::dot(point - ray->origin, ray->direction);
        EXPECT_GT(along, 0);
        expect_point(ray->origin + ray->direction * along, point);
        EXPECT_LT(glm::dot(ray->direction, towards_viewer(camera, point)), -0.99);
    }
}

TEST(Gizmo, APixelShowsSoManyWorldUnits) {
    for (const Camera& camera : {tool_camera(), parallel_camera()}) {
        const glm::dvec3 point(0.4, 1.1, 2);
        const glm::dvec3 right(camera.rotation[0][0], camera.rotation[1][0], camera.rotation[2][0]);
        const auto here = projected(point, camera),
                   there = projected(point + right * world_per_pixel(camera, point), camera);
        ASSERT_TRUE(here && there);
        EXPECT_NEAR(there->x - here->x, 1, 1e-9);
    }
}

TEST(Gizmo, DragsAlongAnAxisFollowThePointer) {
    const Camera camera = tool_camera();
    const glm::dvec3 origin(0.2, 0.5, 1), axis = glm::normalize(glm::dvec3(1, 0.5, -0.2));
    for (const double way : {-0.7, 0.0, 1.3}) {
        const auto pixel = projected(origin + axis * way, camera);
        const auto along = along_axis(*ray_through(camera, *pixel), origin, axis);
        ASSERT_TRUE(along);
        EXPECT_NEAR(*along, way, 1e-9);
    }
    // Beside the axis, its nearest point counts.
    EXPECT_NEAR(*along_axis({{3, 1, -5}, {0, 0, 1}}, {1, 0, 0}, {1, 0, 0}), 2, 1e-12);
    EXPECT_FALSE(along_axis({{0, 0, -5}, {0, 0, 1}}, {1, 0, 0}, {0, 0, 1})) << "seen from its end";
}

TEST(Gizmo, DragsInAPlaneFollowThePointer) {
    const auto point = on_plane({{0.5, 0.25, -5}, {0, 0, 1}}, {7, 8, 2}, {0, 0, 1});
    ASSERT_TRUE(point);
    expect_point(*point, {0.5, 0.25, 2});
    EXPECT_FALSE(on_plane({{0, 0, -5}, {0, 0, 1}}, {0, 1, 0}, {0, 1, 0})) << "seen edge-on";
    EXPECT_FALSE(on_plane({{0, 0, -5}, {0, 0, 1}}, {0, 0, -6}, {0, 0, 1})) << "behind the viewer";
}

TEST(Gizmo, AnglesAreRightHanded) {
    const glm::dvec3 z(0, 0, 1);
    EXPECT_NEAR(angle_about(z, {1, 0, 3}, {0, 2, -1}), std::numbers::pi / 2, 1e-12);
    EXPECT_NEAR(angle_about(z, {1, 0, 0}, {1, -1, 0}), -std::numbers::pi / 4, 1e-12);
    expect_point(turn_about(z, std::numbers::pi / 2) * glm::dvec3(1, 0, 5), {0, 1, 5});
    const glm::dvec3 axis = glm::normalize(glm::dvec3(1, -2, 0.5)), arm(0.3, 1, 2);
    EXPECT_NEAR(angle_about(axis, arm, turn_about(axis, 0.7) * arm), 0.7, 1e-12);
}

TEST(Gizmo, NiceUnitsAndSnapping) {
    EXPECT_DOUBLE_EQ(nice_unit(1), 1);
    EXPECT_DOUBLE_EQ(nice_unit(0.0499), 0.02);
    EXPECT_DOUBLE_EQ(nice_unit(0.05), 0.05);
    EXPECT_DOUBLE_EQ(nice_unit(1999), 1000);
    EXPECT_DOUBLE_EQ(snapped(0.34, 0.1), 0.3);
    EXPECT_DOUBLE_EQ(snapped(-0.36, 0.1), -0.4);
    EXPECT_EQ(snapped(0.34, 0), 0.34);
}

TEST(Gizmo, MatricesKeepTheirCentre) {
    const glm::dvec3 center(1, 2, 3);
    const glm::dmat4 matrix = about(center, glm::dmat3(2.0));
    expect_point(transformed(matrix, center), center);
    expect_point(transformed(matrix, {2, 2, 3}), {3, 2, 3});
    EXPECT_EQ(matrix_text(matrix), "2,0,0,-1,0,2,0,-2,0,0,2,-3");
    EXPECT_EQ(matrix_text(glm::dmat4(glm::dmat3(0, 1, 0, -1, 0, 0, 0, 0, 1))), "0,-1,0,0,1,0,0,0,0,0,1,0");
    EXPECT_EQ(point_text({1.0 / 3, -2, 1e-12}), "0.333333333,-2,1e-12");
}

TEST(Gizmo, LevelsThePlaneOfThreePoints) {
    const std::array<glm::dvec3, 3> points{glm::dvec3(0, 1, 0), glm::dvec3(1, 1.5, 0.2),
                                           glm::dvec3(-0.3, 2, 2)};
    const glm::dvec3 normal = glm::normalize(glm::cross(points[1] - points[0], points[2] - points[0]));
    const glm::dvec3 middle = (points[0] + points[1] + points[2]) / 3.0;
    for (const double side : {-1.0, 1.0}) {
        const glm::dvec3 viewer = normal * side + 0.3 * (points[1] - points[0]);
        const auto matrix = level_matrix(points, viewer);
        ASSERT_TRUE(matrix);
        for (const glm::dvec3& point : points) EXPECT_NEAR(transformed(*matrix, point).y, 0, 1e-12);
        expect_point(transformed(*matrix, middle), {middle.x, 0, middle.z});
        expect_point(glm::dmat3(*matrix) * normal * side, {0, -1, 0});
        EXPECT_NEAR(glm::determinant(glm::dmat3(*matrix)), 1, 1e-12);
    }
    // Level already, and upside down.
    const std::array<glm::dvec3, 3> flat{glm::dvec3(0, 0, 0), glm::dvec3(1, 0, 0), glm::dvec3(0, 0, 1)};
    expect_point(transformed(*level_matrix(flat, {0, -1, 0}), {3, 4, 5}), {3, 4, 5});
    EXPECT_NEAR(transformed(*level_matrix(flat, {0, 1, 0}), {3, 4, 5}).y, -4, 1e-12);
    EXPECT_FALSE(level_matrix({glm::dvec3(0), glm::dvec3(1, 1, 1), glm::dvec3(2, 2, 2.001)}, {0, -1, 0}));
}

TEST(Gizmo, ACarriedCameraShowsTheSame) {
    const glm::dmat4 matrix = about({3, -1, 2}, 2.5 * turn_about(glm::normalize(glm::dvec3(1, 2, 3)), 0.8));
    const Camera camera = tool_camera(), moved = carried(camera, matrix);
    const glm::dvec3 point(0.4, 1.1, 2);
    const auto before = projected(point, camera), after = projected(transformed(matrix, point), moved);
    ASSERT_TRUE(before && after);
    EXPECT_NEAR(after->x, before->x, 1e-9);
    EXPECT_NEAR(after->y, before->y, 1e-9);
    expect_point(moved.position(), transformed(matrix, camera.position()));
}

TEST(Gizmo, DistancesToLines) {
    EXPECT_DOUBLE_EQ(distance_to_segment({2, 3}, {0, 0}, {10, 0}), 3);
    EXPECT_DOUBLE_EQ(distance_to_segment({13, 4}, {0, 0}, {10, 0}), 5);
    EXPECT_DOUBLE_EQ(distance_to_segment({3, 4}, {0, 0}, {0, 0}), 5);
    EXPECT_DOUBLE_EQ(distance_to_line({12, 5}, {{0, 0}, {10, 0}, {10, 10}}), 2);
    EXPECT_DOUBLE_EQ(distance_to_line({3, 4}, {{0, 0}}), 5);
    EXPECT_TRUE(std::isinf(distance_to_line({3, 4}, {})));
}

TEST(Gizmo, SimplifiedLinesStayClose) {
    std::vector<glm::dvec2> line;
    for (int i = 0; i <= 500; ++i) line.emplace_back(i, 40 * std::sin(i * 0.02));
    const std::vector<glm::dvec2> fewer = simplified(line, 0.5);
    EXPECT_LT(fewer.size(), 60u);
    EXPECT_EQ(fewer.front(), line.front());
    EXPECT_EQ(fewer.back(), line.back());
    for (const glm::dvec2& point : line) EXPECT_LE(distance_to_line(point, fewer), 0.5);
    EXPECT_EQ(simplified({{0, 0}, {1, 0}, {2, 0}}, 0.5).size(), 2u);
    EXPECT_EQ(simplified({{0, 0}, {5, 5}, {0, 0}}, 0.5).size(), 3u) << "a way there and back";
}

TEST(Gizmo, AStrokeCoversWhatIsNearIt) {
    const std::vector<glm::dvec2> line{{20, 20}, {60, 35}, {25, 50}};
    constexpr double kRadius = 8;
    const std::vector<StrokeSpan> spans = stroke_spans(line, kRadius, 1);
    for (double y = 0.5; y < 70; ++y)
        for (double x = 0.25; x < 80; ++x) {
            // The rows begin at 12, so their middles are at these y.
            int covers = 0;
            for (const StrokeSpan& span : spans)
                covers += std::abs(span.y - y) < 1e-9 && x >= span.low && x <= span.high;
            EXPECT_EQ(covers, distance_to_line({x, y}, line) <= kRadius ? 1 : 0) << x << ' ' << y;
        }
    EXPECT_TRUE(stroke_spans({}, kRadius, 1).empty());
    double area = 0;
    for (const StrokeSpan& span : stroke_spans({{5, 5}}, kRadius, 0.1)) area += 0.1 * (span.high - span.low);
    EXPECT_NEAR(area, std::numbers::pi * kRadius * kRadius, 0.2);
}

}  // namespace
}  // namespace ewa::viewer
