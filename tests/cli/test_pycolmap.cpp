// SPDX-License-Identifier: Apache-2.0
// ewa cameras where COLMAP is a Python package, with a module in its place. The last test runs the real one.
#include <cstdlib>

#include "capture/colmap_program.h"
#include "cli/cameras_test.h"
#include "core/process.h"

namespace {

using namespace ewa::test;
namespace fs = std::filesystem;

/// Says what it was called with, and prints what COLMAP prints. Its mapper copies models.
constexpr const char* kModule = R"py(
import os, pathlib, shutil

__version__ = "4.2.1"


class Options:
    def __init__(self, **fields):
        self.__dict__.update(fields)


class ImageReaderOptions(Options):
    def __init__(self):
        super().__init__(camera_model="SIMPLE_PINHOLE", mask_path=pathlib.Path())


class FeatureExtractionOptions(Options):
    def __init__(self):
        super().__init__(use_gpu=True, sift=Options(first_octave=-1, max_num_features=8192))


class FeatureMatchingOptions(Options):
    def __init__(self):
        super().__init__(use_gpu=True, num_threads=-1)


class ImportedPairingOptions(Options):
    match_list_path = ""


class IncrementalPipelineOptions(Options):
    def __init__(self):
        inner = Options(init_max_forward_motion=0.95, init_min_tri_angle=16.0, abs_pose_min_num_inliers=30)
        super().__init__(min_model_size=10, ba_global_frames_ratio=1.1, ba_global_points_ratio=1.1, ba_global_max_num_iterations=50,
                         ba_global_max_refinements=5, ba_local_max_num_iterations=25, num_threads=-1, random_seed=-1,
                         ba_refine_focal_length=True, ba_refine_extra_params=True, mapper=inner)


class logging:
    pass


class CameraMode:
    AUTO, SINGLE = "AUTO", "SINGLE"


class Device:
    cpu = "cpu"


def begin(*words):
    with open(os.environ["CALLS"], "a") as calls:
        print(*words, file=calls)
    if os.environ.get("FAIL") == words[0]:
        raise RuntimeError("the reason")


def extract_features(database, images, names, mode, reader, extraction, device):
    begin("extract", *map(os.fsdecode, names), mode, reader.camera_model, extraction.use_gpu, device)
    pathlib.Path(database).touch()
    for i in range(4):
        print(f"Processed file [{i + 1}/4]", flush=True)


def match_image_pairs(database, matching, pairs, device):
    begin("match", matching.num_threads, len(open(pairs.match_list_path).readlines()), device)


def match_exhaustive(database, matching, device):
    begin("exhaustive", matching.num_threads, device)


class Model:
    def write(self, folder):
        shutil.copytree(os.environ["MODELS"] + "/more/0", folder, dirs_exist_ok=True)


def incremental_mapping(database, images, output, options, input_path):
    inner = options.mapper
    begin("map", options.min_model_size, options.ba_global_frames_ratio, options.ba_refine_focal_length, options.num_threads,
          inner.init_max_forward_motion, inner.abs_pose_min_num_inliers, options.random_seed, bool(input_path))
    if input_path:
        return {0: Model()}
    models = os.environ["MODELS"] + "/first"
    shutil.copytree(models, output, dirs_exist_ok=True)
    return {int(name): Model() for name in os.listdir(models)}
)py";

/// The Python of this machine, in a folder that has nothing else. option: an empty text, or one of Python's.
void make_python(const std::string& folder, const std::string& option) {
    fs::create_directories(folder);
    const char* path = std::getenv("PATH");
    make_program(folder + "/python3", "PATH='" + std::string(path ? path : "") + "' exec '" +
                                          ewa::core::find_program("python3").string() + "' " + option +
                                          " \"$@\"\n");
}

class Pycolmap : public CamerasTest {
  protected:
    using Environment = std::vector<std::pair<std::string, std::string>>;

    void SetUp() override {
        CamerasTest::SetUp();
        fs::remove(folder_ / "bin/colmap");
        make_python(folder_ / "bin", "-S");  // without installed packages
        fs::create_directories(folder_ / "packages");
        write_file(folder_ / "packages/pycolmap.py", kModule);
    }

    /// more: of the environment.
    Outcome run_here(const std::vector<std::string>& arguments, const Environment& more = {},
                     const std::string& program = {}) {
        Environment environment{{"PATH", folder_ / "bin"},
                                {"PYTHONPATH", folder_ / "packages"},
                                {"VIRTUAL_ENV", ""},
                                {"CALLS", folder_ / "calls"},
                                {"MODELS", folder_ / "models"}};
        environment.insert(environment.end(), more.begin(), more.end());
        return run_ewa(arguments, {.program = program, .environment = environment});
    }
    Outcome search(const Environment& more = {}, const std::string& program = {}) {
        return run_here({"cameras", folder_ / "photos", "-o", folder_ / "dataset"}, more, program);
    }
};

TEST_F(Pycolmap, FindsCamerasWhereThereIsNoProgram) {
    make_model("first/0", {"0.png", "1.png", "2.png", "3.png"});
    const Outcome outcome = search();
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("4 of 4 photos have cameras"), std::string::npos) << outcome.out;
    EXPECT_EQ(calls(),
              "extract 0.png 1.png 2.png 3.png SINGLE SIMPLE_RADIAL False cpu\n"
              "match 1 6 cpu\n"
              "map 3 1.4 True 1 0.95 30 -1 False\n");
    EXPECT_NE(read_file(folder_ / "dataset/colmap/log.txt").find("Processed file [4/4]"), std::string::npos);
    EXPECT_EQ(run_ewa({"info", folder_ / "dataset"}).status, 0);
}

/// Other ways, other random numbers, and a model that grows.
TEST_F(Pycolmap, TakesTheOptionsOfEachCommand) {
    fs::rename(folder_ / "photos/1.png", folder_ / "photos/a b.png");
    make_model("first/0", {"0.png", "2.png", "3.png"});
    make_model("more/0", {"0.png", "2.png", "3.png", "a b.png"});
    const Outcome outcome = search();
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("placed 4 of 4 photos with fewer matches"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("4 of 4 photos have cameras"), std::string::npos) << outcome.out;
    for (const char* call :
         {"exhaustive 1 cpu\n", " 1.0 30 -1 False\n", " 0.95 30 1 False\n", " 0.95 20 -1 True\n"})
        EXPECT_NE(calls().find(call), std::string::npos) << call << " is not in: " << calls();
}

TEST_F(Pycolmap, IsNotAskedWhereThereIsTheProgram) {
    make_model("0", {"0.png", "1.png", "2.png", "3.png"});
    SetUpColmap();
    ASSERT_EQ(search({{"PATH", folder_ / "bin" + ":/usr/bin:/bin"}}).status, 0);
    EXPECT_EQ(calls(), "feature_extractor\nmatches_importer\nmapper\n");
}

TEST_F(Pycolmap, MayBeThatOfAnEnvironment) {
    make_model("first/0", {"0.png", "1.png", "2.png", "3.png"});
    make_python(folder_ / "environment/bin", "-S");
    fs::create_directories(folder_ / "empty");
    const std::pair<std::string, std::string> nothing{"PATH", folder_ / "empty"};
    expect_failure(search({nothing}), 1, "photos without cameras need COLMAP");
    const Outcome outcome = search({nothing, {"VIRTUAL_ENV", folder_ / "environment"}});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
}

TEST_F(Pycolmap, AFailureNamesTheLogAndCanBeRepeated) {
    make_model("first/0", {"0.png", "1.png", "2.png", "3.png"});
    const std::string log = folder_ / "dataset/colmap/log.txt";
    expect_failure(search({{"FAIL", "match"}}), 1,
                   "colmap matches_importer failed; " + log + " has its reason");
    EXPECT_NE(read_file(log).find("the reason"), std::string::npos);
    EXPECT_EQ(search().status, 0);
}

TEST_F(Pycolmap, ThatIsTooOldOrElsewhereDoesNotCount) {
    const std::string missing = "photos without cameras need COLMAP, which is not installed (";
    write_file(folder_ / "packages/pycolmap.py", "__version__ = '3.11'\n");
    expect_failure(search(), 1, missing);
    // A module in the current folder may come with the photos.
    fs::remove(folder_ / "packages/pycolmap.py");
    write_file(folder_ / "photos/pycolmap.py", kModule);
    make_program(folder_ / "in_photos", "cd '" + folder_ / "photos" + "' && exec " EWA_PROGRAM " \"$@\"\n");
    expect_failure(search({}, folder_ / "in_photos"), 1, missing);
    EXPECT_EQ(calls(), "");
}

TEST_F(Pycolmap, IsNamedByTheDoctor) {
    const Outcome outcome = run_here({"doctor", "--json", "-o", folder_ / "out"});
    for (const auto& check : nlohmann::json::parse(outcome.out)["checks"])
        if (check["name"] == "cameras of photos") {
            EXPECT_TRUE(check["works"].get<bool>());
            EXPECT_EQ(check["detail"], "pycolmap 4.2.1 of " + folder_ / "bin/python3");
        }
}

/// Options of COLMAP have other names from some release on.
TEST(ColmapOptions, AreThoseOfTheRelease) {
    const Folder folder;
    fs::create_directories(folder / "bin");
    const std::string path = std::getenv("PATH");
    setenv("PATH", (folder / "bin" + ":" + path).c_str(), 1);
    const ewa::capture::ProgressFunction progress = [](const ewa::CaptureProgress&) { return true; };
    const auto solver = [&](const std::string& option) {
        make_program(folder / "bin/colmap", "echo '  --" + option + " arg (=100)'\n");
        return ewa::capture::Colmap(folder / "bin", {}, progress).options_of_solver();
    };
    EXPECT_EQ(solver("BundleAdjustment.max_num_iterations"), "--BundleAdjustment.");
    EXPECT_EQ(solver("BundleAdjustmentCeres.max_num_iterations"), "--BundleAdjustmentCeres.");
    setenv("PATH", path.c_str(), 1);
}

/// Real photos, where pycolmap and the photos are on this machine.
TEST(RealCapture, OfPycolmapPlacesPhotos) {
    const auto photos = shared_data();
    if (!photos || std::system("python3 -c 'import pycolmap' 2>/dev/null") != 0)
        GTEST_SKIP() << "no pycolmap, or no photos";
    const Folder folder;
    make_python(folder / "bin", "");
    fs::create_directories(folder / "photos");
    int count = 0;
    for (const std::string& name : files_below((*photos / "fox_270/images").string()))
        if (count++ < 12) fs::copy(*photos / "fox_270/images" / name, folder / ("photos/" + name));
    const Outcome outcome = run_ewa({"cameras", folder / "photos", "-o", folder / "dataset"},
                                    {.environment = {{"PATH", folder / "bin"}}});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("12 of 12 photos have cameras"), std::string::npos) << outcome.out;
}

}  // namespace
