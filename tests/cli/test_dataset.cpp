// SPDX-License-Identifier: Apache-2.0
// ewa dataset, and ewa train on a mesh scene.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "cli/expect.h"
#include "ewa/dataset.h"
#include "scene/readout.h"

namespace {

using namespace ewa::test;
namespace fs = std::filesystem;

const std::string kScenes = std::string(EWA_SOURCE_DIR) + "/scenes/";

std::vector<std::string> small(const std::string& scene, const std::string& folder) {
    return {"dataset", kScenes + scene, "-o",        folder, "--views",  "4",
            "--size",  "24x16",         "--samples", "2",    "--points", "200"};
}

TEST(Dataset, IsReadBackByOurOwnReader) {
    const Folder folder;
    const Outcome made = run_ewa(small("tea_table.gltf", folder / "d"));
    ASSERT_EQ(made.status, 0) << made.err;
    EXPECT_NE(made.out.find("4 views"), std::string::npos) << made.out;
    const ewa::Dataset dataset = ewa::load_dataset(folder / "d", {});
    ASSERT_EQ(dataset.frames.size(), 4u);
    EXPECT_TRUE(dataset.color_depends_on_view);
    EXPECT_GT(dataset.points.positions.size(), 30u);
    const nlohmann::json top = read_json(folder / "d/transforms.json");
    EXPECT_FALSE(top.contains("view_dependent"));
    for (const ewa::Frame& frame : dataset.frames) {
        EXPECT_EQ(frame.camera.width, 24);
        EXPECT_EQ(frame.camera.height, 16);
        EXPECT_GT(frame.camera.position().y, 0.0) << "the world stays the glTF's: y is up";
    }
    // Depth and points agree: each point lies on what some picture sees.
    const ewa::Image depth =
        ewa::load_image(folder / ("d/" + top["frames"][0]["depth_file_path"].get<std::string>()));
    const ewa::Camera& camera = dataset.frames[0].camera;
    int seen = 0;
    for (const glm::dvec3& point : dataset.points.positions) {
        const glm::dvec3 p = camera.rotation * point + camera.translation;
        const double x = camera.fx * p.x / p.z + camera.cx, y = camera.fy * p.y / p.z + camera.cy;
        if (!(x >= 0 && x < 24 && y >= 0 && y < 16)) continue;
        const double error = std::abs(x - std::floor(x) - 0.5) + std::abs(y - std::floor(y) - 0.5);
        if (error < 1e-3 && std::abs(double(*depth.at(int(x), int(y))) - p.z) < 1e-4 * p.z) ++seen;
    }
    EXPECT_GE(seen, 10);
    const Outcome info = run_ewa({"info", folder / "d"});
    EXPECT_EQ(info.status, 0) << info.err;
    EXPECT_EQ(info.out.find("does not depend on the view"), std::string::npos);
}

TEST(Dataset, SkyIsVisibleOrTransparent) {
    const Folder folder;
    std::vector<std::string> visible = small("railing.gltf", folder / "sky");
    visible.push_back("--sky");
    ASSERT_EQ(run_ewa(small("railing.gltf", folder / "clear")).status, 0);
    ASSERT_EQ(run_ewa(visible).status, 0);
    const ewa::Dataset clear = ewa::load_dataset(folder / "clear", {}),
                       sky = ewa::load_dataset(folder / "sky", {});
    int clear_pixels = 0;
    for (size_t i = 0; i < clear.frames.size(); ++i) {
        const ewa::Image a = ewa::load_image(clear.frames[i].image_path),
                         b = ewa::load_image(sky.frames[i].image_path);
        ASSERT_EQ(a.channels, 4);
        ASSERT_EQ(b.channels, 3);
        for (int y = 0; y < a.height; ++y)
            for (int x = 0; x < a.width; ++x) {
                for (int c = 0; c < 3 && a.at(x, y)[3] == 1; ++c) EXPECT_EQ(a.at(x, y)[c], b.at(x, y)[c]);
                if (a.at(x, y)[3] > 0) continue;
                EXPECT_GT(b.at(x, y)[2], 0.2f);
                ++clear_pixels;
            }
    }
    EXPECT_GT(clear_pixels, 20);
    visible.pop_back();
    EXPECT_EQ(run_ewa(visible).status, 2) << "images of other options are not replaced";
}

/// Points lie on the surfaces that pinholes see: every `step`th view of a dataset in this folder.
void expect_points_on_surfaces(const ewa::PointCloud& points, const ewa::Dataset& pinholes,
                               const std::string& folder, size_t step) {
    int seen = 0, there = 0;
    const nlohmann::json top = read_json(folder + "/transforms.json");
    for (size_t view = 0; view < pinholes.frames.size(); view += step) {
        const ewa::Camera& from = pinholes.frames[view].camera;
        const ewa::Image depth =
            ewa::load_image(folder + "/" + top["frames"][view]["depth_file_path"].get<std::string>());
        for (const glm::dvec3& point : points.positions) {
            const glm::dvec3 p = from.rotation * point + from.translation;
            const double x = from.fx * p.x / p.z + from.cx, y = from.fy * p.y / p.z + from.cy;
            if (!(p.z > 0 && x >= 0 && x < from.width && y >= 0 && y < from.height)) continue;
            const double z = double(*depth.at(int(x), int(y)));
            // Behind another surface a point says nothing; in front of all, it would be in the air.
            if (p.z > 1.03 * z) continue;
            ++seen;
            there += std::abs(p.z - z) < 0.03 * z;
        }
    }
    EXPECT_GT(seen, 100);
    EXPECT_GT(there, 0.94 * seen);
}

/// Points are where the rays of the lens meet the surfaces: on those that pinholes see from the same places.
TEST(Dataset, IsRenderedThroughLenses) {
    const Folder folder;
    const auto rendered = [&](const std::string& name, const std::vector<std::string>& more) {
        std::vector<std::string> all{"dataset",   kScenes + "tea_table.gltf",
                                     "-o",        folder / name,
                                     "--views",   "0",
                                     "--size",    "96x48",
                                     "--samples", "1",
                                     "--points",  "2000"};
        all.insert(all.end(), more.begin(), more.end());
        const Outcome made = run_ewa(all);
        EXPECT_EQ(made.status, 0) << made.err;
        return ewa::load_dataset(folder / name, {.lens = ewa::LensUse::native});
    };
    const ewa::Dataset pinholes = rendered("pinhole", {});
    for (const auto& [text, lens] : {std::pair{"fisheye:190", ewa::Lens::fisheye},
                                     {"equirectangular", ewa::Lens::equirectangular},
                                     {"orthographic", ewa::Lens::orthographic},
                                     {"opencv:-0.1,0.02,0.01,-0.01", ewa::Lens::brown}}) {
        SCOPED_TRACE(text);
        const ewa::Dataset dataset = rendered(text, {"--through", text});
        const ewa::Camera& camera = dataset.frames[0].camera;
        EXPECT_EQ(camera.distortion.lens, lens);
        EXPECT_FALSE(camera.distortion.none());
        EXPECT_EQ(camera.position(), pinholes.frames[0].camera.position());
        EXPECT_GT(dataset.points.positions.size(), 1900u) << "of the 2,000 that were asked for";
        expect_points_on_surfaces(dataset.points, pinholes, folder / "pinhole", 8);
    }
    const Outcome info = run_ewa({"info", folder / "equirectangular"});
    EXPECT_NE(info.out.find("rendered through 360 degrees"), std::string::npos) << info.out;
    const Outcome fisheye = run_ewa({"info", folder / "fisheye:190"});
    EXPECT_NE(fisheye.out.find("undistorted on loading from a fisheye"), std::string::npos) << fisheye.out;
    for (const auto& [name, lens] : {std::pair{"pinhole", "pinhole"},
                                     {"fisheye:190", "fisheye"},
                                     {"equirectangular", "equirectangular"},
                                     {"orthographic", "orthographic"},
                                     {"opencv:-0.1,0.02,0.01,-0.01", "opencv"}}) {
        const auto told = nlohmann::json::parse(run_ewa({"info", folder / name, "--json"}).out);
        EXPECT_EQ(told["cameras"][0]["lens"], lens);
    }
    const Outcome square = run_ewa({"dataset", kScenes + "tea_table.gltf", "-o", folder / "no", "--through",
                                    "equirectangular", "--size", "96x96"});
    EXPECT_EQ(square.status, 2);
    EXPECT_NE(square.err.find("--through equirectangular: a 360 degree image is twice as wide as high"),
              std::string::npos)
        << square.err;
    for (const char* wrong : {"fishey", "fisheye:x", "opencv", "opencv:1,2,3", "equirectangular:2",
                              "fisheye:400", "fisheye:1e-30", "opencv:1e300"})
        EXPECT_EQ(
            run_ewa({"dataset", kScenes + "tea_table.gltf", "-o", folder / "no", "--through", wrong}).status,
            2)
            << wrong;
}

/// Points are where the rays of the readout meet the surfaces, and the middle of the readout is where the camera usually is.
TEST(Dataset, IsRenderedByARollingShutter) {
    const Folder folder;
    const std::vector<std::string> all{"dataset",   kScenes + "tea_table.gltf",
                                       "--views",   "4",
                                       "--size",    "96x64",
                                       "--samples", "1",
                                       "--points",  "2000"};
    const auto rendered = [&](const std::string& name, std::vector<std::string> more) {
        more.insert(more.begin(), all.begin(), all.end());
        more.insert(more.end(), {"-o", folder / name});
        const Outcome made = run_ewa(more);
        EXPECT_EQ(made.status, 0) << made.err;
        return ewa::load_dataset(folder / name, {});
    };
    const ewa::Dataset still = rendered("still", {}),
                       rolling = rendered("rolling", {"--rolling-shutter", "right-to-left:5,4"});
    for (size_t i = 0; i < 4; ++i) {
        const ewa::Camera& camera = rolling.frames[i].camera;
        ASSERT_TRUE(camera.readout);
        EXPECT_EQ(camera.readout->from, ewa::ReadoutFrom::right);
        const ewa::scene::ReadoutMotion motion = ewa::scene::readout_motion(camera);
        EXPECT_NEAR(glm::length(motion.turn), glm::radians(5.0), 1e-9);
        EXPECT_GT(glm::length(motion.shift), 0);
        const ewa::Camera middle = ewa::scene::at_middle(camera);
        EXPECT_NEAR(glm::length(middle.position() - still.frames[i].camera.position()), 0, 1e-9);
        EXPECT_NE(read_file(folder / ("rolling/" + rolling.frames[i].name)),
                  read_file(folder / ("still/" + rolling.frames[i].name)));
    }
    expect_points_on_surfaces(rolling.points, still, folder / "still", 1);
    for (const char* wrong :
         {"top-to-bottom", "top-to-bottom:x", "up:3", "top-to-bottom:3,y", "top-to-bottom:91"})
        EXPECT_EQ(
            run_ewa({"dataset", kScenes + "tea_table.gltf", "-o", folder / "no", "--rolling-shutter", wrong})
                .status,
            2)
            << wrong;
    EXPECT_EQ(run_ewa({"dataset", kScenes + "tea_table.gltf", "-o", folder / "no", "--rolling-shutter",
                       "top-to-bottom:3", "--through", "equirectangular"})
                  .status,
              2);
}

TEST(Dataset, GoesOnWhereItWasEnded) {
    const Folder folder;
    ASSERT_EQ(run_ewa(small("railing.gltf", folder / "d")).status, 0);
    const std::string picture = read_file(folder / "d/images/view_002.png"),
                      depth = read_file(folder / "d/depth/view_002.exr");
    const std::string transforms = read_file(folder / "d/transforms.json");
    fs::remove(folder / "d/images/view_002.png");
    fs::remove(folder / "d/transforms.json");
    const Outcome again = run_ewa(small("railing.gltf", folder / "d"));
    EXPECT_EQ(again.status, 0) << again.err;
    EXPECT_NE(again.out.find("3 existed already"), std::string::npos) << again.out;
    EXPECT_TRUE(read_file(folder / "d/images/view_002.png") == picture);
    EXPECT_TRUE(read_file(folder / "d/depth/view_002.exr") == depth);
    EXPECT_TRUE(read_file(folder / "d/transforms.json") == transforms);
    // Another scene in the same folder: nothing of the first stays.
    auto other = small("plaster.gltf", folder / "d");
    other[5] = "3";
    expect_failure(run_ewa(other), 2,
                   "holds 4 views of another scene or other options; --force replaces them");
    EXPECT_TRUE(read_file(folder / "d/images/view_002.png") == picture);
    EXPECT_TRUE(read_file(folder / "d/transforms.json") == transforms);
    other.push_back("--force");
    EXPECT_EQ(run_ewa(other).status, 0);
    EXPECT_EQ(ewa::load_dataset(folder / "d", {}).frames.size(), 3u);
    EXPECT_FALSE(fs::exists(folder / "d/images/view_003.png"));
}

TEST(Dataset, OtherPeoplesFoldersAndWrongUseAreRefused) {
    const Folder folder;
    make_dataset(folder / "photos");
    expect_failure(run_ewa(small("plaster.gltf", folder / "photos")), 2, "photos");
    EXPECT_TRUE(fs::exists(folder / "photos/images/0.png"));
    // A record that is none of ours speaks for no folder; of ours, only what we wrote goes.
    fs::create_directories(folder / "list/images");
    write_file(folder / "list/photographs.json", "[]");
    write_file(folder / "list/images/mine.txt", "mine");
    expect_failure(run_ewa(small("plaster.gltf", folder / "list")), 2, "list");
    EXPECT_EQ(read_file(folder / "list/images/mine.txt"), "mine");
    ASSERT_EQ(run_ewa(small("plaster.gltf", folder / "ours")).status, 0);
    write_file(folder / "ours/images/mine.txt", "mine");
    auto railing = small("railing.gltf", folder / "ours");
    railing.push_back("--force");
    ASSERT_EQ(run_ewa(railing).status, 0);
    EXPECT_EQ(read_file(folder / "ours/images/mine.txt"), "mine");
    auto wrong = small("plaster.gltf", folder / "d");
    wrong[7] = "24by16";
    expect_failure(run_ewa(wrong), 2, "--size");
    wrong[7] = "0x16";
    expect_failure(run_ewa(wrong), 2, "--size");
    write_file(folder / "a.gltf",
               "{\"asset\":{\"version\":\"2.0\"},\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{}]}");
    expect_failure(run_ewa({"dataset", folder / "a.gltf", "-o", folder / "d"}), 2, "a.gltf");
    expect_failure(run_ewa({"dataset", folder / "none.gltf", "-o", folder / "d"}), 2, "none.gltf");
    EXPECT_FALSE(fs::exists(folder / "d"));
}

TEST(Dataset, ADiffuseSceneTrainsWithoutShAndThePlanSaysSo) {
    const Folder folder;
    ASSERT_EQ(run_ewa(small("plaster.gltf", folder / "d")).status, 0);
    EXPECT_EQ(read_json(folder / "d/transforms.json")["view_dependent"], false);
    EXPECT_NE(run_ewa({"info", folder / "d"}).out.find("does not depend on the view"), std::string::npos);
    const Outcome trained =
        run_ewa({"train", folder / "d", "-o", folder / "out", "--steps", "2", "--verbose"});
    ASSERT_EQ(trained.status, 0) << trained.err;
    EXPECT_NE(trained.out.find(
                  "left out: SH degrees 1 to 3 (the dataset says that no colour depends on the view, saves"),
              std::string::npos)
        << trained.out;
    EXPECT_EQ(read_json(folder / "out/config.json")["sh-degree"], 0);
    EXPECT_NE(read_file(folder / "out/splats.ply").find("property"), std::string::npos);
    EXPECT_EQ(read_file(folder / "out/splats.ply").find("f_rest_0"), std::string::npos);
    const Outcome asked = run_ewa(
        {"train", folder / "d", "-o", folder / "out2", "--steps", "2", "--verbose", "--sh-degree", "2"});
    ASSERT_EQ(asked.status, 0) << asked.err;
    EXPECT_EQ(asked.out.find("no colour depends on the view"), std::string::npos);
    EXPECT_EQ(read_json(folder / "out2/config.json")["sh-degree"], 2);
}

/// One triangle, and 8 cameras in a row: enough for the dome to be left out.
std::string leaf() {
    nlohmann::json scene = {{"asset", {{"version", "2.0"}}}, {"scene", 0}};
    scene["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 0.8}, {"znear", 0.1}}}}};
    scene["nodes"] = {{{"mesh", 0}}};
    scene["scenes"] = {{{"nodes", {0}}}};
    for (int i = 1; i <= 8; ++i) {
        scene["nodes"].push_back({{"camera", 0}, {"translation", {0.1 * i, 0.5, 2}}});
        scene["scenes"][0]["nodes"].push_back(i);
    }
    scene["meshes"] = {{{"primitives", {{{"attributes", {{"POSITION", 0}}}}}}}};
    scene["accessors"] = {{{"bufferView", 0}, {"componentType", 5126}, {"type", "VEC3"}, {"count", 3}}};
    scene["bufferViews"] = {{{"buffer", 0}, {"byteLength", 36}}};
    scene["buffers"] = {
        {{"byteLength", 36},
         {"uri", "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}}};
    return scene.dump();
}

TEST(Dataset, TrainRendersAMeshSceneFirst) {
    const Folder folder;
    write_file(folder / "leaf.gltf", leaf());
    const Outcome outcome = run_ewa({"train", folder / "leaf.gltf", "-o", folder / "out", "--steps", "2"});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("leaf: 7 views to train on, 1 held out, 256x256"), std::string::npos)
        << outcome.out;
    EXPECT_TRUE(fs::exists(folder / "out/dataset/transforms.json"));
    EXPECT_TRUE(fs::exists(folder / "out/splats.ply"));
    EXPECT_EQ(read_json(folder / "out/config.json")["dataset"], folder / "leaf.gltf");
    const Outcome again =
        run_ewa({"train", folder / "leaf.gltf", "-o", folder / "out", "--steps", "2", "--resume"});
    EXPECT_EQ(again.status, 0) << again.err;
    EXPECT_NE(again.out.find("8 existed already"), std::string::npos) << again.out;
    // Neither the run nor its dataset gives way to another scene.
    const std::string views = read_file(folder / "out/dataset/photographs.json");
    expect_failure(run_ewa({"train", kScenes + "plaster.gltf", "-o", folder / "out", "--steps", "2"}), 2,
                   "holds a finished run of 2 steps");
    EXPECT_EQ(read_file(folder / "out/dataset/photographs.json"), views);
    expect_failure(run_ewa({"train", folder / "none.glb", "-o", folder / "out3"}), 2, "none.glb");
    EXPECT_FALSE(fs::exists(folder / "out3"));
}

TEST(Dataset, EveryCommandTakesAMeshScene) {
    const Folder folder;
    const std::string scene = folder / "leaf.gltf", splats = folder / "out/splats.ply";
    write_file(scene, leaf());
    const Outcome info = run_ewa({"info", scene});
    EXPECT_EQ(info.status, 0) << info.err;
    for (const char* line :
         {"triangles       1\n", "views           8 of the file's cameras (7 train, 1 test"})
        EXPECT_NE(info.out.find(line), std::string::npos) << info.out;
    const auto json = nlohmann::json::parse(run_ewa({"info", scene, "--json"}).out);
    EXPECT_EQ(json["triangles"], 1);
    EXPECT_EQ(json["bounds"]["max"], (std::vector<double>{1, 1, 0}));
    EXPECT_EQ(
        run_ewa({"info", kScenes + "plaster.gltf", "--json"}).out.find("\"color_depends_on_view\": true"),
        std::string::npos);

    ASSERT_EQ(run_ewa({"train", scene, "-o", folder / "out", "--steps", "2"}).status, 0);
    const std::vector<std::string> eval{"eval", splats, scene, "--json", folder / "scene.json"};
    const Outcome beside = run_ewa(eval);
    ASSERT_EQ(beside.status, 0) << beside.err;
    EXPECT_EQ(beside.out.find("rendered"), std::string::npos) << "they lie beside the splats";
    ASSERT_EQ(run_ewa({"eval", splats, folder / "out/dataset", "--json", folder / "dataset.json"}).status, 0);
    const auto of_scene = read_json(folder / "scene.json");
    EXPECT_EQ(of_scene["psnr"], read_json(folder / "dataset.json")["psnr"]);
    EXPECT_EQ(of_scene["frames"], read_json(folder / "dataset.json")["frames"]);

    // As others would find them: without the images that the training rendered.
    fs::remove(folder / "out/dataset/depth/view_003.exr");
    const Outcome anew = run_ewa(eval);
    ASSERT_EQ(anew.status, 0) << anew.err;
    EXPECT_NE(anew.out.find("rendered 8/8 views"), std::string::npos) << anew.out;
    EXPECT_EQ(read_json(folder / "scene.json")["frames"], of_scene["frames"]);
    EXPECT_FALSE(fs::exists(folder / "out/dataset/depth/view_003.exr")) << "reading leaves a run as it is";
    EXPECT_EQ(run_ewa({"grad", splats, scene, "--frame", "2", "-o", folder / "g.ply"}).status, 0);

    for (const std::string& cameras : {scene, folder / "out/dataset"})
        ASSERT_EQ(run_ewa({"render", splats, "--cameras", cameras, "-o", cameras + ".pictures"}).status, 0);
    for (const char* name : {"view_000.png", "view_007.png"})
        EXPECT_TRUE(read_file(scene + ".pictures/" + name) ==
                    read_file(folder / ("out/dataset.pictures/" + std::string(name))));
}

TEST(Dataset, EveryCommandSaysWhatIsWrongWithAMeshScene) {
    const Folder folder;
    make_splats(folder / "s.ply");
    const std::string scene = folder / "bad.gltf", splats = folder / "s.ply";
    const std::vector<std::vector<std::string>> commands = {
        {"dataset", scene, "-o", folder / "d"},
        {"render", splats, "--cameras", scene, "-o", folder / "r"},
        {"eval", splats, scene},
        {"grad", splats, scene, "--frame", "0", "-o", folder / "g.ply"},
        {"bench", "--accuracy", scene}};
    write_file(scene, leaf().substr(0, 40));
    for (const auto& command : commands) expect_failure(run_ewa(command), 2, "byte");
    expect_success(run_ewa({"convert", splats, scene, "--quiet"}));
    for (const auto& command : commands) expect_failure(run_ewa(command), 2, "reach splats");
    fs::remove(scene);
    for (const auto& command : commands) expect_failure(run_ewa(command), 2, "bad.gltf");
    write_file(folder / "text.txt", "no dataset");
    expect_failure(run_ewa({"eval", splats, folder / "text.txt"}), 2, "glTF of meshes");
}

TEST(Dataset, FramesThatAreNotThereAreMissedBeforeRendering) {
    const Folder folder;
    make_splats(folder / "s.ply");
    const std::string scene = folder / "leaf.gltf", splats = folder / "s.ply";
    write_file(scene, leaf());
    const Outcome grad = run_ewa({"grad", splats, scene, "--frame", "99999", "-o", folder / "g.ply"});
    expect_failure(grad, 2, "frame 99999");
    EXPECT_EQ(grad.out, "");
    const Outcome eval = run_ewa({"eval", splats, scene, "--test-every", "0"});
    expect_failure(eval, 2, "test split");
    EXPECT_EQ(eval.out, "");
}

TEST(Dataset, AccuracyTrainsADiffuseSceneWithoutSh) {
    const Folder folder;
    ASSERT_EQ(run_ewa(small("plaster.gltf", folder / "d")).status, 0);
    ASSERT_EQ(run_ewa(small("tea_table.gltf", folder / "e")).status, 0);
    const std::pair<const char*, const char*> cases[] = {{"d", "of SH degree 0\n"},
                                                         {"e", "of SH degree 3\n"}};
    for (const auto& [name, text] : cases) {
        const Outcome outcome = run_ewa({"bench", "--accuracy", folder / name, "--training-steps", "1"});
        ASSERT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_NE(outcome.out.find(text), std::string::npos) << outcome.out;
    }
}

}  // namespace
