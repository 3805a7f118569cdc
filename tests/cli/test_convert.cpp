// SPDX-License-Identifier: Apache-2.0
// ewa convert, and what the other commands make of every splat format.
#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <limits>

#include "cli/expect.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "ewa/splat_files.h"
#include "support/usd_values.h"

namespace {

using namespace ewa::test;
using ewa::Gaussians;
namespace fs = std::filesystem;
using Names = std::vector<std::string>;

/// Of the formats that ewa reads and writes, and of those that it only writes.
const Names kFiles = {"a.ply", "a.compressed.ply", "a.splat", "a.spz",
                      "a.glb", "a.gltf",           "a.sog",   "meta.json"},
            kUsdFiles = {"a.usda", "a.usdz"};

TEST(Convert, FromEachFormatToEach) {
    const Folder folder;
    make_splats(folder / "s.ply", 300, 2);
    for (const std::string& first : kFiles) {
        expect_success(run_ewa({"convert", folder / "s.ply", folder / first}));
        for (const std::string& second : kFiles) {
            std::vector<std::string> arguments = {"convert", folder / first, folder / ("b/" + second)};
            const bool check = first == kFiles[0];  // which renders both
            if (check) arguments.emplace_back("--check");
            const Outcome outcome = run_ewa(arguments);
            expect_success(outcome);
            EXPECT_EQ(outcome.out.find("read back") != std::string::npos, check) << outcome.out;
            EXPECT_EQ(ewa::load_splats(folder / ("b/" + second)).size(), 300u) << first << " to " << second;
        }
        for (const std::string& second : kUsdFiles) {
            expect_success(run_ewa({"convert", folder / first, folder / ("b/" + second)}));
            EXPECT_EQ(usd_numbers(read_file(folder / ("b/" + second)), "positions").size(), 900u)
                << first << " to " << second;
        }
    }
}

/// A place in a PLY's comments stays while the splats stay there, and tiles are put there.
TEST(Convert, KeepsThePlaceOfSplatsThatStayThere) {
    const Folder folder;
    make_splats(folder / "plain.ply", 50, 0);
    const std::string comment = "ewa place 47.5 8.25 410", dropped = "the place on the globe is dropped";
    ewa::save_splats(folder / "here.ply", ewa::load_splats(folder / "plain.ply"), {comment});
    const auto says_place = [&](const std::string& file) {
        return run_ewa({"info", folder / file}).out.find(comment) != std::string::npos;
    };
    const auto convert = [&](const Names& words) {
        Names command{"convert"};
        command.insert(command.end(), words.begin(), words.end());
        const Outcome outcome = run_ewa(command);
        expect_success(outcome);
        return outcome.out.find(dropped) != std::string::npos;
    };
    EXPECT_FALSE(convert({folder / "here.ply", folder / "copy.ply"}));
    EXPECT_TRUE(says_place("copy.ply"));
    EXPECT_TRUE(convert({folder / "here.ply", folder / "moved.ply", "--transform", "move=1,0,0"}));
    EXPECT_FALSE(says_place("moved.ply"));
    EXPECT_TRUE(convert({folder / "here.ply", folder / "plain.ply", folder / "joined.ply"}))
        << "the other input knows no place";
    EXPECT_FALSE(says_place("joined.ply"));
    EXPECT_FALSE(convert({folder / "here.ply", folder / "copy.ply", folder / "both.ply"}));
    EXPECT_TRUE(says_place("both.ply"));
    convert({folder / "here.ply", folder / "tiles/tileset.json"});
    convert({folder / "plain.ply", folder / "same/tileset.json", "--geo", "47.5,8.25,410"});
    EXPECT_EQ(read_json(folder / "tiles/tileset.json")["root"]["transform"],
              read_json(folder / "same/tileset.json")["root"]["transform"]);
}

TEST(Convert, SaysWhatIsLostAndMeasuresIt) {
    const Folder folder;
    make_splats(folder / "s.ply", 300, 2);
    const Outcome outcome =
        run_ewa({"convert", folder / "s.ply", folder / "o.splat", "--check", "--json", folder / "o.json"});
    expect_success(outcome);
    EXPECT_NE(outcome.out.find("SH degrees 1 to 2 are dropped"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("8 bits"), std::string::npos) << outcome.out;
    const auto json = read_json(folder / "o.json");
    EXPECT_EQ(json["inputs"][0]["format"], "PLY");
    EXPECT_EQ(json["output"]["splats"], 300);
    EXPECT_EQ(json["check"]["position"]["largest"], 0);
    EXPECT_GT(json["check"]["colour"]["largest"].get<double>(), 0);
    EXPECT_LE(json["check"]["colour"]["largest"].get<double>(), 0.5001 / 255);
    EXPECT_NE(outcome.out.find("renders from 8 sides: PSNR "), std::string::npos) << outcome.out;
    EXPECT_GT(json["check"]["renders"]["psnr"].get<double>(), 30);
    EXPECT_LT(json["check"]["renders"]["psnr"].get<double>(), 80);
    EXPECT_LE(json["check"]["renders"]["worst_psnr"], json["check"]["renders"]["psnr"]);
    const Outcome equal = run_ewa({"convert", folder / "s.ply", folder / "t.ply", "--check"});
    EXPECT_NE(equal.out.find("renders from 8 sides are equal"), std::string::npos) << equal.out;
    Circumstances no_device;
    no_device.environment = {{"VK_ICD_FILENAMES", folder / "none.json"},
                             {"VK_DRIVER_FILES", folder / "none.json"}};
    const Outcome blind = run_ewa({"convert", folder / "s.ply", folder / "u.splat", "--check"}, no_device);
    expect_success(blind);
    EXPECT_NE(blind.out.find("no renders to compare: "), std::string::npos) << blind.out;
    EXPECT_FALSE(json["remarks"].empty());
    const Outcome quiet = run_ewa({"convert", folder / "s.ply", folder / "o.splat", "--check", "--quiet"});
    expect_success(quiet);
    EXPECT_EQ(quiet.out, "");
}

TEST(Convert, SpzVersions) {
    const Folder folder;
    make_splats(folder / "s.ply", 300, 1);
    for (const char* version : {"3", "4"}) {
        expect_success(run_ewa({"convert", folder / "s.ply", folder / "o.spz", "--spz-version", version}));
        EXPECT_EQ(ewa::read_splats(folder / "o.spz").variant, std::string("version ") + version);
    }
    expect_failure(run_ewa({"convert", folder / "s.ply", folder / "o.spz", "--spz-version", "2"}), 2,
                   "spz-version");
}

TEST(Convert, EditsOnTheWay) {
    const Folder folder;
    Gaussians g;
    g.sh_degree = 3;
    g.resize(4);
    g.means = {0, 0, 0, 1, 2, 3, 5, 5, 5, -1, -2, -3};
    g.opacity_logits = {4, 4, 4, -4};
    for (size_t i = 0; i < 4; ++i) g.quaternions[4 * i] = 1;
    ewa::save_splats(folder / "s.ply", g);
    const auto converted = [&](const Names& options) {
        Names arguments = {"convert", folder / "s.ply", folder / "o.ply"};
        arguments.insert(arguments.end(), options.begin(), options.end());
        expect_success(run_ewa(arguments));
        return ewa::load_splats(folder / "o.ply");
    };
    EXPECT_EQ(converted({}).means, g.means);
    EXPECT_EQ(converted({"--max-sh", "1"}).sh_degree, 1);
    EXPECT_EQ(converted({"--where", "opacity=0.5.."}).size(), 3u);
    EXPECT_EQ(converted({"--crop", "0,0,0,4,4,4"}).means, (std::vector<float>{0, 0, 0, 1, 2, 3}));
    EXPECT_EQ(converted({"--transform", "move=1,0,0", "--crop", "1.5,0,0,9,9,9"}).size(), 2u);
    EXPECT_EQ(converted({"--decimate", "50%"}).size(), 2u);
    EXPECT_EQ(converted({"--decimate", "3"}).size(), 3u);
    EXPECT_EQ(converted({"--decimate", "1k"}).means, g.means);
    EXPECT_EQ(converted({"--decimate", "0.1%", "--crop", "0,0,0,4,4,4"}).size(), 1u);
    EXPECT_EQ(converted({"--sort", "morton"}).means,
              (std::vector<float>{-1, -2, -3, 0, 0, 0, 1, 2, 3, 5, 5, 5}));
    // A quarter turn round z takes x to y; then twice the size, then moved.
    const Gaussians moved =
        converted({"--transform", "turn=0,0,1,90", "--transform", "scale=2", "--transform", "move=0,0,10"});
    EXPECT_EQ(std::vector<float>(moved.means.begin() + 3, moved.means.begin() + 6),
              (std::vector<float>{-4, 2, 16}));
    EXPECT_NEAR(moved.log_scales[0], std::log(2), 1e-6);
    // The first two splats are sqrt(14) apart; the length is that after the transform, too.
    for (const Names& options :
         {Names{"--scale-to", "0,0,0,1,2,3,7.483314773547883"},
          Names{"--transform", "scale=10", "--scale-to", "0,0,0,1,2,3,7.483314773547883"}}) {
        const Gaussians scaled = converted(options);
        for (size_t i = 0; i < 12; ++i) EXPECT_NEAR(scaled.means[i], 2 * g.means[i], 1e-5);
        EXPECT_NEAR(scaled.log_scales[0], std::log(2), 1e-6);
    }
    // The same as a matrix.
    const Gaussians matrix = converted({"--transform", "0,-2,0,0,2,0,0,0,0,0,2,10"});
    EXPECT_EQ(matrix.means, moved.means);
    EXPECT_EQ(matrix.quaternions, moved.quaternions);
}

TEST(Convert, JoinsInputs) {
    const Folder folder;
    make_splats(folder / "a.ply", 30, 1);
    make_splats(folder / "b.ply", 50, 2);
    ewa::save_splats(folder / "c.ply", ewa::load_splats(folder / "b.ply"), {"by hand"});
    expect_success(run_ewa({"convert", folder / "a.ply", folder / "c.ply", folder / "o.ply"}));
    const ewa::SplatScene joined = ewa::read_splats(folder / "o.ply");
    EXPECT_EQ(joined.gaussians.size(), 80u);
    EXPECT_EQ(joined.gaussians.sh_degree, 2);
    EXPECT_EQ(joined.comments, Names{"by hand"});
}

TEST(Convert, WrongUse) {
    const Folder folder;
    make_splats(folder / "s.ply");
    const auto refuse = [&](const Names& more, const std::string& text) {
        Names arguments = {"convert", folder / "s.ply", folder / "o.ply"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        expect_failure(run_ewa(arguments), 2, text);
        EXPECT_FALSE(fs::exists(folder / "o.ply"));
    };
    expect_failure(run_ewa({"convert", folder / "s.ply"}), 2, "FILES");
    expect_failure(run_ewa({"convert", folder / "s.ply", folder / "o.obj"}), 2, "supported: .ply");
    expect_failure(run_ewa({"convert", folder / "none.ply", folder / "o.ply"}), 2, "none.ply");
    // Before the inputs are read.
    expect_failure(run_ewa({"convert", folder / "none.ply", folder / "o.ksplat"}), 2, "does not write it");
    expect_failure(run_ewa({"convert", folder / "none.ply", folder / "o.ply", "--crop", "1,2"}), 2, "--crop");
    expect_failure(run_ewa({"convert", folder / "none.ply", folder / "s.ply/o.ply"}), 1, "s.ply");
    expect_failure(
        run_ewa({"convert", folder / "none.ply", folder / "o.ply", "--json", folder / "s.ply/o.json"}), 1,
        "s.ply");
    refuse({"--transform", "spin=1"}, "spin=1");
    refuse({"--transform", "turn=0,0,0,90"}, "turn=0,0,0,90");
    refuse({"--transform", "1,2,3"}, "1,2,3");
    refuse({"--transform", "scale=x"}, "--transform");
    refuse({"--transform", "scale=0"}, "flattens");
    refuse({"--scale-to", "0,0,0,1,1,1"}, "x,y,z,X,Y,Z,LENGTH");
    refuse({"--scale-to", "0,0,0,0,0,0,1"}, "two points that differ");
    refuse({"--scale-to", "0,0,0,1,0,0,0"}, "a length above 0");
    refuse({"--scale-to", "0,0,0,1,0,0,1e40"}, ": --scale-to: 50 of 50 splats could not be drawn");
    refuse({"--transform", "scale=2", "--scale-to", "0,0,0,1,0,0,1e40"},
           ": --transform and --scale-to: 50 of 50");
    for (const char* name : {"o.glb", "o.gltf", "tileset.json"})
        expect_failure(
            run_ewa({"convert", folder / "s.ply", folder / name, "--spz-version", "4", "--gltf-spz"}), 2,
            "--spz-version: a glTF and tiles hold SPZ 2");
    for (const char* name : {"o.glb", "o.sog", "o.html"})
        expect_failure(run_ewa({"convert", folder / "s.ply", folder / name, "--spz-version", "4"}), 2,
                       "--spz-version: only an .spz has one");
    refuse({"--spz-version", "3"}, "--spz-version: only an .spz has one");
    refuse({"--crop", "1,2,3"}, "--crop");
    refuse({"--crop", "1,0,0,0,1,1"}, "lower corner");
    refuse({"--where", "opacity=a.."}, "--where");
    refuse({"--max-sh", "4"}, "max-sh");
    for (const char* text : {"0", "0%", "101%", "half", "-5", "%"})
        refuse({std::string("--decimate=") + text}, "--decimate: '");
    refuse({"--sort", "size"}, "sort");
}

TEST(Convert, PlacesEachInputByItself) {
    const Folder folder;
    make_splats(folder / "a.ply");
    make_splats(folder / "b:move=9,9,9.ply");  // a path that exists is a path
    fs::copy_file(folder / "a.ply", folder / "c.ply");
    expect_success(run_ewa({"convert", folder / "a.ply", folder / "b:move=9,9,9.ply",
                            folder / "c.ply:scale=2:move=1,0,0", folder / "o.ply"}));
    const Gaussians a = ewa::load_splats(folder / "a.ply"), out = ewa::load_splats(folder / "o.ply");
    ASSERT_EQ(out.size(), 3 * a.size());
    for (size_t i = 0; i < a.size(); ++i) {
        const glm::dvec3 mean = a.world_mean(i);
        EXPECT_EQ(out.world_mean(i), mean);
        EXPECT_EQ(out.world_mean(a.size() + i), mean);
        const glm::dvec3 placed = 2.0 * mean + glm::dvec3(1, 0, 0);
        EXPECT_LT(glm::length(out.world_mean(2 * a.size() + i) - placed), 1e-6);
    }
    const auto refused = [&](const std::string& input, const std::string& text) {
        expect_failure(run_ewa({"convert", folder / input, folder / "p.ply"}), 2, text);
        EXPECT_FALSE(fs::exists(folder / "p.ply"));
    };
    refused("a.ply:mov=1,0,0", "a.ply: 'mov=1,0,0' is not move=x,y,z, turn=");
    refused("a.ply:scale=1e40", "a.ply: 50 of 50 splats could not be drawn afterwards");
    refused("none.ply:move=1,0,0", "none.ply");
    expect_failure(run_ewa({"convert", folder / "a.ply:move=1,0,0", folder / "a.ply"}), 2, "an input");
}

TEST(Convert, RefusesATransformAfterWhichNothingIsDrawn) {
    const Folder folder;
    make_splats(folder / "s.ply");
    Gaussians splats = ewa::load_splats(folder / "s.ply");
    splats.means[3] = std::numeric_limits<float>::quiet_NaN();  // was not drawn before either
    ewa::save_splats(folder / "s.ply", splats);
    for (const char* name : {"o.ply", "o.splat"}) {
        const std::string out = folder / name;
        expect_failure(
            run_ewa({"convert", folder / "s.ply", out, "--quiet", "--transform", "scale=1e40", "--check"}), 2,
            "49 of 49 splats could not be drawn");
        EXPECT_FALSE(fs::exists(out));
        expect_success(run_ewa({"convert", folder / "s.ply", out, "--quiet", "--transform", "scale=1e9"}));
    }
}

TEST(Convert, NoFileTakesAnothersPlace) {
    const Folder folder;
    make_splats(folder / "s.ply");
    const std::string good = read_file(folder / "s.ply");
    const auto refuse = [&](const std::string& out, const std::string& json, const std::string& text) {
        expect_failure(run_ewa({"convert", folder / "s.ply", folder / out, "--json", json}), 2, text);
        EXPECT_FALSE(fs::exists(folder / out));
        EXPECT_EQ(read_file(folder / "s.ply"), good);
    };
    refuse("o.ply", folder / "o.ply", "OUT");
    refuse("o.ply", folder / "none/../o.ply", "OUT");
    refuse("o.ply", folder / "s.ply", "an input");
    refuse("o.gltf", folder / "o.bin", "the file of OUT's values");
    fs::create_symlink(folder / "s.ply", folder / "link.json");
    refuse("o.ply", folder / "link.json", "an input");
    fs::copy_file(folder / "s.ply", folder / "o.bin");
    expect_success(run_ewa({"convert", folder / "o.bin", folder / "o.gltf"}));
    EXPECT_EQ(read_file(folder / "o.bin"), good);
    expect_failure(run_ewa({"convert", folder / "s.ply", folder / "o.gltf", "--json", folder / "o-2.bin"}), 2,
                   "the file of OUT's older values");
    // An output that is an input, by any name.
    fs::create_symlink(folder / "s.ply", folder / "soft.ply");
    fs::create_hard_link(folder / "s.ply", folder / "hard.ply");
    fs::create_directory_symlink(folder / ".", folder / "around");
    for (const char* out : {"s.ply", "soft.ply", "hard.ply", "around/s.ply", "none/../s.ply"})
        expect_failure(run_ewa({"convert", folder / "s.ply", folder / out, "--max-sh", "0"}), 2,
                       "is the same file as an input; it would be overwritten; name another file");
    expect_failure(run_ewa({"convert", folder / "hard.ply", folder / "s.ply", folder / "soft.ply"}), 2,
                   "an input");
    EXPECT_EQ(read_file(folder / "s.ply"), good);
    EXPECT_TRUE(fs::is_symlink(folder / "soft.ply"));
    expect_success(run_ewa({"convert", folder / "s.ply", folder / "s.ply", folder / "twice.ply"}));
}

TEST(Convert, RefusesAnEmptyResult) {
    const Folder folder;
    make_splats(folder / "s.ply");
    write_file(folder / "o.ply", "old");
    const Names convert{"convert", folder / "s.ply", folder / "o.ply", "--crop", "90,90,90,91,91,91"};
    expect_failure(run_ewa(convert), 2, "none of the 50 splats is left after the edits; --allow-empty");
    EXPECT_EQ(read_file(folder / "o.ply"), "old");
    Names allowed = convert;
    allowed.push_back("--allow-empty");
    expect_success(run_ewa(allowed));
    EXPECT_EQ(ewa::load_splats(folder / "o.ply").size(), 0u);
    expect_failure(run_ewa({"convert", folder / "o.ply", folder / "p.ply"}), 2, "the inputs have no splats");
    EXPECT_FALSE(fs::exists(folder / "p.ply"));
}

TEST(Convert, TheOutputMayHaveItsOption) {
    const Folder folder;
    make_splats(folder / "s.ply");
    expect_success(run_ewa({"convert", folder / "s.ply", "-o", folder / "o.spz"}));
    expect_success(run_ewa({"convert", folder / "s.ply", folder / "o.spz", "-o", folder / "both.ply"}));
    EXPECT_EQ(ewa::load_splats(folder / "both.ply").size(), 100u);
    expect_failure(run_ewa({"convert", folder / "s.ply"}), 2, "an input and the output are needed");
    expect_failure(run_ewa({"convert", folder / "s.ply", "-o", folder / "s.ply"}), 2, "an input");
}

TEST(Convert, SaysWhatToWriteInstead) {
    const Folder folder;
    make_splats(folder / "s.ply");
    for (const char* name : {"o.obj", "o.ksplat"}) {
        const Outcome outcome = run_ewa({"convert", folder / "s.ply", folder / name});
        expect_failure(outcome, 2,
                       ".ply, .compressed.ply, .splat, .spz, .sog, meta.json of a SOG, lod-meta.json, .glb, "
                       ".gltf, .usda, .usdz, tileset.json, .html (a page)");
    }
    EXPECT_EQ(files_below(folder / ""), Names{"s.ply"});
}

TEST(Convert, APagePlaysAFilm) {
    const Folder folder;
    make_splats(folder / "s.ply");
    const std::string view =
        R"({"name": "a", "width": 48, "height": 32, "fx": 50, "fy": 50, "cx": 24, "cy": 16,
            "rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1], "translation": [0, 0, 4])";
    const auto keys = [&](const std::string& first, const std::string& second) {
        write_file(folder / "v.json", "{\"views\": [" + view + first + "}, " + view + second + "}]}");
        expect_success(
            run_ewa({"convert", folder / "s.ply", folder / "p.html", "--views", folder / "v.json"}));
        return read_file(folder / "p.html");
    };
    EXPECT_NE(keys(R"(, "time": 1)", R"(, "time": 4.5)").find("\"time\":3.5"), std::string::npos);
    EXPECT_NE(keys("", "").find("\"time\":2.0"), std::string::npos) << "views without times";
    expect_failure(run_ewa({"convert", folder / "s.ply", folder / "c.spz", "--views", folder / "v.json"}), 2,
                   "--views: only a page plays a film");
    write_file(folder / "v.json", "{\"views\": []}");
    expect_failure(run_ewa({"convert", folder / "s.ply", folder / "c.html", "--views", folder / "v.json"}), 2,
                   "has no views");
}

TEST(Convert, WritesAPage) {
    const Folder folder;
    make_splats(folder / "s.ply");
    expect_success(
        run_ewa({"convert", folder / "s.ply", folder / "a <b>.html", "--json", folder / "j.json"}));
    const std::string page = read_file(folder / "a <b>.html");
    EXPECT_NE(page.find("<title>a &lt;b&gt;</title>"), std::string::npos);
    EXPECT_NE(page.find("id=\"scene\">UEsDB"), std::string::npos) << "no archive in the page";
    EXPECT_EQ(read_json(folder / "j.json")["output"]["format"], "page");
    expect_success(run_ewa({"convert", folder / "s.ply", folder / "a <b>.html", "--title", "The <fox> & more",
                            "--json", folder / "j.json"}));
    const std::string named = read_file(folder / "a <b>.html");
    for (const char* text :
         {"<title>The &lt;fox&gt; &amp; more</title>", "<h1>The &lt;fox&gt; &amp; more</h1>"})
        EXPECT_NE(named.find(text), std::string::npos) << text;
    expect_failure(run_ewa({"convert", folder / "s.ply", folder / "c.spz", "--title", "x"}), 2,
                   "--title: only a page has one");
    expect_failure(run_ewa({"convert", folder / "s.ply", folder / "c.obj"}), 2,
                   "tileset.json, .html (a page); ewa mesh makes meshes: ewa mesh IN -o c.obj");
    expect_failure(run_ewa({"convert", folder / "s.ply", folder / "c.html", "--check"}), 2, "check a .sog");
    expect_failure(run_ewa({"convert", folder / "a <b>.html", folder / "d.ply"}), 2,
                   "ewa writes pages and does not read them");
    EXPECT_EQ(files_below(folder / ""), (Names{"a <b>.html", "j.json", "s.ply"}));
}

TEST(Convert, FullDiskLeavesNoHalfFile) {
    const Folder folder;
    make_splats(folder / "s.ply", 2000, 3);
    Circumstances full;
    full.file_limit = 2048;
    for (const char* name : {"o.ply", "o.compressed.ply", "o.splat", "o.spz", "o.glb", "o.gltf", "o.sog"}) {
        expect_failure(run_ewa({"convert", folder / "s.ply", folder / name}, full), 1, "o.");
        EXPECT_EQ(files_below(folder / "."), Names{"s.ply"}) << name;
    }
}

TEST(Formats, EveryCommandReadsEveryFormat) {
    const Folder folder;
    make_dataset(folder / "data");
    make_splats(folder / "s.ply");
    for (const std::string& name : kFiles) {
        SCOPED_TRACE(name);
        const std::string file = folder / name;
        expect_success(run_ewa({"convert", folder / "s.ply", file}));
        const Outcome info = run_ewa({"info", file, "--json"});
        expect_success(info);
        const auto json = nlohmann::json::parse(info.out);
        EXPECT_EQ(json["splats"], 50);
        EXPECT_EQ(json["format"], std::string(ewa::name_of(ewa::format_of_name(file))));
        EXPECT_EQ(json["antialiased"], false);
        EXPECT_GT(json["bytes"].get<int>(), 0);
        EXPECT_GE(json["opacity"]["median"], json["opacity"]["min"]);
        EXPECT_LE(json["opacity"]["median"], json["opacity"]["max"]);
        expect_success(run_ewa({"info", file}));
        const Outcome outcome =
            run_ewa({"eval", file, folder / "data", "--split", "all", "--json", folder / "e.json"});
        expect_success(outcome);
        EXPECT_GT(read_json(folder / "e.json")["psnr"].get<double>(), 1);
        expect_success(run_ewa({"render", file, "--cameras", folder / "data", "--frames", "0", "--quiet",
                                "-o", folder / "pictures"}));
    }
    expect_success(run_ewa({"train", folder / "data", "--init", folder / "a.spz", "--steps", "1", "--quiet",
                            "-o", folder / "out"}));
    expect_failure(
        run_ewa({"grad", folder / "a.spz", folder / "data", "--frame", "0", "-o", folder / "g.spz"}), 2,
        "g.spz");
}

TEST(Formats, UsdIsWrittenAndNotRead) {
    const Folder folder;
    make_dataset(folder / "data");
    make_splats(folder / "s.ply");
    for (const std::string& name : kUsdFiles) {
        SCOPED_TRACE(name);
        const std::string file = folder / name, text = name + ": ewa writes USD and does not read it";
        expect_success(run_ewa({"convert", folder / "s.ply", file}));
        expect_failure(run_ewa({"info", file}), 2, text);
        expect_failure(run_ewa({"info", file, "--json"}), 2, text);
        expect_failure(run_ewa({"convert", file, folder / "b.ply"}), 2, text);
        expect_failure(run_ewa({"eval", file, folder / "data"}), 2, text);
        expect_failure(run_ewa({"convert", folder / "s.ply", file, "--check"}), 2,
                       "--check: ewa writes USD and does not read it");
    }
}

TEST(Formats, ADensityKeepsItsKernelAndIsFittedForOthers) {
    const Folder folder;
    make_dataset(folder / "data");
    make_splats(folder / "plain.ply");
    ewa::Gaussians density = ewa::load_splats(folder / "plain.ply");
    for (size_t i = 0; i < density.size(); ++i) density.log_scales[3 * i] += 1;
    ewa::save_splats(folder / "plain.ply", density);
    density.density = true;
    ewa::save_splats(folder / "s.ply", density);
    const Outcome info = run_ewa({"info", folder / "s.ply", "--json"});
    EXPECT_EQ(nlohmann::json::parse(info.out)["density"], true);
    const auto psnr = [&](const std::string& file, const std::vector<std::string>& more) {
        std::vector<std::string> arguments{"eval", folder / file, folder / "data",  "--split",
                                           "all",  "--json",      folder / "e.json"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        expect_success(run_ewa(arguments));
        return read_json(folder / "e.json")["psnr"].get<double>();
    };
    const double own = psnr("s.ply", {}), fitted = psnr("s.ply", {"--kernel", "peak"});
    EXPECT_NE(own, fitted);
    EXPECT_EQ(own, psnr("s.ply", {"--kernel", "ewa"}));
    // Cut out, it is a density still; in another format it has the opacities that other viewers show.
    expect_success(run_ewa({"convert", folder / "s.ply", folder / "cut.ply", "--transform", "scale=2"}));
    const ewa::Gaussians again = ewa::load_splats(folder / "cut.ply");
    EXPECT_TRUE(again.density);
    EXPECT_NEAR(again.opacity_logits[7], density.opacity_logits[7], 1e-5);
    const Outcome packed = run_ewa({"convert", folder / "s.ply", folder / "s.spz"});
    expect_success(packed);
    EXPECT_NE(packed.out.find("--kernel density"), std::string::npos) << packed.out;
    EXPECT_NEAR(psnr("s.spz", {}), fitted, 1);
    const Outcome joined = run_ewa({"convert", folder / "s.ply", folder / "plain.ply", folder / "both.ply"});
    expect_success(joined);
    EXPECT_NE(joined.out.find("fitted to 3DGS's kernel"), std::string::npos) << joined.out;
    EXPECT_FALSE(ewa::load_splats(folder / "both.ply").density);
}

TEST(Formats, InfoShowsTheMarkAndTheComments) {
    const Folder folder;
    make_splats(folder / "s.ply");
    ewa::save_splats(folder / "m.ply", ewa::load_splats(folder / "s.ply"),
                     ewa::SaveOptions{.comments = {"from\xff a camera"}, .antialiased = true});
    const Outcome text = run_ewa({"info", folder / "m.ply"});
    expect_success(text);
    EXPECT_NE(text.out.find("anti-aliased"), std::string::npos) << text.out;
    EXPECT_NE(text.out.find(" a camera"), std::string::npos) << text.out;
    const Outcome json = run_ewa({"info", folder / "m.ply", "--json"});
    expect_success(json);
    EXPECT_EQ(nlohmann::json::parse(json.out)["antialiased"], true);
    expect_success(run_ewa({"convert", folder / "m.ply", folder / "m.spz"}));
    EXPECT_TRUE(ewa::read_splats(folder / "m.spz").antialiased);
}

}  // namespace
