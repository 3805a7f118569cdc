// SPDX-License-Identifier: Apache-2.0
// The axes of a found model: similarities by GPS that is off, the ground, and what determines nothing.
#include "capture/world_axes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <random>
#include <string>

#include "io/splats/tileset.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using capture::PhotoFacts;
using capture::SparseModel;
using capture::WorldAxes;
using image::GpsFix;

using Facts = std::map<std::string, PhotoFacts>;

const io::Place kPlace{55.7, 13.19, 40};

/// x east, y down, z north of kPlace.
GpsFix fix_at(const glm::dvec3& at) {
    constexpr double kMetresOfDegree = 6371000 * 3.14159265358979 / 180;
    // The inverse of the map from degrees to metres by Newton's method, whose Jacobian is about that of a sphere.
    io::Place there = kPlace;
    const glm::dmat4 from_earth = glm::inverse(io::earth_of_place(kPlace));
    for (int round = 0; round < 20; ++round) {
        const glm::dvec3 off = at - glm::dvec3(from_earth * io::earth_of_place(there)[3]);
        there.latitude += off.z / kMetresOfDegree;
        there.longitude += off.x / (kMetresOfDegree * std::cos(glm::radians(kPlace.latitude)));
        there.height -= off.y;
    }
    return {there.latitude, there.longitude, there.height};
}

/// A camera at a place of the world (y down) with a heading and a pitch upwards, in degrees.
void add_photo(SparseModel& model, const glm::dvec3& at, double heading, double pitch, double roll = 0) {
    const glm::dmat3 axes = glm::mat3_cast(glm::angleAxis(glm::radians(heading), glm::dvec3(0, 1, 0)) *
                                           glm::angleAxis(glm::radians(pitch), glm::dvec3(1, 0, 0)) *
                                           glm::angleAxis(glm::radians(roll), glm::dvec3(0, 0, 1)));
    const glm::dmat3 rotation = glm::transpose(axes);
    const glm::dquat q = glm::quat_cast(rotation);
    const glm::dvec3 t = -(rotation * at);
    const auto id = uint32_t(model.images.size() + 1);
    model.images[id] = {{q.w, q.x, q.y, q.z, t.x, t.y, t.z}, 1, std::to_string(id) + ".jpg", {}};
    model.cameras[1] = {2, 800, 600, {700, 400, 300, 0}};
}

/// A ground at this height (y down) with things on it.
void add_ground(SparseModel& model, double y) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> side(-60, 60), above(0, 15), rough(-0.05, 0.05);
    for (uint64_t i = 0; i < 3000; ++i) {
        const glm::dvec3 at(side(random), i % 3 == 0 ? y - above(random) : y + rough(random), side(random));
        model.points[i + 1] = {at, {}, 1, {{1, 0}, {2, 0}, {3, 0}}};
    }
}

/// The model as COLMAP might have it.
void hide_axes(SparseModel& model) {
    const glm::dmat3 turn =
        glm::mat3_cast(glm::angleAxis(glm::radians(140.0), glm::normalize(glm::dvec3(0.3, 0.8, -0.5))));
    capture::move(model, 0.13, turn, {3, -2, 7});
}

double degrees_between(const glm::dvec3& a, const glm::dvec3& b) {
    return glm::degrees(
        std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)));  // small angles keep their digits
}

/// The direction of the hidden world's axis after these axes, which has to be itself.
double error_of_axis(SparseModel hidden, const WorldAxes& axes, const SparseModel& truth, int axis) {
    capture::move(hidden, axes.scale, axes.rotation, axes.shift);
    const glm::dmat3 turn = glm::transpose(capture::camera_of(hidden, hidden.images.at(1)).rotation) *
                            capture::camera_of(truth, truth.images.at(1)).rotation;
    glm::dvec3 unit(0);
    unit[axis] = 1;
    return degrees_between(turn * unit, unit);
}

/// GPS of a model's photos with these errors in metres, alike along the path as those of phones are.
Facts gps_of(const SparseModel& model, double plane, double height) {
    std::mt19937 random(9);
    std::normal_distribution<double> normal;
    Facts facts;
    glm::dvec3 drift(0);
    for (const auto& [id, image] : model.images) {
        const glm::dvec3 off(plane * normal(random), height * normal(random), plane * normal(random));
        drift = 0.5 * drift + 0.5 * off;
        facts[image.name].gps = fix_at(capture::camera_of(model, image).position() + drift + 0.5 * off);
    }
    return facts;
}

SparseModel round_walk() {
    SparseModel model;
    std::mt19937 random(2);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 30; ++i) {
        const double angle = 0.2 * i;
        add_photo(model, {40 * std::cos(angle), -1.6, 30 * std::sin(angle)}, 12.0 * i,
                  -5 + 3 * normal(random), 1.5 * normal(random));
    }
    add_ground(model, 0);
    return model;
}

TEST(WorldAxes, GpsOfPhonesGivesScaleNorthAndPlaceAndFarOnesCountForNothing) {
    const SparseModel truth = round_walk();
    Facts facts = gps_of(truth, 3, 8);
    facts["4.jpg"].gps = fix_at({900, 0, -400});
    facts["17.jpg"].gps = fix_at({-5000, 0, 100});
    SparseModel hidden = truth;
    hide_axes(hidden);
    const WorldAxes axes = capture::world_axes(hidden, facts);
    ASSERT_TRUE(axes.place) << axes.text;
    EXPECT_NEAR(axes.scale * 0.13, 1, 0.05);
    EXPECT_LT(error_of_axis(hidden, axes, truth, 1), 1.5);
    EXPECT_LT(error_of_axis(hidden, axes, truth, 2), 4);
    // A point of the model is where it is on the earth.
    capture::move(hidden, axes.scale, axes.rotation, axes.shift);
    const glm::dvec3 found = capture::camera_of(hidden, hidden.images.at(1)).position(),
                     there(io::earth_of_place(*axes.place) * glm::dvec4(found, 1)),
                     right(io::earth_of_place(kPlace) *
                           glm::dvec4(capture::camera_of(truth, truth.images.at(1)).position(), 1));
    EXPECT_LT(glm::distance(there, right), 8);
    EXPECT_NE(axes.text.find("30 photos"), std::string::npos) << axes.text;
}

TEST(WorldAxes, OnALineTheCamerasSayWhichWayIsUp) {
    SparseModel truth;
    for (int i = 0; i < 25; ++i) add_photo(truth, {3.0 * i, -1.6, 4.0 * i}, 30 + 10 * std::sin(i), 8, i % 2);
    SparseModel hidden = truth;
    hide_axes(hidden);
    const WorldAxes axes = capture::world_axes(hidden, gps_of(truth, 2, 4));
    ASSERT_TRUE(axes.place) << axes.text;
    EXPECT_NEAR(axes.scale * 0.13, 1, 0.06);
    // The cameras look up by 8 degrees, and nothing else says where up is.
    EXPECT_LT(error_of_axis(hidden, axes, truth, 1), 9);
}

/// Rows there and back, straight down, over hills.
SparseModel survey(bool turns) {
    SparseModel model;
    for (int row = 0; row < 3; ++row)
        for (int i = 0; i < 6; ++i)
            add_photo(model, {15.0 * i, -80, 20.0 * row}, turns && row % 2 == 1 ? 270 : 90, -90);
    add_ground(model, 0);
    return model;
}

TEST(WorldAxes, PhotosStraightDownAreLevelledByAltitudesOrByTheGround) {
    for (const bool turns : {false, true}) {
        const SparseModel truth = survey(turns);
        SparseModel hidden = truth;
        hide_axes(hidden);
        const WorldAxes by_gps = capture::world_axes(hidden, gps_of(truth, 0.5, 0.2));
        ASSERT_TRUE(by_gps.place) << by_gps.text;
        EXPECT_NEAR(by_gps.scale * 0.13, 1, 0.02);
        EXPECT_LT(error_of_axis(hidden, by_gps, truth, 1), 1.5) << by_gps.text;
        const WorldAxes by_ground = capture::world_axes(hidden, {});
        EXPECT_EQ(by_ground.text, "levelled by the ground");
        EXPECT_EQ(by_ground.scale, 1);
        capture::move(hidden, by_ground.scale, by_ground.rotation, by_ground.shift);
        const glm::dmat3 view = capture::camera_of(hidden, hidden.images.at(1)).rotation;
        EXPECT_LT(degrees_between(glm::transpose(view)[2], {0, 1, 0}), 1);  // down
    }
}

TEST(WorldAxes, WithoutGpsTheGroundLevelsElseTheCameras) {
    SparseModel hidden = round_walk();
    hide_axes(hidden);
    const auto down_error = [](SparseModel model, const WorldAxes& axes) {
        capture::move(model, axes.scale, axes.rotation, axes.shift);
        glm::dvec3 sum(0);
        for (const auto& [id, image] : model.images)
            sum += glm::transpose(capture::camera_of(model, image).rotation)[1];
        return degrees_between(sum, {0, 1, 0});
    };
    const WorldAxes ground = capture::world_axes(hidden, {});
    EXPECT_EQ(ground.text, "levelled by the ground");
    EXPECT_LT(down_error(hidden, ground), 1.5);
    // The pixels of a phone that is held upright lie on their side.
    Facts turned;
    SparseModel on_side = round_walk();
    on_side.points.clear();
    for (auto& [id, image] : on_side.images) {
        const glm::dquat stored = glm::angleAxis(glm::radians(90.0), glm::dvec3(0, 0, -1));
        const glm::dquat q = stored * glm::dquat(image.pose[0], image.pose[1], image.pose[2], image.pose[3]);
        const glm::dvec3 t = stored * glm::dvec3(image.pose[4], image.pose[5], image.pose[6]);
        image.pose = {q.w, q.x, q.y, q.z, t.x, t.y, t.z};
        turned[image.name].orientation = 6;
    }
    hide_axes(on_side);
    const WorldAxes cameras = capture::world_axes(on_side, turned);
    EXPECT_EQ(cameras.text, "levelled by the cameras");
    capture::move(on_side, cameras.scale, cameras.rotation, cameras.shift);
    glm::dvec3 up(0);
    for (const auto& [id, image] : on_side.images)
        up -= glm::transpose(capture::camera_of(on_side, image).rotation)[0];
    EXPECT_LT(degrees_between(up, {0, -1, 0}), 1.5);
}

TEST(WorldAxes, GpsThatFitsNoCamerasOnlyLevels) {
    SparseModel hidden = round_walk();
    const Facts far = gps_of(hidden, 80, 10);
    hide_axes(hidden);
    const WorldAxes axes = capture::world_axes(hidden, far);
    EXPECT_FALSE(axes.place);
    EXPECT_EQ(axes.scale, 1);
    EXPECT_NE(axes.text.find("does not fit the cameras"), std::string::npos) << axes.text;
    Facts frozen;
    for (const auto& [id, image] : hidden.images) frozen[image.name].gps = fix_at({0, 0, 0});
    EXPECT_NE(capture::world_axes(hidden, frozen).text.find("too few places"), std::string::npos);
}

TEST(WorldAxes, WhatIsNotFiniteOrShowsNothingKeepsTheAxes) {
    SparseModel one;
    add_photo(one, {0, 0, 0}, 0, 0);
    one.images[1].pose[4] = std::nan("");
    EXPECT_EQ(capture::world_axes(one, {}).text, "");
    EXPECT_EQ(capture::world_axes(one, {}).rotation, glm::dmat3(1));
    EXPECT_EQ(capture::world_axes({}, {}).text, "");
    SparseModel all_ways;
    for (int i = 0; i < 8; ++i) add_photo(all_ways, {double(i), 0, 0}, 0, 0, 45.0 * i);
    for (auto& [id, image] : all_ways.images) image.features.clear();
    const WorldAxes axes = capture::world_axes(all_ways, {});
    for (int k = 0; k < 3; ++k) EXPECT_TRUE(std::isfinite(axes.rotation[k][k]));
}

/// An EXIF block with these entries of the GPS directory, little-endian.
struct ExifGps {
    std::string block = std::string("II*\0\x08\0\0\0", 8);
    void add(uint64_t value, int bytes) {
        for (int i = 0; i < bytes; ++i) block += char(value >> (8 * i) & 0xff);
    }
    ExifGps(const std::string& sides, const std::array<uint32_t, 6>& latitude,
            const std::array<uint32_t, 6>& longitude, uint32_t below = 0) {
        constexpr uint32_t kGps = 26, kValues = kGps + 2 + 6 * 12 + 4;
        add(1, 2), add(34853, 2), add(4, 2), add(1, 4), add(kGps, 4), add(0, 4);
        add(6, 2);
        add(1, 2), add(2, 2), add(2, 4), add(uint64_t(sides[0]), 4);
        add(2, 2), add(5, 2), add(3, 4), add(kValues, 4);
        add(3, 2), add(2, 2), add(2, 4), add(uint64_t(sides[1]), 4);
        add(4, 2), add(5, 2), add(3, 4), add(kValues + 24, 4);
        add(5, 2), add(1, 2), add(1, 4), add(below, 4);
        add(6, 2), add(5, 2), add(1, 4), add(kValues + 48, 4);
        add(0, 4);
        for (const auto& values : {latitude, longitude})
            for (const uint32_t value : values) add(value, 4);
        add(1234, 4), add(10, 4);
    }
    std::optional<GpsFix> fix(size_t bytes = SIZE_MAX) const {
        return image::exif_shot(block.data(), std::min(bytes, block.size())).gps;
    }
};

TEST(GpsOfExif, PlacesAreReadAndThoseWithoutAFixAreNot) {
    const std::array<uint32_t, 6> north{55, 1, 42, 1, 3012, 100}, east{13, 1, 11, 1, 24, 1},
        zero{0, 1, 0, 1, 0, 1};
    const auto fix = ExifGps("SE", north, east, 1).fix();
    ASSERT_TRUE(fix);
    EXPECT_DOUBLE_EQ(fix->latitude, -(55 + 42 / 60.0 + 30.12 / 3600));
    EXPECT_DOUBLE_EQ(fix->longitude, 13 + 11 / 60.0 + 24 / 3600.0);
    EXPECT_DOUBLE_EQ(fix->altitude.value(), -123.4);
    EXPECT_FALSE(ExifGps("NE", zero, zero).fix());
    EXPECT_FALSE(ExifGps("NE", {0, 0, 0, 0, 0, 0}, east).fix());
    EXPECT_FALSE(ExifGps("NE", {91, 1, 0, 1, 0, 1}, east).fix());
    EXPECT_FALSE(ExifGps("NE", north, {4000000000, 1, 0, 1, 0, 1}).fix());
    EXPECT_FALSE(ExifGps("XE", north, east).fix());
    // A block that is cut off.
    const ExifGps whole("NE", north, east);
    for (size_t bytes = 0; bytes < whole.block.size() - 8; ++bytes) EXPECT_FALSE(whole.fix(bytes)) << bytes;
}

TEST(PlaceOfSplats, CommentKeepsAllDigitsAndDamagedOnesAreNone) {
    const io::Place place{55.70512345678901, -13.193456789012345, -0.125};
    const auto read = io::place_in({"Generated by something", io::place_comment(place)});
    ASSERT_TRUE(read);
    EXPECT_EQ(read->latitude, place.latitude);
    EXPECT_EQ(read->longitude, place.longitude);
    EXPECT_EQ(read->height, place.height);
    for (const char* comment :
         {"ewa place ", "ewa place 1 2", "ewa place 91 0 0", "ewa place nan 0 0", "place 1 2 3"})
        EXPECT_FALSE(io::place_in({comment})) << comment;
    EXPECT_FALSE(io::place_in({"ewa place 1 2 3", "ewa place 1 2 4"}));
}

/// Files of other programs have other axes, and a damaged one ends no run.
TEST(PlaceOfSplats, FileIsReadIfItIsOurs) {
    const test::TempFolder folder;
    EXPECT_FALSE(io::read_place(folder.path()));
    io::write_place(folder / io::kPlaceFile, {55.5, 13.25, 40});
    const auto place = io::read_place(folder.path());
    ASSERT_TRUE(place);
    EXPECT_EQ(place->latitude, 55.5);
    EXPECT_EQ(place->longitude, 13.25);
    EXPECT_EQ(place->height, 40);
    for (const char* text :
         {"", "{", "[]", R"({"latitude": 1, "longitude": 2, "height": 3})",
          R"({"axes": "x east, y down, z north, metres", "latitude": 91, "longitude": 2, "height": 3})",
          R"({"axes": 5, "latitude": 1, "longitude": 2, "height": 3})"}) {
        folder.write(io::kPlaceFile, text);
        EXPECT_FALSE(io::read_place(folder.path())) << text;
    }
}

}  // namespace
