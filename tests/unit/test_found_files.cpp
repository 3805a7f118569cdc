// SPDX-License-Identifier: Apache-2.0
// Datasets as people have them: images, masks, depth maps and points under other names and in other places than usual.
#include <algorithm>

#include "core/text.h"
#include "ewa/dataset.h"
#include "io/datasets/dataset_folders.h"
#include "io/datasets/image_records.h"
#include "platform/file_facts.h"
#include "support/png_bytes.h"
#include "support/temp_folder.h"
#include "support/transforms_scene.h"

namespace {

using namespace ewa;
namespace fs = std::filesystem;
using test::expect_error;
using test::TempFolder;

void save(const fs::path& path, const Image& image = Image(8, 6, 3)) {
    fs::create_directories(path.parent_path());
    save_image(path, image);
}

/// A mask whose left half is white.
Image half() {
    Image mask(8, 6, 1);
    for (int y = 0; y < 6; ++y)
        for (int x = 0; x < 4; ++x) *mask.at(x, y) = 1;
    return mask;
}

const std::string kCameras = "1 PINHOLE 8 6 10 11 4 3\n",
                  kPoints = "1 1 2 3 4 5 6 0.5 1 2\n2 3 2 1 4 5 6 0.5\n";

std::string lines_of(const std::vector<std::string>& names, const std::string& observations = "\n") {
    std::string text = "# images\n";
    for (size_t i = 0; i < names.size(); ++i)
        text += std::to_string(i + 1) + " 1 0 0 0 0 0 " + std::to_string(i) + " 1 " + names[i] + "\n" +
                observations;
    return text;
}

/// A dataset of COLMAP as text.
struct Colmap {
    TempFolder folder;

    /// The model of these images in a folder.
    void model(const std::string& place, const std::vector<std::string>& names,
               const std::string& observations = "\n") const {
        const fs::path at(place);
        folder.write(at / "cameras.txt", kCameras);
        folder.write(at / "images.txt", lines_of(names, observations));
        folder.write(at / "points3D.txt", kPoints);
    }
    void photos(const std::vector<std::string>& files) const {
        for (const std::string& file : files) save(folder / file);
    }
    Dataset load(DatasetOptions options = {}) const { return load_dataset(folder.path(), options); }
    std::string used() const { return used_text(load()); }
};

std::vector<std::string> image_names(const Dataset& dataset) {
    std::vector<std::string> names;
    for (const Frame& frame : dataset.frames) names.push_back(frame.name);
    return names;
}

TEST(FoundFiles, ImagesWithAndWithoutLinesOfObservations) {
    const std::vector<std::string> names{"0.png", "1 a.png", "2 3 4.png", "3.png"};
    for (const char* observations :
         {"", "\n", "\n\n", "1.5 2.5 -1\n", "1 2 3 4 5 6 7 8 9\n", "1 2 3 4 5 6 7 8 9 1 2 3\n",
          "1 2 3 4 5 6 7 8 9 1 2 3 4 5 6\n", "# none\n"}) {
        SCOPED_TRACE(observations);
        const Colmap data;
        data.model("sparse/0", names, observations);
        for (const std::string& name : names) save(data.folder / "images" / name);
        EXPECT_EQ(image_names(data.load()), names);
        EXPECT_EQ(data.used(), "4 of 4 photos, 2 points");
    }
    const Colmap data;
    data.model("sparse/0", {"0.png"}, "1.5 2.5 three\n");
    data.photos({"images/0.png"});
    expect_error<InputError>([&] { data.load(); }, {"images.txt:3:", "\"1.5\""});
    data.model("sparse/0", {"0.png"}, "1.5 2.5\n");
    expect_error<InputError>([&] { data.load(); }, {"images.txt:3:"});
}

TEST(FoundFiles, TheModelWithTheMostImagesIsUsed) {
    const Colmap data;
    data.photos({"images/0.png", "images/1.png", "images/2.png"});
    data.model("sparse/0", {"0.png"});
    data.model("sparse/1", {"0.png", "1.png"});
    data.model("sparse/10", {"0.png"});
    EXPECT_EQ(data.load().frames.size(), 2u);
    EXPECT_EQ(data.used(),
              "2 of 3 photos (images/2.png has no camera), 2 points, 1 of 3 models (sparse/1 with 2 images "
              "as text, not "
              "sparse/0 with 1 image as text)");
    // Who names one gets it.
    EXPECT_EQ(load_dataset(data.folder / "sparse/0", {}).frames.size(), 1u);
    EXPECT_EQ(load_dataset(data.folder / "sparse", {}).frames.size(), 2u);
    // As binary files beside text, and in sparse itself.
    for (const char* place : {"sparse/1", "sparse"}) {
        SCOPED_TRACE(place);
        io::ImageRecords records = io::read_colmap({data.folder / "sparse/1", {}, {}, ".txt"});
        records.images.push_back(records.images[0]);
        records.images.back().name = "2.png";
        io::write_colmap(data.folder / place, records.images, records.points);
        EXPECT_EQ(image_names(data.load()), (std::vector<std::string>{"0.png", "1.png", "2.png"}));
        fs::remove(data.folder / place / "images.bin");
    }
    // The same model in both forms is one.
    const Colmap both;
    both.model("sparse/0", {"0.png"});
    both.photos({"images/0.png"});
    const io::ImageRecords records = io::read_colmap({both.folder / "sparse/0", {}, {}, ".txt"});
    io::write_colmap(both.folder / "sparse/0", records.images, {});
    EXPECT_EQ(both.used(), "1 of 1 photo");
    EXPECT_TRUE(both.load().points.positions.empty()) << "those of points3D.bin, which is preferred";
}

struct Place {
    const char *model, *named, *file;
};

TEST(FoundFiles, ImagesUnderOtherNamesAndInOtherPlaces) {
    const std::string nfc = "caf\xc3\xa9.jpg", nfd = "cafe\xcc\x81.jpg";
    const Place places[] = {{"sparse/0", "a.jpg", "images/a.png"},
                            {"sparse/0", "a.png", "images/A.PNG"},
                            {"sparse/0", "a", "images/a.JPG"},
                            {"sparse/0", "images/a.png", "images/a.png"},
                            {"sparse/0", "images/a.jpg", "images/a.png"},
                            {"sparse/0", "/home/u/project/images/a.png", "images/a.png"},
                            {"sparse/0", "C:\\Users\\u\\a.png", "images/a.png"},
                            {"sparse/0", "../photos/a.png", "images/a.png"},
                            {"sparse/0", "cam0/a.png", "images/cam0/a.png"},
                            {"sparse/0", "cam0/a.png", "images/Cam0/a.jpg"},
                            {"sparse/0", "cam0/a.png", "images/a.png"},
                            {"sparse/0", "a.png", "images/cam0/a.png"},
                            {"sparse/0", nfc.c_str(), "images/cafe\xcc\x81.jpg"},
                            {"sparse/0", nfd.c_str(), "images/caf\xc3\xa9.png"},
                            {"sparse/0", "a.png", "input/a.png"},
                            {"sparse/0", "a.png", "Images/a.png"},
                            {"Sparse/0", "a.png", "images/a.png"},
                            {"sparse/0", "a.png", "a.png"},
                            {"sparse/0", "a.png", "photos/a.png"},
                            {"sparse/0", "a.png", "sparse/0/a.png"},
                            {"sparse/0", "a.png", "sparse/0/images/a.png"},
                            {"sparse", "a.png", "images/a.png"},
                            {"sparse", "a.png", "sparse/a.png"},
                            {".", "a.png", "a.png"},
                            {".", "a.png", "images/a.png"},
                            {"7", "a.png", "images/a.png"},
                            {"dense/0/sparse", "a.png", "dense/0/images/a.png"},
                            {"dense/sparse", "a.png", "dense/images/a.png"},
                            {"dense", "a.png", "dense/images/a.png"},
                            {"undistorted/sparse", "a.png", "undistorted/images/a.png"},
                            {"distorted/sparse/0", "a.png", "input/a.png"},
                            {"colmap/sparse/0", "a.png", "images/a.png"},
                            {"colmap/sparse/0", "a.png", "a.png"}};
    for (const auto& [model, named, file] : places) {
        SCOPED_TRACE(std::string(model) + ": " + named + " is " + file);
        const Colmap data;
        data.model(model, {named});
        data.photos({file});
        EXPECT_TRUE(io::is_dataset_folder(data.folder.path()));
        const Dataset dataset = data.load();
        ASSERT_EQ(dataset.frames.size(), 1u);
        EXPECT_TRUE(fs::equivalent(dataset.frames[0].image_path, data.folder / file));
        EXPECT_EQ(dataset.used[0].used, 1u);
        EXPECT_EQ(dataset.used[0].found, 1u);
    }
}

TEST(FoundFiles, TransformsUnderOtherNames) {
    const Place places[] = {{"", "images/a.jpg", "images/a.png"},
                            {"", "a", "images/a.png"},
                            {"", "/data/scene/images/a.png", "images/a.png"},
                            {"", "D:\\scene\\a.JPG", "images/a.png"},
                            {"", "../scene/images/a.png", "images/a.png"},
                            {"", "train/a", "train/a.jpg"}};
    for (const auto& [unused, named, file] : places) {
        SCOPED_TRACE(std::string(named) + " is " + file);
        test::TransformsScene scene;
        fs::remove_all(scene.folder / "images");
        save(scene.folder / file);
        scene.model["frames"] = {test::transforms_frame(named)};
        const Dataset dataset = scene.load();
        EXPECT_EQ(image_names(dataset), std::vector<std::string>{file});
        EXPECT_EQ(used_text(dataset), "1 of 1 photo");
    }
}

TEST(FoundFiles, TransformsFilesOfOtherNames) {
    for (const char* name : {"Transforms.json", "transforms_undistorted.json", "transforms_val.json",
                             "TRANSFORMS_TRAIN.JSON", "nerf/transforms.json", "a/b/transforms_x.json"}) {
        SCOPED_TRACE(name);
        const test::TransformsScene scene;
        scene.folder.write("transforms_notes.json", "{}");
        fs::create_directories((scene.folder / name).parent_path());
        scene.write(name);
        EXPECT_TRUE(io::is_dataset_folder(scene.folder.path()));
        const Dataset dataset = load_dataset(scene.folder.path(), {});
        EXPECT_EQ(dataset.frames.size(), 2u);
        if (core::lower(name) == "transforms.json" && fs::exists(scene.folder / "transforms.json")) {
            EXPECT_TRUE(dataset.notes.empty()) << "a system on which both names are those of one file";
        } else if (core::lower(name) != "transforms_train.json") {
            ASSERT_EQ(dataset.notes.size(), 1u);
            EXPECT_EQ(dataset.notes[0], std::string("the cameras are in ") + name);
        }
    }
    test::TransformsScene scene;
    scene.model["frames"] = {test::transforms_frame("../images/a.png")};
    fs::create_directories(scene.folder / "nerf");
    scene.write("nerf/transforms.json");
    EXPECT_EQ(load_dataset(scene.folder.path(), {}).frames.size(), 1u);
    const Dataset named = load_dataset(scene.folder / "nerf", {});
    EXPECT_EQ(named.notes, std::vector<std::string>{"photos are outside the dataset, in " +
                                                    (scene.folder / "images").string()});
}

TEST(FoundFiles, CamerasOfTwoProgramsAreNoted) {
    const test::TransformsScene scene;
    scene.write();
    scene.write("transforms_train.json");
    scene.folder.write("colmap/sparse/0/cameras.txt", kCameras);
    scene.folder.write("colmap/sparse/0/images.txt", lines_of({"a.png"}));
    using Notes = std::vector<std::string>;
    const std::string instead = " has cameras, too: name it to use it in place of ";
    EXPECT_EQ(load_dataset(scene.folder.path(), {}).notes,
              (Notes{"transforms_train.json" + instead + "transforms.json",
                     "colmap/sparse/0" + instead + "transforms.json"}));
    scene.folder.write("sparse/0/cameras.txt", kCameras);
    scene.folder.write("sparse/0/images.txt", lines_of({"a.png"}));
    EXPECT_EQ(load_dataset(scene.folder.path(), {}).notes, Notes{"transforms.json" + instead + "sparse/0"});
}

TEST(FoundFiles, PointsBesideTheCameras) {
    const PointCloud cloud{{{7, 8, 9}}, {{1, 2, 3}}};
    for (const char* place : {"sparse/points3D.ply", "sparse_pc.ply", "input.ply", "sparse/0/points.ply",
                              "dense/fused.ply", "init.ply", "Cloud.PLY"}) {
        SCOPED_TRACE(place);
        const Colmap data;
        data.model("sparse/0", {"0.png"});
        fs::remove(data.folder / "sparse/0/points3D.txt");
        data.photos({"images/0.png"});
        fs::create_directories((data.folder / place).parent_path());
        io::write_points_ply(data.folder / place, cloud);
        EXPECT_EQ(data.load().points.positions, cloud.positions);
        test::TransformsScene scene;
        scene.write();
        fs::create_directories((scene.folder / place).parent_path());
        io::write_points_ply(scene.folder / place, cloud);
        const bool beside = fs::path(place).parent_path().empty() || fs::path(place).parent_path() == "dense";
        EXPECT_EQ(scene.load().points.positions.size(), beside ? 1u : 0u);
    }
    test::TransformsScene scene;
    scene.model["ply_file_path"] = "Cloud.ply";
    io::write_points_ply(scene.folder / "cloud.PLY", cloud);
    EXPECT_EQ(scene.load().points.positions, cloud.positions);
    // Neither splats nor a mesh.
    const std::string head =
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
    for (const std::string rest :
         {"property float scale_0\nend_header\n1 2 3 4\n",
          "element tristrips 1\nproperty list int int vertex_indices\nend_header\n1 2 3\n0\n"})
        EXPECT_FALSE(io::is_point_cloud(scene.folder.write("other.ply", head + rest)));
}

TEST(FoundFiles, Utf16IsNamed) {
    const auto wide = [](const std::string& text) {
        std::string out = "\xff\xfe";
        for (const char c : text) (out += c) += '\0';
        return out;
    };
    const Colmap data;
    data.model("sparse/0", {"0.png"});
    data.photos({"images/0.png"});
    data.folder.write("sparse/0/images.txt", wide(lines_of({"0.png"})));
    expect_error<InputError>([&] { data.load(); }, {"images.txt: is UTF-16; save it as UTF-8"});
    const test::TransformsScene scene;
    scene.folder.write("transforms_a.json", wide(scene.model.dump()));
    expect_error<InputError>([&] { load_dataset(scene.folder.path(), {}); },
                             {"transforms_a.json: is UTF-16; save it as UTF-8"});
    const TempFolder table;
    save(table / "0.png");
    table.write("a.csv", wide("#name,x,y,alt,heading,pitch,roll,f\n0.png,1,2,3,0,0,0,36\n"));
    expect_error<InputError>([&] { load_dataset(table.path(), {}); }, {"a.csv: is UTF-16"});
}

TEST(FoundFiles, IntrinsicsAsFractions) {
    test::TransformsScene scene;
    for (const char* name : {"a.png", "b.png"}) save(scene.folder / "images" / name, Image(64, 48, 3));
    scene.model.update({{"w", 64}, {"h", 48}, {"fl_x", 0.9}, {"fl_y", 0.9}, {"cx", 0.5}, {"cy", 0.5}});
    scene.refuse({"focal length of 0.9 px looks like a fraction of the width"});
    scene.model.update({{"fl_x", 60}, {"fl_y", 60}, {"cx", 0}, {"cy", 0}, {"camera_model", "pinhole"}});
    ASSERT_EQ(scene.load().notes.size(), 1u);
    EXPECT_NE(scene.load().notes[0].find("is the corner of the image"), std::string::npos);
}

/// Who removes a photo does not want another one of its name.
TEST(FoundFiles, RemovedPhotosAreNotReplaced) {
    const Colmap data;
    data.model("sparse/0", {"0.png", "1.png"});
    data.photos({"images/1.png", "images/rejected/0.png", "input/0.png", "0.png"});
    EXPECT_EQ(image_names(data.load()), std::vector<std::string>{"1.png"});
    EXPECT_EQ(data.load().missing_images, 1);
    EXPECT_EQ(data.used(),
              "1 of 3 photos (images/0.png is missing; images/rejected/0.png has no camera), 2 points");
    test::TransformsScene blender;
    for (const char* file : {"train/1.png", "test/0.png", "val/0.png"}) save(blender.folder / file);
    blender.model["frames"] = {test::transforms_frame("./train/0"), test::transforms_frame("./train/1")};
    EXPECT_EQ(image_names(blender.load()), std::vector<std::string>{"train/1.png"});
}

/// Nor one that is another record's.
TEST(FoundFiles, AnImageIsNotTakenForAnotherOfItsStem) {
    const Colmap data;
    data.model("sparse/0", {"0.png", "0.jpg", "1.png", "1"});
    data.photos({"images/0.png", "images/1.png"});
    EXPECT_EQ(image_names(data.load()), (std::vector<std::string>{"0.png", "1.png"}));
    EXPECT_EQ(data.load().missing_images, 2);
    data.model("sparse/0", {"/gone/a/0.png", "/gone/a/0.jpg"});
    EXPECT_EQ(image_names(data.load()), std::vector<std::string>{"0.png"});
    data.photos({"images/0.jpg"});
    EXPECT_EQ(image_names(data.load()), (std::vector<std::string>{"0.jpg", "0.png"}));
    test::TransformsScene scene;
    fs::remove_all(scene.folder / "images");
    save(scene.folder / "images/0.png");
    scene.model["frames"] = {test::transforms_frame("images/0.png"), test::transforms_frame("images/0.JPG")};
    EXPECT_EQ(image_names(scene.load()), std::vector<std::string>{"images/0.png"});
}

/// Photos beside a folder of any name may be those of something else.
TEST(FoundFiles, PhotosOutsideOfTheDataset) {
    for (const char* model : {"scene", "scene/deeper", "x/sparse_0/scene"}) {
        SCOPED_TRACE(model);
        const Colmap data;
        data.model(model, {"0.png"});
        data.photos({"images/0.png", "scene.png"});
        expect_error<InputError>([&] { load_dataset(data.folder / model, {}); },
                                 {"none of the 1 images exists", "images/0.png"});
    }
    for (const char* model : {"sparse", "0", "distorted/sparse", "colmap_text", "dense/0"}) {
        SCOPED_TRACE(model);
        const Colmap data;
        data.model(model, {"0.png"});
        data.photos({"images/0.png"});
        const Dataset dataset = load_dataset(data.folder / model, {});
        EXPECT_EQ(dataset.frames.size(), 1u);
        ASSERT_EQ(dataset.notes.size(), 1u);
        EXPECT_EQ(dataset.notes[0],
                  "photos are outside the dataset, in " + (data.folder / "images").string());
    }
    // ewa has made this folder, whatever its name is.
    const Colmap made;
    made.model("sparse", {"0.png"});
    made.folder.write("sparse/capture.json", "{}");
    made.photos({"images/0.png"});
    EXPECT_THROW(load_dataset(made.folder / "sparse", {}), InputError);
}

TEST(FoundFiles, ModelsOfOtherPlaces) {
    for (const char* place : {"colmap_text", "colmap/sparse_txt", "colmap/text", "colmap/dense/0/sparse",
                              "colmap/dense/sparse", "sparse/geo", "sparse/0_aligned", "sparse_undistorted/0",
                              "sparse_pc", "dslr_calibration_undistorted", "model/0", "output/sparse/0",
                              "export", "exports/colmap", "Hloc/sparse", "a/b/c"}) {
        SCOPED_TRACE(place);
        const Colmap data;
        data.model(place, {"0.png"});
        data.photos({"images/0.png"});
        EXPECT_TRUE(io::is_dataset_folder(data.folder.path()));
        EXPECT_FALSE(io::is_dataset_folder(data.folder.path(), false));
        EXPECT_EQ(data.used(), "1 of 1 photo, 2 points");
        EXPECT_EQ(data.load().notes, std::vector<std::string>{std::string("the cameras are in ") + place});
        // What ewa has made is complete, and what is deeper is something else.
        data.folder.write("capture.json", "{}");
        EXPECT_FALSE(io::is_dataset_folder(data.folder.path()));
    }
    const Colmap both;
    both.photos({"images/0.png", "images/1.png"});
    both.model("colmap_text", {"0.png"});
    both.model("output/sparse/0", {"0.png", "1.png"});
    EXPECT_EQ(
        both.used(),
        "2 of 2 photos, 2 points, 1 of 2 models (output/sparse/0 with 2 images as text, not colmap_text "
        "with 1 image as text)");
    // Images of the workspace's own are the undistorted ones.
    both.photos({"output/images/0.png", "output/images/1.png"});
    EXPECT_EQ(both.used().substr(0, 30), "2 of 2 photos in output/images");
    // Several datasets in a folder are several.
    const Colmap scenes;
    for (const std::string scene : {"a", "b"}) {
        scenes.model(scene + "/sparse/0", {"0.png"});
        scenes.photos({scene + "/images/0.png"});
    }
    EXPECT_FALSE(io::is_dataset_folder(scenes.folder.path()));
    for (const char* place : {"masks/sparse", "a/b/c/d/e", ".trash/sparse"}) {
        SCOPED_TRACE(place);
        const Colmap data;
        data.model(place, {"0.png"});
        EXPECT_FALSE(io::is_dataset_folder(data.folder.path()));
    }
}

TEST(FoundFiles, ImagesThatCannotBeTold) {
    const Colmap data;
    data.model("sparse/0", {"/gone/0.png"});
    data.photos({"images/a/0.png", "images/b/0.png"});
    expect_error<InputError>(
        [&] { data.load(); },
        {"images.txt: the image \"/gone/0.png\" is one of 2 images", "a/0.png and b/0.png"});
    data.model("sparse/0", {"/gone/b/0.png"});
    EXPECT_EQ(image_names(data.load()), std::vector<std::string>{"b/0.png"});
}

TEST(FoundFiles, AWorkspaceHasTheImagesThatTheModelLacks) {
    const Colmap data;
    data.model("sparse/0", {"0.png", "1.png"});
    data.model("dense/0/sparse", {"0.png"});
    data.photos({"dense/0/images/0.png"});
    EXPECT_EQ(data.load().frames.size(), 1u);
    EXPECT_EQ(data.used(), "1 of 1 photo in dense/0/images, 2 points");
    save(data.folder / "masks/0.png", half());
    EXPECT_EQ(data.used(),
              "1 of 1 photo in dense/0/images, 0 of 1 mask (masks/ is not beside the photos), 2 points");
    data.photos({"images/0.png", "images/1.png"});
    EXPECT_EQ(data.load().frames.size(), 2u);
}

TEST(FoundFiles, PhotosThatAreOnlyThereAsSmallerCopies) {
    const Colmap data;
    data.model("sparse/0", {"0.png"});
    save(data.folder / "images_4/0.png", Image(2, 1, 3));
    expect_error<InputError>([&] { data.load(); }, {"none of the 1 images exists", "--downscale 4 takes it"});
}

TEST(FoundFiles, PointsInOtherForms) {
    const Colmap data;
    data.model("sparse/0", {"0.png"});
    data.photos({"images/0.png"});
    const auto read = [&](const std::string& text) {
        data.folder.write("sparse/0/points3D.txt", text);
        return data.load().points;
    };
    using Colors = std::vector<std::array<uint8_t, 3>>;
    EXPECT_EQ(read("1 1 2 3 150.0 20.4 255\n").colors, (Colors{{150, 20, 255}}));
    EXPECT_EQ(read("1 1 2 3 0.5 0 1.0\n2 1 2 3 1 1 1\n").colors, (Colors{{128, 0, 255}, {255, 255, 255}}));
    EXPECT_EQ(read("1 1 2 3 1 0 1\n").colors, (Colors{{1, 0, 1}}));
    EXPECT_EQ(read("1 1 2 3\n").colors, (Colors{{128, 128, 128}}));
    EXPECT_EQ(read("1 1 2 3 4 5 6 nan\n").positions.size(), 1u);
    for (const char* colors : {"-1 0 0", "0 0 256", "nan 0 0", "1 2"})
        expect_error<InputError>([&] { read(std::string("1 1 2 3 ") + colors + "\n"); },
                                 {"points3D.txt:1:", "colour"});
    read("1 1 2 3 4 5 6 0\n2 nan 0 0 4 5 6 0\n");
    const std::string file = test::with_slashes((data.folder / "sparse/0/points3D.txt").string());
    EXPECT_NE(test::with_slashes(data.used()).find("1 of 2 points (" + file + ":2 is not finite)"),
              std::string::npos)
        << data.used();
    // Binary points beside text cameras, and a PLY in place of both.
    fs::remove(data.folder / "sparse/0/points3D.txt");
    const io::ImageRecords records = io::read_colmap({data.folder / "sparse/0", {}, {}, ".txt"});
    const PointCloud cloud{{{7, 8, 9}}, {{1, 2, 3}}};
    io::write_colmap(data.folder / "other", records.images, cloud);
    fs::rename(data.folder / "other/points3D.bin", data.folder / "sparse/0/points3D.bin");
    EXPECT_EQ(data.load().points.positions, cloud.positions);
    fs::remove(data.folder / "sparse/0/points3D.bin");
    io::write_points_ply(data.folder / "sparse/0/points3D.ply", cloud);
    const Dataset dataset = data.load();
    EXPECT_EQ(dataset.points.colors, cloud.colors);
    EXPECT_NE(std::ranges::find(dataset.files, data.folder / "sparse/0/points3D.ply"), dataset.files.end());
}

TEST(FoundFiles, ByteOrderMarks) {
    const std::string mark = "\xef\xbb\xbf";
    const Colmap data;
    data.folder.write("sparse/0/cameras.txt", mark + kCameras);
    data.folder.write("sparse/0/images.txt", mark + lines_of({"0.png"}).substr(9));
    data.folder.write("sparse/0/points3D.txt", mark + kPoints);
    data.photos({"images/0.png"});
    EXPECT_EQ(data.used(), "1 of 1 photo, 2 points");
}

struct MaskCase {
    std::vector<const char*> files;
    const char *used, *mask;  // the mask of a.jpg, relative
};

TEST(FoundFiles, MasksUnderOtherNames) {
    const MaskCase cases[] = {
        {{"masks/a.png", "masks/b.png"}, "2 of 2 masks", "masks/a.png"},
        {{"masks/a.jpg.png", "masks/b.jpg.png"}, "2 of 2 masks", "masks/a.jpg.png"},
        {{"masks/a.jpg.png", "masks/a.png", "masks/b.png"},
         "2 of 3 masks (masks/a.png matches no photo)",
         "masks/a.jpg.png"},
        {{"masks/a_mask.png", "masks/b_mask.png"}, "2 of 2 masks", "masks/a_mask.png"},
        {{"masks/a.jpg_mask.png", "masks/b.jpg_mask.png"}, "2 of 2 masks", "masks/a.jpg_mask.png"},
        {{"masks/a_mask.jpg.png", "masks/mask_b.png"}, "2 of 2 masks", "masks/a_mask.jpg.png"},
        {{"masks/A.PNG", "masks/b.jpg"}, "2 of 2 masks", "masks/A.PNG"},
        {{"Mask/a.png", "Mask/b.png"}, "2 of 2 masks", "Mask/a.png"},
        {{"images/masks/a.png", "images/masks/b.png"}, "2 of 2 masks", "images/masks/a.png"},
        {{"masks_2/a.png", "masks_2/b.png"}, "2 of 2 masks", "masks_2/a.png"},
        {{"images/a.jpg.mask.png", "images/b_mask.png"}, "2 of 2 masks", "images/a.jpg.mask.png"},
        {{"masks/sub/a.png", "masks/sub/b.png"}, "2 of 2 masks", "masks/sub/a.png"},
        {{"masks/mask.png"}, "1 of 1 mask (for all photos)", "masks/mask.png"},
        {{"masks/rig.png"}, "1 of 1 mask (for all photos)", "masks/rig.png"},
        {{"mask.png"}, "1 of 1 mask (for all photos)", "mask.png"},
        {{"masks/a.png"}, "1 of 1 mask (1 photo has none: b.jpg)", "masks/a.png"},
        {{"masks/1.png", "masks/2.png"}, "0 of 2 masks (masks/1.png matches no photo)", ""},
        {{"masks/x/a.png", "masks/y/a.png"},
         "0 of 2 masks (masks/x/a.png and masks/y/a.png have one name, and neither folder is that of a "
         "photo)",
         ""},
        {{"masks/a.webp.png", "masks/b.HEIC.png"}, "2 of 2 masks", "masks/a.webp.png"},
        {{"segmentation/a.png", "segmentation/b.png"}, "2 of 2 masks", "segmentation/a.png"},
        {{"images/mattes/a.png"}, "1 of 1 mask (1 photo has none: b.jpg)", "images/mattes/a.png"},
        {{"Alpha/a.png", "Alpha/b.png"}, "2 of 2 masks", "Alpha/a.png"},
        {{"labels/a.png", "labels/b.png"}, "0 of 2 masks (labels/ is none of masks/ and mask/)", ""},
        {{"images/a_alpha.png", "images/b_seg.png"}, "2 of 2 masks", "images/a_alpha.png"},
        {{"images/mask_a.png", "images/mask_b.png"}, "2 of 2 masks", "images/mask_a.png"},
        {{"images/mask.png"}, "1 of 1 mask (for all photos)", "images/mask.png"},
        {{"static_mask.png"}, "1 of 1 mask (for all photos)", "static_mask.png"},
        {{"poster_mask.png"}, "0 of 1 mask (poster_mask.png matches no photo)", ""},
        {{"sam_masks/a.png", "sam_masks/b.png"}, "0 of 2 masks (sam_masks/ is none of masks/ and mask/)", ""},
        {{"masks/c.png"}, "0 of 1 mask (masks/c.png matches no photo)", ""}};
    for (const auto& [files, used, mask] : cases) {
        SCOPED_TRACE(std::string(files[0]) + ": " + used);
        const Colmap data;
        data.model("sparse/0", {"a.jpg", "b.jpg"});
        data.photos({"images/a.jpg", "images/b.jpg"});
        const bool other = std::string(files[0]) == "masks/c.png";
        if (other) data.photos({"images/c.jpg"});
        for (const char* file : files) save(data.folder / file, half());
        const Dataset dataset = data.load();
        EXPECT_EQ(used_text(dataset),
                  std::string(other ? "2 of 3 photos (images/c.jpg has no camera), " : "2 of 2 photos, ") +
                      used + ", 2 points");
        ASSERT_EQ(dataset.frames.size(), 2u);
        EXPECT_EQ(platform::folded(dataset.frames[0].mask_path),
                  platform::folded(*mask ? data.folder / mask : fs::path()));
        EXPECT_EQ(dataset.frames[0].masks,
                  std::string(used).starts_with("0") ? MaskUse::cut : MaskUse::ignore);
        EXPECT_TRUE(!*mask || load_frame_image(dataset.frames[0]).at(0, 0)[3] == 1.0f);
    }
}

TEST(FoundFiles, MasksOfFolders) {
    const Colmap data;
    data.model("sparse/0", {"l/0.png", "l/1.png", "r/0.png"});
    data.photos({"images/l/0.png", "images/l/1.png", "images/r/0.png"});
    // A name that two photos have is of none of them, and one mask may be that of a camera.
    save(data.folder / "masks/0.png", half());
    save(data.folder / "masks/1.png", half());
    EXPECT_EQ(data.used(), "3 of 3 photos, 1 of 2 masks (masks/0.png matches no photo), 2 points");
    fs::remove_all(data.folder / "masks");
    save(data.folder / "masks/l.png", half());
    save(data.folder / "masks/r.png", half());
    EXPECT_EQ(data.used(), "3 of 3 photos, 2 of 2 masks, 2 points");
    EXPECT_EQ(data.load().frames[1].mask_path, data.folder / "masks/l.png");
    save(data.folder / "masks/l/1.png", half());
    EXPECT_EQ(data.load().frames[1].mask_path, data.folder / "masks/l/1.png");
    // --downscale prefers copies of its size.
    save(data.folder / "masks_2/l/1.png", half());
    EXPECT_EQ(data.load({.downscale = 2}).frames[1].mask_path, data.folder / "masks_2/l/1.png");
    EXPECT_EQ(used_text(data.load({.masks = MaskUse::none})),
              "3 of 3 photos, 0 of 3 masks (--masks none), 2 points");
}

TEST(FoundFiles, MasksOfOtherContents) {
    const Colmap data;
    data.model("sparse/0", {"c0/images/a.jpg", "c1/images/a.jpg"});
    data.photos({"images/c0/images/a.jpg", "images/c1/images/a.jpg"});
    // Of one camera, beside its photos.
    save(data.folder / "images/c1/masks/a.png", half());
    EXPECT_EQ(data.used(), "2 of 2 photos, 1 of 1 mask (1 photo has none: c0/images/a.jpg), 2 points");
    EXPECT_EQ(data.load().frames[1].mask_path, data.folder / "images/c1/masks/a.png");
    fs::remove_all(data.folder / "images/c1/masks");
    data.folder.write("masks/c0/a.gif", "GIF89a");
    EXPECT_EQ(data.used(),
              "2 of 2 photos, 0 of 1 mask (masks/c0/a.gif is of a format that ewa does not read), 2 points");
    fs::remove_all(data.folder / "masks");
    Image colours(8, 6, 3);
    for (size_t i = 0; i < colours.pixels.size(); i += 2) colours.pixels[i] = float(i % 5) / 4;
    save(data.folder / "segmentation/c0/a.png", colours);
    EXPECT_EQ(data.used(),
              "2 of 2 photos, 0 of 1 mask (segmentation/c0/a.png seems to be no mask), 2 points");
    // Servers and desktops leave pictures, too.
    for (const char* file : {"images/@eaDir/a.jpg", "images/__MACOSX/a.jpg", "images/.thumbnails/a.jpg"})
        data.photos({file});
    EXPECT_TRUE(data.used().starts_with("2 of 2 photos,")) << data.used();
}

TEST(FoundFiles, MasksThatTheCamerasFileNames) {
    test::TransformsScene scene;
    scene.model["frames"][0]["mask_path"] = "/other/machine/m0.png";
    scene.model["frames"][1]["mask_path"] = "masks/m1.png";
    save(scene.folder / "masks/m0.png", half());
    EXPECT_EQ(used_text(scene.load()), "2 of 2 photos, 1 of 2 masks (masks/m1.png is missing)");
    save(scene.folder / "masks/m1.png", half());
    EXPECT_EQ(used_text(scene.load()), "2 of 2 photos, 2 of 2 masks");
    EXPECT_EQ(scene.load().frames[1].mask_path, scene.folder / "masks/m0.png");
}

TEST(FoundFiles, DepthMaps) {
    const Colmap data;
    data.model("sparse/0", {"a.jpg"});
    data.photos({"images/a.jpg"});
    const std::string sixteen =
        test::png_bytes(1, 1, std::string("\x10\0\0\0\0", 5), "", std::string("\0\0\1", 3));
    const auto used = [&](const std::string& file, const std::string& bytes) {
        fs::remove_all(data.folder / "depth");
        fs::remove_all(data.folder / "Depths");
        data.folder.write(file, bytes);
        return data.used();
    };
    for (const char* file :
         {"depth/a.png", "depth/a.jpg.png", "Depths/A.PNG", "depth/a_depth.png", "depth/a.exr"})
        EXPECT_EQ(used(file, sixteen), "1 of 1 photo, 1 of 1 depth map, 2 points") << file;
    EXPECT_EQ(used("depth/a.npy", "x"),
              "1 of 1 photo, 0 of 1 depth map (depth/a.npy is no .exr or .png of 16 bits), 2 points");
    EXPECT_EQ(used("depth/b.png", sixteen),
              "1 of 1 photo, 0 of 1 depth map (depth/b.png matches no photo), 2 points");
    fs::remove(data.folder / "depth/b.png");
    for (const char* name : {"a_depth.png", "a.png"}) {  // pictures to look at
        fs::remove_all(data.folder / "depth");
        save(data.folder / "depth" / name);
        EXPECT_EQ(data.used(), std::string("1 of 1 photo, 0 of 1 depth map (depth/") + name +
                                   " is no .exr or .png of 16 bits), 2 points");
    }
}

}  // namespace
