// SPDX-License-Identifier: Apache-2.0
// The folder of a training run in the place of splats and of a dataset.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "cli/expect.h"
#include "ewa/image.h"
#include "ewa/sky_map.h"
#include "ewa/splat_files.h"

namespace {

using namespace ewa;
using namespace ewa::test;
namespace fs = std::filesystem;
using Names = std::vector<std::string>;

class Runs : public testing::Test {
  protected:
    void SetUp() override {
        make_dataset(folder / "data", {"0.png", "1.png", "2.png", "3.png", "4.png"});
        make_splats(folder / "s.ply");
    }
    /// Trains a few steps over white, with options that change every figure.
    std::string train(const std::string& name, const Names& more = {}) {
        Names arguments{
            "train",   folder / "data", "-o", folder / name,  "--init",    folder / "s.ply", "--steps", "3",
            "--quiet", "--test-every",  "2",  "--background", "0.9,0.8,1", "--downscale",    "2"};
        if (more.empty()) arguments.insert(arguments.end(), {"--kernel", "antialias"});
        arguments.insert(arguments.end(), more.begin(), more.end());
        expect_success(run_ewa(arguments));
        return folder / name;
    }
    Folder folder;
};

TEST_F(Runs, EvalHasTheFiguresOfTheRun) {
    const std::string run = train("run");
    const auto summary = read_json(run + "/summary.json");
    const auto psnr = [&](const Names& arguments) {
        Names all{"eval", "--json", folder / "e.json"};
        all.insert(all.end(), arguments.begin(), arguments.end());
        expect_success(run_ewa(all));
        const auto json = read_json(folder / "e.json");
        EXPECT_EQ(json["frames"].size(), 3u);  // every second of five
        return json["psnr"].get<double>();
    };
    EXPECT_NEAR(psnr({run}), summary["test_psnr"], 1e-6);
    EXPECT_NEAR(psnr({run, folder / "data"}), summary["test_psnr"], 1e-6);
    EXPECT_NEAR(psnr({run + "/splats.ply"}), summary["test_psnr"], 1e-6);
    EXPECT_NEAR(psnr({run, run}), summary["test_psnr"], 1e-6);
    // The command line has precedence.
    EXPECT_GT(std::abs(psnr({run, "--background", "0,0,0"}) - summary["test_psnr"].get<double>()), 0.1);
    EXPECT_GT(std::abs(psnr({run, "--kernel", "peak"}) - summary["test_psnr"].get<double>()), 1e-5);
    expect_success(run_ewa({"eval", run, "--test-every", "5", "--json", folder / "one.json"}));
    EXPECT_EQ(read_json(folder / "one.json")["frames"].size(), 1u);
}

TEST_F(Runs, OfPointsAreDrawnAsPoints) {
    const std::string run = train("run", {"--points", "--nearest", "3"});
    const auto summary = read_json(run + "/summary.json");
    EXPECT_EQ(read_json(run + "/config.json")["points"], true);
    EXPECT_EQ(read_json(run + "/config.json")["nearest"], 3);
    const auto psnr = [&](const Names& arguments) {
        Names all{"eval", "--json", folder / "e.json"};
        all.insert(all.end(), arguments.begin(), arguments.end());
        expect_success(run_ewa(all));
        return read_json(folder / "e.json")["psnr"].get<double>();
    };
    EXPECT_NEAR(psnr({run}), summary["test_psnr"], 1e-6);
    // The command line has precedence.
    EXPECT_GT(std::abs(psnr({run, "--kernel", "peak"}) - summary["test_psnr"].get<double>()), 1e-3);
    EXPECT_GT(std::abs(psnr({run, "--nearest", "1"}) - summary["test_psnr"].get<double>()), 1e-3);

    const std::string other = train("other", {"--seed", "2"});
    expect_failure(run_ewa({"compare", run, other}), 2, "one was trained with --points");

    // A reader of 3DGS sees Gaussians that are as opaque as a sphere is in its middle.
    for (const float logit : load_splats(run + "/splats.ply").opacity_logits)
        EXPECT_NEAR(logit, 4.595f, 1e-3);
    expect_success(run_ewa({"train", folder / "data", "-o", run, "--init", folder / "s.ply", "--steps", "5",
                            "--quiet", "--test-every", "2", "--background", "0.9,0.8,1", "--downscale", "2",
                            "--points", "--nearest", "3", "--resume"}));
    expect_failure(run_ewa({"train", run, "--steps", "7", "--kernel", "antialias", "--resume"}), 2,
                   "was written with --");
}

TEST_F(Runs, PointsExcludeWhatSpheresDoNotHave) {
    const auto fails = [&](Names arguments, const Names& more, const std::string& reason) {
        arguments.insert(arguments.end(), more.begin(), more.end());
        arguments.emplace_back("--points");
        expect_failure(run_ewa(arguments), 2, reason);
    };
    const Names drawing{"render", folder / "s.ply", "--cameras", folder / "data", "-o", folder / "r"};
    fails(drawing, {"--kernel", "ewa"}, "--points and --kernel density exclude each other");
    fails(drawing, {"--kernel", "antialias"}, "--points and --kernel antialias exclude each other");
    fails(drawing, {"--integrator", "ray"}, "--points and --integrator exclude each other");
    fails(drawing, {"--nearest", "0"}, "'0' is not a whole number from 1 to 1000");
    const Names training{"train", folder / "data", "-o", folder / "t"};
    fails(training, {"--kernel", "antialias"}, "--points and --kernel antialias exclude each other");
    fails(training, {"--strategy", "mcmc"}, "--points and --strategy mcmc exclude each other");
    fails(training, {"--init-opacity", "0.5"}, "--init-opacity and --points exclude each other");
    fails(training, {"--refine-poses"}, "--points and --refine-poses exclude each other");
    expect_failure(run_ewa({"train", folder / "data", "-o", folder / "t", "--nearest", "3"}), 2,
                   "--nearest is an option of --points");
    EXPECT_FALSE(fs::exists(folder / "t"));
    expect_success(run_ewa(
        {"grad", folder / "s.ply", folder / "data", "--frame", "1", "--points", "-o", folder / "g.ply"}));
    const Gaussians gradient = load_splats(folder / "g.ply");
    for (const float by_opacity : gradient.opacity_logits) EXPECT_EQ(by_opacity, 0);
    for (size_t i = 0; i < gradient.log_scales.size(); ++i)
        EXPECT_EQ(gradient.log_scales[i], gradient.log_scales[i - i % 3]);
    EXPECT_TRUE(std::ranges::any_of(gradient.log_scales, [](float g) { return g != 0; }));
}

TEST_F(Runs, EvalAndRenderUseTheExposures) {
    const std::string run = train("run", {"--appearance", "affine"});
    const auto train_psnr = [&](const Names& more) {
        Names all{"eval", run, "--split", "train", "--json", folder / "e.json"};
        all.insert(all.end(), more.begin(), more.end());
        expect_success(run_ewa(all));
        return read_json(folder / "e.json")["psnr"].get<double>();
    };
    EXPECT_NEAR(train_psnr({}), read_json(run + "/summary.json")["train_psnr"], 1e-6);
    const double by_name = train_psnr({folder / "data"});
    EXPECT_NEAR(by_name, train_psnr({}), 1e-6) << "the run's own dataset";
    fs::copy(folder / "data", folder / "other", fs::copy_options::recursive);
    EXPECT_NEAR(train_psnr({folder / "other"}), train_psnr({"--exposures", "none"}), 1e-6)
        << "another dataset";

    // An exposure of a training image that turns the picture white, and none of the held-out images.
    write_file(folder / "white.json", R"({"images/1.png": [[0, 0, 0, 1], [0, 0, 0, 1], [0, 0, 0, 1]]})");
    EXPECT_GT(
        std::abs(train_psnr({"--exposures", folder / "white.json"}) - train_psnr({"--exposures", "none"})),
        0.5);
    const auto view = [&](const std::string& exposures, const std::string& name) {
        expect_success(run_ewa({"render", run, "--exposures", exposures, "-o", folder / "views"}));
        return load_image(folder / "views/" + name);
    };
    const Image without = view("none", "0.png");
    EXPECT_EQ(view(folder / "white.json", "0.png").pixels, without.pixels);
    for (const float value : view(folder / "white.json", "1.png").pixels) EXPECT_EQ(value, 1);
    // The colours of a transparent image have the exposure, whatever their alpha.
    write_file(folder / "redder.json", R"({"images/1.png": [[1, 0, 0, 0.25], [0, 1, 0, 0], [0, 0, 1, 0]]})");
    const auto clear = [&](const std::string& exposures) {
        const std::string file = folder / "clear.png";
        expect_success(run_ewa({"render", run, "--frames", "1.png", "--exposures", exposures, "--transparent",
                                "-o", file, "--quiet"}));
        return load_image(file);
    };
    const Image plain = clear("none"), redder = clear(folder / "redder.json");
    size_t edges = 0;
    for (size_t i = 0; i < plain.pixels.size(); i += 4) {
        EXPECT_EQ(redder.pixels[i + 3], plain.pixels[i + 3]);
        if (plain.pixels[i + 3] < 0.02f || plain.pixels[i] == 0) continue;
        edges += plain.pixels[i + 3] < 0.7f;
        EXPECT_NEAR(redder.pixels[i], std::min(1.0f, plain.pixels[i] + 0.25f), 1.5 / 255);
        EXPECT_EQ(redder.pixels[i + 1], plain.pixels[i + 1]);
    }
    EXPECT_GT(edges, 10u);
    expect_success(run_ewa({"render", run, "-o", folder / "auto"}));
    expect_success(run_ewa({"render", run, "--exposures", run + "/appearance.json", "-o", folder / "file"}));
    EXPECT_EQ(read_file(folder / "auto/1.png"), read_file(folder / "file/1.png"));
}

TEST_F(Runs, EvalAndRenderUseTheAppearances) {
    const std::string run = train("run", {"--appearance", "ppisp"});
    const auto psnr = [&](const Names& more) {
        Names all{"eval", run, "--split", "train", "--json", folder / "e.json"};
        all.insert(all.end(), more.begin(), more.end());
        expect_success(run_ewa(all));
        return read_json(folder / "e.json")["psnr"].get<double>();
    };
    EXPECT_NEAR(psnr({}), read_json(run + "/summary.json")["train_psnr"], 1e-6);
    EXPECT_NE(psnr({"--exposures", "none"}), psnr({}));
    expect_success(run_ewa({"eval", run, "--json", folder / "e.json"}));
    EXPECT_NEAR(read_json(folder / "e.json")["psnr"], read_json(run + "/summary.json")["test_psnr"], 1e-6)
        << "held-out images have the mean";
    EXPECT_NE(psnr({"--appearance-of", "images/1.png"}), psnr({}));
    expect_failure(run_ewa({"render", run, "--appearance-of", "images/1.pgn", "-o", folder / "r"}), 2,
                   "did you mean images/1.png?");
    const Outcome chosen =
        run_ewa({"train", folder / "data", "-o", folder / "auto", "--steps", "2", "--appearance", "auto"});
    EXPECT_NE((chosen.out + chosen.err).find("appearance none: "), std::string::npos) << chosen.out;
    write_file(folder / "bad.json", "{\"model\": \"ppisp\", \"images\": 3}");
    expect_failure(run_ewa({"eval", run, "--exposures", folder / "bad.json"}), 2, "bad.json");
}

TEST_F(Runs, EvalRenderAndCompareUseTheSky) {
    const auto trained = [&](const std::string& name, const Names& more) {
        Names all{"train",   folder / "data", "-o", folder / name,  "--init", folder / "s.ply",
                  "--quiet", "--steps",       "30", "--background", "sky",    "--test-every",
                  "2"};
        all.insert(all.end(), more.begin(), more.end());
        expect_success(run_ewa(all));
        return folder / name;
    };
    const std::string run = trained("run", {"--save-every", "20"});
    const SkyMap sky = load_sky(run + "/sky.json");
    EXPECT_NE(*std::ranges::max_element(sky.texels), *std::ranges::min_element(sky.texels));
    const double of_run = read_json(run + "/summary.json")["test_psnr"];
    const auto psnr = [&](const std::string& splats, const Names& more) {
        Names all{"eval", splats, "--json", folder / "e.json"};
        all.insert(all.end(), more.begin(), more.end());
        expect_success(run_ewa(all));
        return read_json(folder / "e.json")["psnr"].get<double>();
    };
    EXPECT_NEAR(psnr(run, {}), of_run, 1e-6);
    EXPECT_NEAR(psnr(run + "/splats.ply", {}), of_run, 1e-6);
    EXPECT_GT(std::abs(of_run - psnr(run, {"--background", "0,0,0"})), 0.5);
    fs::copy(run + "/splats.ply", folder / "alone.ply");
    const std::string alone = folder / "alone.ply";
    EXPECT_NEAR(psnr(alone, {run, "--test-every", "2", "--background", run + "/sky.json"}), of_run, 1e-6);
    expect_success(run_ewa({"render", run, "--format", "exr", "-o", folder / "views"}));
    expect_success(run_ewa({"compare", run, folder / "views", "--max-error", "1e-5"}));
    // Splats far away take its place.
    const std::string baked = folder / "baked.ply";
    expect_success(run_ewa({"convert", run, baked, "--bake-sky", "--quiet"}));
    const size_t texels = size_t(sky.size) * size_t(sky.size);
    EXPECT_EQ(load_splats(baked).size(), load_splats(run + "/splats.ply").size() + texels);
    expect_success(run_ewa({"render", baked, "--cameras", run, "--frames", "0", "-o", folder / "baked.png"}));
    expect_success(run_ewa({"render", run, "--frames", "0", "-o", folder / "sky.png"}));
    EXPECT_GT(ewa::psnr(load_image(folder / "baked.png"), load_image(folder / "sky.png")), 30);
    expect_failure(run_ewa({"convert", alone, folder / "b.ply", "--bake-sky"}), 2, "--bake-sky: ");
    // Each of two runs has its own.
    const std::string other = trained("other", {"--sky-rate", "1e-9"});
    expect_success(run_ewa({"compare", run, run, "--max-error", "0"}));
    EXPECT_EQ(run_ewa({"compare", run, other, "--max-error", "0.1"}).status, 1);

    expect_failure(run_ewa({"eval", alone, run, "--background", "sky"}), 2, "only ewa train takes sky");
    expect_failure(
        run_ewa({"train", folder / "data", "-o", folder / "t", "--background", "sky", "--refine-poses"}), 2,
        "--background sky and --refine-poses exclude each other");
    write_file(folder / "sky.json", R"({"size": 2, "texels": [1, 2]})");
    expect_failure(run_ewa({"render", alone, "-o", folder / "a.png"}), 2,
                   "sky.json: \"texels\" is not a list of 12 finite numbers");
    write_file(folder / "sky.json", R"({"size": 2000})");
    expect_failure(run_ewa({"render", alone, "-o", folder / "a.png"}), 2,
                   "sky.json: \"size\" is not a whole number of 1 to 1024");
    fs::remove(run + "/sky.json");
    // A run without a sky leaves none of an earlier one.
    ASSERT_TRUE(fs::exists(other + "/sky.json"));
    expect_success(run_ewa({"train", folder / "data", "-o", other, "--force", "--init", folder / "s.ply",
                            "--quiet", "--steps", "1", "--test-every", "2"}));
    EXPECT_FALSE(fs::exists(other + "/sky.json"));
    const Outcome without = run_ewa({"render", run, "--frames", "0", "-o", folder / "b.png"});
    EXPECT_EQ(without.status, 0);
    EXPECT_NE(without.err.find("sky.json is missing"), std::string::npos) << without.err;
}

TEST_F(Runs, EvalRenderAndGradUseTheRefinedCameras) {
    const std::string run = folder / "run";
    const Outcome trained =
        run_ewa({"train", folder / "data", "-o", run, "--init", folder / "s.ply", "--steps", "30",
                 "--test-every", "2", "--refine-poses", "--refine-focal"});
    expect_success(trained);
    EXPECT_NE(trained.out.find("with cameras aligned to their images"), std::string::npos) << trained.out;
    EXPECT_NE(trained.out.find("cameras turned by "), std::string::npos) << trained.out;
    const auto summary = read_json(run + "/summary.json");
    EXPECT_GT(summary["cameras"]["largest_degrees"], 0);
    EXPECT_EQ(summary["cameras"]["test_cameras_aligned"], true);
    EXPECT_NE(read_file(run + "/report.html").find("were aligned to their images"), std::string::npos);

    const auto psnr = [&](Names arguments) {
        arguments.insert(arguments.begin(), "eval");
        arguments.insert(arguments.end(), {"--json", folder / "e.json"});
        expect_success(run_ewa(arguments));
        return read_json(folder / "e.json")["psnr"].get<double>();
    };
    EXPECT_NEAR(psnr({run}), summary["test_psnr"], 1e-6);
    EXPECT_EQ(read_json(folder / "e.json")["test_cameras_aligned"], true);
    EXPECT_NE(run_ewa({"eval", run}).out.find("those of test images aligned to these"), std::string::npos);
    EXPECT_NEAR(psnr({run, "--split", "train"}), summary["train_psnr"], 1e-6);
    const double unrefined = psnr({run + "/splats.ply", folder / "data", "--test-every", "2"});
    EXPECT_GT(std::abs(unrefined - summary["test_psnr"].get<double>()), 1e-3);
    const auto loss = [&](const std::string& splats, const Names& more) {
        Names arguments{"grad", splats, "--frame", "1", "-o", folder / "g.ply", "--json", folder / "g.json"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        expect_success(run_ewa(arguments));
        EXPECT_NE(read_json(folder / "g.json")["camera"]["rotation"][0], 0);
        return read_json(folder / "g.json")["loss"].get<double>();
    };
    EXPECT_NE(loss(run, {}), loss(run + "/splats.ply", {folder / "data"}));
    expect_success(run_ewa({"render", run, "-o", folder / "refined"}));
    expect_success(
        run_ewa({"render", run + "/splats.ply", "--cameras", folder / "data", "-o", folder / "given"}));
    EXPECT_NE(read_file(folder / "refined/1.png"), read_file(folder / "given/1.png"));

    // Its renders are those that compare makes. Other splats are drawn through the same cameras.
    const auto same = [&](const Names& sides) {
        Names arguments{"compare", "--json", folder / "c.json"};
        arguments.insert(arguments.end(), sides.begin(), sides.end());
        expect_success(run_ewa(arguments));
        return read_json(folder / "c.json")["identical"].get<bool>();
    };
    EXPECT_TRUE(same({run, folder / "refined"}));
    EXPECT_TRUE(same({folder / "refined", run}));
    EXPECT_TRUE(same({run, run + "/splats.ply"}));
    EXPECT_FALSE(same({run, folder / "refined", "--cameras", folder / "data"}));

    // The run goes on to the same bytes, with its own options.
    const auto bytes = read_file(run + "/cameras.json");
    expect_success(run_ewa({"train", folder / "data", "-o", run, "--resume", "--quiet"}));
    EXPECT_EQ(read_file(run + "/cameras.json"), bytes);
    // A run without leaves no cameras of the one before.
    expect_success(run_ewa({"train", folder / "data", "-o", run, "--init", folder / "s.ply", "--steps", "1",
                            "--test-every", "2", "--force", "--quiet"}));
    EXPECT_FALSE(fs::exists(run + "/cameras.json"));
    EXPECT_FALSE(fs::exists(run + "/cameras/sparse/0/cameras.bin"));
    expect_failure(run_ewa({"train", folder / "data", "-o", folder / "x", "--refine-focal"}), 2,
                   "--refine-focal is an option of --refine-poses");
}

TEST_F(Runs, RefinedCamerasThatAreWrongAreNamed) {
    const std::string run = train("run", {"--refine-poses"});
    const auto cameras = read_json(run + "/cameras.json");
    const auto with_views = [&](const nlohmann::json& views) {
        write_file(run + "/cameras.json", nlohmann::json{{"views", views}}.dump());
        return run_ewa({"eval", run});
    };
    // A dataset may have more images than a list of saved views.
    nlohmann::json many = cameras["views"];
    for (int i = 0; i < 10001; ++i) many.push_back(many[0]), many.back()["name"] = std::to_string(i);
    const Outcome eval = with_views(many);
    expect_success(eval);
    EXPECT_NE(eval.out.find("those of test images aligned"), std::string::npos);
    for (auto& view : many) view["aligned"] = false;
    EXPECT_NE(with_views(many).out.find("those of test images not aligned"), std::string::npos);
    // Those of another dataset, or of none.
    for (auto& view : many) view["name"] = "x" + view["name"].get<std::string>();
    expect_failure(with_views(many), 2, "cameras.json: has no camera of an image of " + (folder / "data"));
    expect_failure(with_views(nlohmann::json::array()), 2, "cameras.json: has no camera of an image of ");
    many = cameras["views"];
    many[1]["fx"] = 0;
    expect_failure(with_views(many), 2, "cameras.json: view 1: a focal length is not above zero");
    // Whoever removes the file gets the cameras of the dataset, and is told so.
    fs::remove(run + "/cameras.json");
    const Outcome without = run_ewa({"eval", run});
    EXPECT_EQ(without.status, 0);
    EXPECT_NE(without.err.find("cameras.json is missing"), std::string::npos) << without.err;
    EXPECT_EQ(without.out.find("as the run refined them"), std::string::npos);
}

TEST_F(Runs, WrongExposuresAreNamed) {
    const std::string run = train("run");
    const auto fails = [&](const std::string& text, const std::string& reason) {
        write_file(folder / "x.json", text);
        expect_failure(run_ewa({"eval", run, "--exposures", folder / "x.json"}), 2, reason);
    };
    fails("[]", "the JSON is not an object of appearances");
    fails(R"({"images/1.png": [[1, 0, 0, 0], [0, 1, 0, 0]]})", "three rows of four finite numbers");
    fails(R"({"images/1.png": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1]]})",
          "three rows of four finite numbers");
    fails(R"({"images/1.png": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1e39]]})",
          "three rows of four finite numbers");
    fails(R"({"images/1.png": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, "0"]]})",
          "three rows of four finite numbers");
    fails(R"({"other.png": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]})", "has no exposure of an image of");
    expect_failure(run_ewa({"eval", run, "--exposures", folder / "no.json"}), 2, "no.json");
}

/// A run of some images keeps the same ones held out, and is evaluated on its own.
TEST_F(Runs, FramesChooseTheImages) {
    const std::string run = train("run", {"--frames", "0-1,3"});  // 0, 2 and 4 are held out
    const auto count = [&](const Names& arguments) {
        Names all{"eval", "--json", folder / "e.json"};
        all.insert(all.end(), arguments.begin(), arguments.end());
        expect_success(run_ewa(all));
        return read_json(folder / "e.json")["frames"].size();
    };
    EXPECT_EQ(count({run}), 1u);
    EXPECT_NEAR(read_json(folder / "e.json")["psnr"], read_json(run + "/summary.json")["test_psnr"], 1e-6);
    EXPECT_EQ(count({run, "--split", "train"}), 2u);
    EXPECT_EQ(count({run, folder / "data"}), 3u);
    Names names{"train", folder / "data", "-o", folder / "none", "--test-every", "2", "--frames", "0,2"};
    expect_failure(run_ewa(names), 2, "--frames 0,2: 2 images are held out; name more");
    names.back() = "test";
    expect_failure(run_ewa(names), 2, "--frames test: these images are held out");
    names.back() = "7";
    expect_failure(run_ewa(names), 2, "there is no frame 7");
}

TEST_F(Runs, TrainTakesTheDatasetAndTheSplatsOfARun) {
    const std::string run = train("run");
    const Names more{"--steps", "2", "--quiet", "-o"};
    const auto config = [&](const Names& inputs, const std::string& out) {
        Names all{"train"};
        all.insert(all.end(), inputs.begin(), inputs.end());
        all.insert(all.end(), more.begin(), more.end());
        all.push_back(out);
        expect_success(run_ewa(all));
        return read_json(out + "/config.json");
    };
    EXPECT_EQ(config({run}, folder / "a")["dataset"], folder / "data");
    EXPECT_EQ(with_slashes(config({folder / "data", "--init", run}, folder / "b")["init"]),
              run + "/splats.ply");
    EXPECT_EQ(load_splats(folder / "b/splats.ply").size(), 50u);
    expect_failure(run_ewa({"train", folder / "data", "--init", folder / "data", "-o", folder / "c"}), 2,
                   "a folder without splats");
}

TEST_F(Runs, RenderShowsTheViewsOfTheDataset) {
    const std::string run = train("run");
    expect_success(run_ewa({"render", run, "-o", folder / "views"}));
    EXPECT_EQ(files_below(folder / "views"), (Names{"0.png", "1.png", "2.png", "3.png", "4.png"}));
    const Names options{"--background", "0.9,0.8,1", "--downscale", "2", "--kernel", "antialias"};
    Names plain{"render", run + "/splats.ply", "--cameras", folder / "data", "-o", folder / "plain"};
    plain.insert(plain.end(), options.begin(), options.end());
    expect_success(run_ewa(plain));
    expect_success(run_ewa(
        {"render", run + "/splats.ply", "--cameras", run, "-o", folder / "run_cameras", "--frames", "test"}));
    EXPECT_EQ(files_below(folder / "run_cameras").size(), 1u);
    for (const char* name : {"0.png", "4.png"})
        EXPECT_EQ(read_file(folder / "views/" + name), read_file(folder / "plain/" + name)) << name;

    // As one image, the scene is framed by itself, with the dataset's up: z in this one.
    expect_success(run_ewa({"render", run, "-o", folder / "x.png", "--size", "40x30"}));
    expect_success(run_ewa({"render", run, "-o", folder / "up.png", "--size", "40x30", "--up", "z"}));
    expect_success(run_ewa({"render", run, "-o", folder / "down.png", "--size", "40x30", "--up=-z"}));
    EXPECT_GT(compare_images(load_image(folder / "x.png"), load_image(folder / "up.png")).psnr, 40);
    EXPECT_LT(compare_images(load_image(folder / "x.png"), load_image(folder / "down.png")).psnr, 40);
}

TEST_F(Runs, KeepTheLimitOfTheImagesWidth) {
    const std::string run = folder / "run";
    expect_success(run_ewa({"train", folder / "data", "-o", run, "--steps", "3", "--test-every", "2",
                            "--quiet", "--max-width", "30"}));
    EXPECT_EQ(read_json(run + "/config.json")["max-width"], 30);
    EXPECT_EQ(load_image(run + "/test/0.png").width, 30);
    expect_success(run_ewa({"render", run, "-o", folder / "views"}));
    EXPECT_EQ(load_image(folder / "views/0.png").width, 30);
    expect_success(run_ewa({"eval", run, "--json", folder / "e.json"}));
    EXPECT_NEAR(read_json(folder / "e.json")["psnr"].get<double>(),
                read_json(run + "/summary.json")["test_psnr"], 1e-6);
}

TEST_F(Runs, AWidthThatIsTooSmallIsRefused) {
    const Outcome small = run_ewa({"train", folder / "data", "-o", folder / "o", "--max-width", "10"});
    expect_failure(small, 2,
                   "--max-width 10 leaves 10x7 pixels of the image images/1.png; a side needs 16 or more");
    const std::string enough = small.err.substr(small.err.find("as with --max-width ") + 20);
    expect_success(run_ewa({"train", folder / "data", "-o", folder / "o", "--steps", "1", "--quiet",
                            "--max-width", enough.substr(0, enough.find_first_not_of("0123456789"))}));
}

/// The run's --downscale says nothing of images of other sizes.
TEST_F(Runs, CamerasOfAnotherDatasetHaveSensibleSizes) {
    const std::string run = train("run");  // --downscale 2: of 48x32
    const auto width = [&](const Names& more) {
        Names all{"render", run, "--frames", "0", "--quiet", "-o", folder / "x.png"};
        all.insert(all.end(), more.begin(), more.end());
        expect_success(run_ewa(all));
        return load_image(folder / "x.png").width;
    };
    EXPECT_EQ(width({}), 24);
    EXPECT_EQ(width({"--cameras", folder / "data"}), 24);
    // Another capture: half and twice as large.
    fs::copy(folder / "data", folder / "other", fs::copy_options::recursive);
    const auto resize = [&](int factor, int part) {
        auto json = read_json(folder / "data/transforms.json");
        for (const char* key : {"w", "h", "fl_x", "fl_y", "cx", "cy"})
            if (json.contains(key)) json[key] = json[key].get<double>() * factor / part;
        write_file(folder / "other/transforms.json", json.dump());
        for (const auto& file : fs::directory_iterator(folder / "other/images")) {
            Image image = load_image(folder / "data/images" / file.path().filename());
            save_image(file.path(), Image(image.width * factor / part, image.height * factor / part, 3));
        }
    };
    resize(1, 2);
    EXPECT_EQ(width({"--cameras", folder / "other"}), 24);
    resize(2, 1);
    EXPECT_EQ(width({"--cameras", folder / "other"}), 24) << "as large as the run was trained";
    EXPECT_EQ(width({"--cameras", folder / "other", "--downscale", "1"}), 96);
    EXPECT_EQ(width({"--cameras", folder / "other", "--max-width", "40"}), 40);
    // Where the run's dataset is gone, the other one is taken for it.
    fs::rename(folder / "data", folder / "moved");
    EXPECT_EQ(width({"--cameras", folder / "moved"}), 24);
}

TEST_F(Runs, AnOrbitHasTheAppearanceOfAnImage) {
    const std::string run = train("run", {"--appearance", "ppisp"});
    const auto drawn = [&](const Names& more) {
        Names all{"render", run,       "--look-at", "0,0,-4,0,0,0",  "--size",
                  "24x16",  "--quiet", "-o",        folder / "x.png"};
        all.insert(all.end(), more.begin(), more.end());
        expect_success(run_ewa(all));
        return load_image(folder / "x.png").pixels;
    };
    const auto of_one = drawn({"--appearance-of", "images/1.png"}), plain = drawn({"--exposures", "none"});
    EXPECT_NE(of_one, plain);
    EXPECT_EQ(of_one, drawn({"--appearance-of", "1"})) << "the name without its folder and extension";
    EXPECT_NE(of_one, drawn({"--appearance-of", "3.png"}));
    EXPECT_NE(of_one, drawn({})) << "the mean of the images";
    // Through the cameras of another dataset, too.
    fs::copy(folder / "data", folder / "other", fs::copy_options::recursive);
    const auto other = [&](const Names& more) {
        Names all{"render", run,       "--cameras", folder / "other", "--frames",
                  "0",      "--quiet", "-o",        folder / "y.png"};
        all.insert(all.end(), more.begin(), more.end());
        expect_success(run_ewa(all));
        return load_image(folder / "y.png").pixels;
    };
    EXPECT_NE(other({"--appearance-of", "1.png"}), other({}));
    expect_failure(run_ewa({"render", folder / "s.ply", "--appearance-of", "1.png", "-o", folder / "z.png"}),
                   2, "--exposures FILE names one");
    expect_failure(
        run_ewa({"render", run, "--frames", "0", "--size", "20x30", "-o", folder / "z.png"}), 2,
        "--frames is of the images of the run, and --size of other views: leave one out; --max-width");
}

TEST_F(Runs, InfoConvertGradAndCompareTakeThem) {
    const std::string run = train("run");
    const Outcome info = run_ewa({"info", run});
    expect_success(info);
    for (const char* text : {"training run", "steps           3", "test PSNR", "splats          50"})
        EXPECT_NE(info.out.find(text), std::string::npos) << text << " not in " << info.out;
    const Outcome json = run_ewa({"info", run, "--json"});
    expect_success(json);
    const auto parsed = nlohmann::json::parse(json.out);
    EXPECT_EQ(parsed["kind"], "run");
    EXPECT_EQ(parsed["splats"], 50);
    EXPECT_EQ(parsed["run"]["dataset"], folder / "data");
    EXPECT_EQ(parsed["run"]["summary"]["steps"], 3);

    expect_success(run_ewa({"convert", run, folder / "out.spz", "--quiet"}));
    EXPECT_EQ(load_splats(folder / "out.spz").size(), 50u);
    expect_success(run_ewa({"grad", run, "--frame", "1", "-o", folder / "g.ply"}));
    EXPECT_EQ(load_splats(folder / "g.ply").size(), 50u);

    const std::string other = train("other", {"--seed", "4", "--kernel", "antialias"});
    const Outcome compared = run_ewa({"compare", run, other, "--json", folder / "c.json"});
    expect_success(compared);
    EXPECT_EQ(read_json(folder / "c.json")["pictures"].size(), 5u);
    const Outcome same = run_ewa({"compare", run, run + "/splats.ply", "--cameras", run, "--max-error", "0"});
    expect_success(same);
    expect_failure(run_ewa({"compare", run, train("third", {"--kernel", "peak"})}), 2, "--kernel");
}

TEST_F(Runs, WhatIsMissingIsNamed) {
    fs::create_directories(folder / "empty");
    expect_failure(run_ewa({"render", folder / "empty", "-o", folder / "x.png"}), 2, "splats.ply");
    expect_failure(run_ewa({"convert", folder / "empty", folder / "x.spz"}), 2, "training run");
    expect_failure(run_ewa({"eval", folder / "data"}), 2, "a folder without splats");
    expect_failure(run_ewa({"eval", folder / "s.ply"}), 2, "DATASET is required");
    expect_failure(run_ewa({"info", folder / "empty"}), 2, "config.json");
    fs::create_directories(folder / "out");
    fs::rename(train("one"), folder / "out/one");
    for (const char* other : {"two", "three", "four"})
        fs::copy(folder / "out/one", folder / "out" / fs::path(other));
    const std::string runs =
        (folder / "out/four") + ", " + (folder / "out/one") + ", " + (folder / "out/three");
    expect_failure(run_ewa({"train", folder / "out", "-o", folder / "t"}), 2,
                   "has the training runs " + runs + " and 1 more; ewa train RUN --resume continues one");
    expect_failure(run_ewa({"render", folder / "out", "-o", folder / "x.png"}), 2, "such as " + runs);

    fs::create_directories(folder / "begun");
    write_file(folder / "begun/config.json", R"({"dataset": "gone"})");
    expect_failure(run_ewa({"info", folder / "begun"}), 2, "--save-every");
    expect_failure(run_ewa({"eval", folder / "s.ply", folder / "begun"}), 2,
                   "the dataset gone was not found");
    fs::copy_file(folder / "s.ply", folder / "begun/splats.ply");
    expect_failure(run_ewa({"eval", folder / "begun"}), 2, "each folder above the run");
    expect_failure(run_ewa({"render", folder / "begun", "-o", folder / "d"}), 2, "the dataset gone");
    expect_success(run_ewa({"render", folder / "begun", "-o", folder / "x.png", "--size", "20x20"}));
    // Relative to a folder above the run.
    fs::create_directories(folder / "gone");
    make_dataset(folder / "gone");
    expect_success(run_ewa({"eval", folder / "begun"}));
    write_file(folder / "begun/config.json", R"({"dataset": "gone", "downscale": "many"})");
    expect_failure(run_ewa({"eval", folder / "begun"}), 2, "config.json: --downscale");
    write_file(folder / "begun/config.json", "{}");
    expect_failure(run_ewa({"eval", folder / "begun"}), 2, "names no dataset");
}

/// No command but ewa train writes the files of a run.
TEST_F(Runs, FilesOfARunStayWhole) {
    const std::string run = train("run"), other = train("other"), splats = folder / "s.ply";
    const auto whole = [&] {
        std::string all;
        for (const std::string& file : files_below(run)) all += file + "\n" + read_file(run + "/" + file);
        return all;
    };
    const std::string before = whole();
    const auto refused = [&](const Names& arguments, const std::string& text) {
        SCOPED_TRACE(arguments[0] + " " + arguments.back());
        expect_failure(run_ewa(arguments), 2, text);
        EXPECT_EQ(whole(), before);
    };
    const std::string reason = "is a file of the training run in " + run;
    for (const char* file : {"config.json", "checkpoint.ewa", "times.json", "summary.json", "metrics.jsonl",
                             "splats.ply", "report.html", "appearance.json", "cameras.json", "sky.json"})
        refused({"eval", run, "--json", run + "/" + file}, reason);
    refused({"grad", run, "--frame", "0", "-o", folder / "x.ply", "--json", run + "/summary.json"}, reason);
    refused({"compare", run, other, "--json", run + "/metrics.jsonl"}, reason);
    refused({"convert", run, folder / "x.spz", "--json", run + "/config.json"}, reason);
    refused({"bench", "--cases", "none", "--json", run + "/summary.json"}, reason);
    // Also where the run is no input.
    refused({"convert", splats, run + "/splats.ply"}, "; name another file");
    refused({"eval", splats, folder / "data", "--json", run + "/appearance.json"}, reason);
    fs::create_symlink(run + "/config.json", folder / "link.json");
    refused({"eval", run, "--json", folder / "link.json"}, reason);
    fs::create_hard_link(run + "/config.json", folder / "hard.json");
    refused({"eval", run + "/splats.ply", "--json", folder / "hard.json"},
            "is the same file as a file of the run");

    const fs::path here = fs::current_path();
    fs::current_path(run);
    refused({"eval", ".", "--json", "config.json"}, "is a file of the training run in .;");
    fs::current_path(here);

    expect_success(run_ewa({"eval", run, "--json", run + "/eval.json"}));
    fs::create_directory(folder / "plain");
    for (int i = 0; i < 2; ++i) {
        expect_success(run_ewa({"convert", splats, folder / "plain/splats.ply"}));
        expect_success(run_ewa({"eval", run, "--json", folder / "summary.json"}));
    }
    expect_success(run_ewa({"train", "--config", run + "/config.json", "-o", run, "--force", "--quiet"}));
}

TEST_F(Runs, AFolderThatIsADatasetTooStaysOne) {
    write_file(folder / "data/config.json", "{}");
    const Outcome info = run_ewa({"info", folder / "data"});
    expect_success(info);
    EXPECT_NE(info.out.find("frames          5"), std::string::npos) << info.out;
    expect_success(run_ewa({"eval", folder / "s.ply", folder / "data"}));
}

}  // namespace
