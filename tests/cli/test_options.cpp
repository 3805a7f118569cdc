// SPDX-License-Identifier: Apache-2.0
// Options that several commands have, one by one: each changes the figures or the files of its command.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <set>

#include "cli/cameras_test.h"
#include "ewa/image.h"
#include "ewa/splat_files.h"

namespace {

using namespace ewa::test;
using Words = std::vector<std::string>;

/// Four images through a lens, the first with a mask, and splats whose colour depends on the view.
class OptionEffects : public testing::Test {
  protected:
    void SetUp() override {
        make_dataset(folder / "data");
        auto json = read_json(folder / "data/transforms.json");
        json["camera_model"] = "OPENCV";
        json["k1"] = 0.2;
        write_file(folder / "data/transforms.json", json.dump());
        make_splats(folder / "s.ply");
        ewa::Gaussians splats = ewa::load_splats(folder / "s.ply");
        for (size_t i = 0; i < splats.sh.size(); ++i) splats.sh[i] += 0.2f * float(i % 7) - 0.6f;
        ewa::save_splats(folder / "s.ply", splats);
    }
    void put_mask() {
        ewa::Image mask(48, 32, 3);
        for (size_t i = 0; i < mask.pixels.size() / 2; ++i) mask.pixels[i] = 1;
        std::filesystem::create_directories(folder / "data/masks");
        ewa::save_image(folder / "data/masks/0.png", mask);
    }
    static Outcome run_with(Words arguments, const Words& more) {
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_ewa(arguments);
    }
    /// None of the options leaves the figure as it is, and no two make it the same.
    template <class Figure>
    static void expect_all_differ(const std::function<Figure(const Words&)>& figure,
                                  const std::vector<Words>& options) {
        std::set<Figure> seen{figure({})};
        for (const Words& more : options) EXPECT_TRUE(seen.insert(figure(more)).second) << more.back();
    }
    Folder folder;
};

TEST_F(OptionEffects, OfEvalAreInItsFigures) {
    const auto psnr = [&](const Words& more) {
        expect_success(run_with(
            {"eval", folder / "s.ply", folder / "data", "--split", "all", "--json", folder / "e.json"},
            more));
        return read_json(folder / "e.json")["psnr"].get<double>();
    };
    expect_all_differ<double>(psnr, {{"--max-width", "20"},
                                     {"--lens", "native"},
                                     {"--points"},
                                     {"--points", "--nearest", "1"},
                                     {"--sh-degree", "0"},
                                     {"--integrator", "march"},
                                     {"--integrator", "march", "--samples", "2"}});
}

TEST_F(OptionEffects, OfGradAreInItsLoss) {
    put_mask();
    const auto loss = [&](const Words& more) {
        expect_success(run_with({"grad", folder / "s.ply", folder / "data", "--frame", "0", "-o",
                                 folder / "g.ply", "--json", folder / "g.json"},
                                more));
        return read_json(folder / "g.json")["loss"].get<double>();
    };
    expect_all_differ<double>(loss, {{"--downscale", "2"},
                                     {"--max-width", "20"},
                                     {"--masks", "none"},
                                     {"--lens", "native"},
                                     {"--background", "white"},
                                     {"--kernel", "density"},
                                     {"--points"},
                                     {"--points", "--nearest", "1"},
                                     {"--sh-degree", "0"},
                                     {"--integrator", "ray"},
                                     {"--integrator", "march", "--samples", "2"}});
}

TEST_F(OptionEffects, OfCompareAreInItsFigures) {
    ewa::Gaussians splats = ewa::load_splats(folder / "s.ply");
    for (size_t i = 0; i < splats.size(); ++i) splats.means[3 * i] += 0.2f;
    ewa::save_splats(folder / "moved.ply", splats);
    const auto psnr = [&](const Words& more) {
        expect_success(run_with({"compare", folder / "s.ply", folder / "moved.ply", "--cameras",
                                 folder / "data", "--json", folder / "c.json"},
                                more));
        return read_json(folder / "c.json")["psnr"].get<double>();
    };
    expect_all_differ<double>(psnr, {{"--max-width", "20"},
                                     {"--lens", "native"},
                                     {"--frames", "test"},
                                     {"--frames", "test", "--test-every", "2"},
                                     {"--points"},
                                     {"--points", "--nearest", "1"},
                                     {"--sh-degree", "0"},
                                     {"--integrator", "march"},
                                     {"--integrator", "march", "--samples", "2"}});
    const auto heat = [&](const std::string& scale) {
        expect_success(run_ewa({"compare", folder / "s.ply", folder / "moved.ply", "--cameras",
                                folder / "data", "--heat-map", folder / scale, "--heat-scale", scale}));
        return ewa::load_image(folder / (scale + "/0.png"));
    };
    EXPECT_NE(heat("0.25").pixels, heat("0.5").pixels);
}

TEST_F(OptionEffects, OfRenderAreInItsPicture) {
    const auto picture = [&](const Words& more) {
        expect_success(run_with({"render", folder / "s.ply", "--cameras", folder / "data", "--frames", "0",
                                 "-o", folder / "p.png", "--quiet"},
                                more));
        return read_file(folder / "p.png");
    };
    expect_all_differ<std::string>(picture, {{"--max-width", "20"}, {"--sh-degree", "0"}});
}

TEST_F(OptionEffects, OfDatasetAreInItsImages) {
    const std::string scene = std::string(EWA_SOURCE_DIR) + "/scenes/plaster.gltf";
    const auto image = [&](const Words& more) {
        expect_success(run_with({"dataset", scene, "-o", folder / "made", "--views", "1", "--size", "16x12",
                                 "--samples", "1", "--points", "0", "--quiet", "--force"},
                                more));
        return read_file(folder / "made/images/view_000.png");
    };
    expect_all_differ<std::string>(image, {{"--seed", "1"}, {"--exposure", "2"}, {"--vary-appearance"}});
    EXPECT_TRUE(std::filesystem::exists(folder / "made/appearance.json"));
}

TEST_F(OptionEffects, OfTrainAreInItsSplats) {
    const auto trained = [&](const Words& more) {
        expect_success(run_with({"train", folder / "data", "-o", folder / "run", "--force", "--init",
                                 folder / "s.ply", "--steps", "40", "--quiet"},
                                more));
        return read_file(folder / "run/splats.ply");
    };
    expect_all_differ<std::string>(trained, {{"--loss", "l2=1"},
                                             {"--resolution-schedule", "2"},
                                             {"--refine-poses"},
                                             {"--refine-poses", "--rolling-shutter", "top-to-bottom"},
                                             {"--final-splats", "30"}});
    EXPECT_EQ(read_json(folder / "run/summary.json")["splats"], 30);
    EXPECT_EQ(run_ewa({"train", folder / "data", "-o", folder / "none", "--init", folder / "s.ply",
                       "--region", "50,50,50,60,60,60"})
                  .status,
              2);
    EXPECT_FALSE(std::filesystem::exists(folder / "none"));
}

/// The others have edges.
TEST_F(OptionEffects, OfTrainSkipABlurredImage) {
    const std::string blurred = folder / "data/images/2.png";
    ewa::Image image = ewa::load_image(blurred);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            for (int c = 0; c < 3; ++c)
                image.at(x, y)[c] =
                    0.1f + 0.8f * std::exp(-float((x - 24) * (x - 24) + (y - 16) * (y - 16)) / 150);
    ewa::save_image(blurred, image);
    const Outcome outcome =
        run_ewa({"train", folder / "data", "-o", folder / "run", "--init", folder / "s.ply", "--steps", "2",
                 "--test-every", "0", "--skip-blurred"});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE((outcome.out + outcome.err).find("1 training image is blurred and skipped: images/2.png"),
              std::string::npos)
        << outcome.out << outcome.err;
}

class OptionsOfPhotos : public CamerasTest {};

TEST_F(OptionsOfPhotos, LevelTheWorldAndPrintUnlessTheyForbidIt) {
    make_model("0", {"0.png", "1.png", "2.png", "3.png"});
    const auto cameras_with = [&](const Words& more) {
        Words arguments{"cameras", folder_ / "photos", "-o", folder_ / more.back()};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Outcome outcome = run(arguments);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return outcome.out + outcome.err;
    };
    const std::string level = "levelled by the cameras";
    EXPECT_NE(cameras_with({"--level", "on"}).find(level), std::string::npos);
    EXPECT_EQ(cameras_with({"--level", "off"}).find(level), std::string::npos);
    EXPECT_EQ(cameras_with({"--quiet"}), "");
    const auto train = [&](const std::string& word) {
        const Outcome outcome = run(
            {"train", folder_ / "photos", "-o", folder_ / ("run_" + word), "--steps", "2", "--level", word});
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return outcome.out + outcome.err;
    };
    EXPECT_NE(train("on").find(level), std::string::npos);
    EXPECT_EQ(train("off").find(level), std::string::npos);
}

/// The arguments of a command that is to fail at the device.
std::vector<Words> uses_of_a_device(const Folder& folder, const Words& more) {
    const std::string splats = folder / "s.ply", data = folder / "data", out = folder / "out";
    const std::string scene = std::string(EWA_SOURCE_DIR) + "/scenes/plaster.gltf";
    std::vector<Words> uses{{"render", splats, "-o", out + ".png"},
                            {"eval", splats, data},
                            {"grad", splats, data, "--frame", "0", "-o", out + ".ply"},
                            {"dataset", scene, "-o", out, "--views", "1", "--size", "8x8"},
                            {"mesh", splats, "--cameras", data, "-o", out + ".glb"},
                            {"compare", splats, splats, "--cameras", data}};
    for (Words& words : uses) words.insert(words.end(), more.begin(), more.end());
    return uses;
}

TEST_F(OptionEffects, OfADeviceThatIsNotThere) {
    for (const Words& words : uses_of_a_device(folder, {"--device", "nosuchdevice"}))
        expect_failure(run_ewa(words), 2, "no usable Vulkan device matches 'nosuchdevice'");
}

/// Where no layer is found, only a command that wants it fails.
TEST_F(OptionEffects, OfTheValidationLayer) {
    const Circumstances bare{.environment = {{"VK_LAYER_PATH", folder / "nothing"}}};
    for (const Words& words : uses_of_a_device(folder, {"--validation"}))
        expect_failure(run_ewa(words, bare), 2, "the Khronos validation layer is not installed");
    EXPECT_EQ(run_ewa({"eval", folder / "s.ply", folder / "data"}, bare).status, 0);
}

}  // namespace
