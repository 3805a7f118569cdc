// SPDX-License-Identifier: Apache-2.0
// Saved views on disk.
#include <gtest/gtest.h>

#include <cmath>

#include "io/datasets/refined_cameras.h"
#include "io/datasets/view_list.h"
#include "support/temp_folder.h"

namespace ewa::io {
namespace {

using test::TempFolder;

NamedView some_view() {
    NamedView view;
    view.name = "from \"above\"";
    view.camera.width = 640;
    view.camera.height = 480;
    view.camera.fx = 500.1;
    view.camera.fy = 1.0 / 3;
    view.camera.cx = -12;
    view.camera.cy = 1e-300;
    const double c = std::cos(0.3), s = std::sin(0.3);
    view.camera.rotation = glm::dmat3(c, s, 0, -s, c, 0, 0, 0, 1);
    view.camera.translation = {0.1, -2e6, 3};
    view.pivot = {1, 2, 0.7};
    return view;
}

TEST(ViewList, EveryNumberComesBack) {
    const TempFolder folder;
    const NamedView view = some_view();
    write_views(folder / "views.json", {view, NamedView{"", view.camera, {}}});
    const auto views = read_views(folder / "views.json");
    ASSERT_EQ(views.size(), 2u);
    EXPECT_EQ(views[0].name, view.name);
    EXPECT_EQ(views[0].camera.fy, view.camera.fy);
    EXPECT_EQ(views[0].camera.cy, view.camera.cy);
    EXPECT_EQ(views[0].camera.rotation, view.camera.rotation);
    EXPECT_EQ(views[0].camera.translation, view.camera.translation);
    EXPECT_EQ(views[0].pivot, view.pivot);
    EXPECT_EQ(views[1].name, "");
}

TEST(ViewList, TimesComeBackInTheirOrder) {
    const TempFolder folder;
    std::vector<NamedView> views(3, some_view());
    EXPECT_EQ(times_of(views, 1.5), (std::vector<double>{0, 1.5, 3}));
    views[0].time = 0;
    views[1].time = 1.0 / 3;
    views[2].time = 7.5;
    write_views(folder / "views.json", views);
    EXPECT_EQ(times_of(read_views(folder / "views.json"), 2), (std::vector<double>{0, 1.0 / 3, 7.5}));
    for (const std::optional<double>& wrong : {std::optional(-1.0), std::optional(7.5), std::optional(8.0),
                                               std::optional(2e6), std::optional<double>()}) {
        views[1].time = wrong;
        write_views(folder / "views.json", views);
        EXPECT_THROW(read_views(folder / "views.json"), InputError) << wrong.value_or(-2);
    }
}

TEST(ViewList, AReadoutComesBack) {
    const TempFolder folder;
    NamedView view = some_view();
    view.camera.readout = Readout{ReadoutFrom::right, glm::transpose(view.camera.rotation), {1, 2, 3}};
    write_views(folder / "views.json", {view, some_view()});
    const auto views = read_views(folder / "views.json");
    ASSERT_TRUE(views[0].camera.readout);
    EXPECT_EQ(views[0].camera.readout->from, ReadoutFrom::right);
    EXPECT_EQ(views[0].camera.readout->rotation, view.camera.readout->rotation);
    EXPECT_EQ(views[0].camera.readout->translation, view.camera.readout->translation);
    EXPECT_FALSE(views[1].camera.readout);
    std::ifstream file(folder / "views.json");
    std::string text((std::istreambuf_iterator<char>(file)), {});
    text.replace(text.find("right-to-left"), 5, "wrong");
    folder.write("bad.json", text);
    EXPECT_THROW(read_views(folder / "bad.json"), InputError);
}

TEST(ViewList, DamageIsRefusedWithItsPlace) {
    const TempFolder folder;
    write_views(folder / "good.json", {some_view(), some_view()});
    std::ifstream file(folder / "good.json");
    const std::string good((std::istreambuf_iterator<char>(file)), {});
    const auto refused = [&](const std::string& text, const std::string& part) {
        folder.write("bad.json", text);
        try {
            read_views(folder / "bad.json");
            ADD_FAILURE() << "taken: " << text.substr(0, 60);
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
        }
    };
    const auto with = [&](const std::string& from, const std::string& to) {
        std::string text = good;
        const size_t at = text.rfind(from);
        EXPECT_NE(at, std::string::npos) << from;
        return text.replace(at, from.size(), to);
    };
    EXPECT_THROW(read_views(folder / "none.json"), InputError);
    refused("", "not valid JSON");
    refused("{\"views\": " + std::string(3000000, '['), "nests deeper");
    refused("{\"views\": 3}", "not a list");
    refused(good.substr(0, good.size() / 2), "not valid JSON");
    refused("{\"views\": [3]}", "view 0");
    refused(with("\"width\": 640", "\"width\": 0"), "view 1: \"width\" is not a whole number of 1 to 65536");
    refused(with("\"width\": 640", "\"width\": 1e9"),
            "view 1: \"width\" is not a whole number of 1 to 65536");
    refused(with("\"fx\": 500.1", "\"fx\": -1"), "view 1: a focal length");
    refused(with("\"fx\": 500.1", "\"fx\": 1e999"), "not valid JSON");
    refused(with("\"fx\"", "\"gx\""), "view 1");
    refused(with("\"pivot\": [", "\"pivot\": [1,"), "\"pivot\" is not a list of 3");
    refused(with("\"rotation\": [", "\"rotation\": [0,0,0, 0,0,0, 0,0,0], \"other\": ["),
            "rotation is not orthonormal");
    refused(with("\"rotation\": [", "\"rotation\": [1,0,0, 0,1,0, 0,0,-1], \"other\": ["),
            "rotation is not orthonormal");
    refused(with("\"name\"", "\"aligned\": 3, \"name\""), "view 1: ");
}

TEST(RefinedCamerasFile, GivesFramesTheirCamerasAtTheirOwnSize) {
    const TempFolder folder;
    RefinedCamera refined{"b.png", "test", some_view().camera, {}, true};
    write_refined_cameras(folder / "cameras.json", {refined}, 2);
    Dataset dataset;
    dataset.frames.resize(2);
    dataset.frames[0].name = "a.png";
    dataset.frames[1].name = "b.png";
    for (Frame& frame : dataset.frames) frame.camera = Camera{64, 12, 1, 2, 3, 4, glm::dmat3(1), {}};
    EXPECT_TRUE(use_refined_cameras(dataset, folder / "cameras.json").aligned);
    EXPECT_EQ(dataset.frames[0].camera.fx, 1) << "a frame without a refined camera keeps its own";
    const Camera& camera = dataset.frames[1].camera;
    EXPECT_DOUBLE_EQ(camera.fx, 50.01);
    EXPECT_DOUBLE_EQ(camera.fy, 1.0 / 120);
    EXPECT_EQ(camera.cx, 3);
    EXPECT_EQ(camera.translation, refined.camera.translation);
    EXPECT_EQ(camera.rotation, refined.camera.rotation);
    dataset.frames.pop_back();
    EXPECT_THROW(use_refined_cameras(dataset, folder / "cameras.json"), InputError);
}

}  // namespace
}  // namespace ewa::io
