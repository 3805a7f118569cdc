// SPDX-License-Identifier: Apache-2.0
// bundle.out of Bundler and poses_bounds.npy of LLFF.
#include <cstring>
#include <sstream>

#include "support/import_scene.h"

namespace {

using namespace ewa;
using namespace ewa::test;

constexpr double kBundleFocal = 43.5, kK1 = -0.07, kK2 = 0.02;

/// The model of Bundler's manual, in axes x right, y up, z back: p = -P / P.z, p' = f r(p) p about the middle.
glm::dvec2 of_bundler(const glm::dvec3& seen) {
    const glm::dvec3 p(seen.x, -seen.y, -seen.z);
    const glm::dvec2 plane = -glm::dvec2(p) / p.z;
    const double r2 = glm::dot(plane, plane);
    const glm::dvec2 pixel = kBundleFocal * (1 + kK1 * r2 + kK2 * r2 * r2) * plane;
    return {0.5 * kSceneWidth + pixel.x, 0.5 * kSceneHeight - pixel.y};
}

/// With a camera that has no pose, before the last one.
std::string bundle_text() {
    std::ostringstream out;
    out.precision(17);
    out << "# Bundle file v0.3\n4 2\n";
    int number = 0;
    for (const SceneView& view : scene_views()) {
        if (++number == 3) out << "0 0 0\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n";
        out << kBundleFocal << " " << kK1 << " " << kK2 << "\n";
        for (int row = 0; row < 3; ++row)
            for (int c = 0; c < 3; ++c)
                out << (row == 0 ? 1 : -1) * view.rotation[c][row] << (c == 2 ? "\n" : " ");
        const glm::dvec3 t = view.translation();
        out << t.x << " " << -t.y << " " << -t.z << "\n";
    }
    out << "0.1 0.2 0.3\n255 7 0\n2 0 12 1.5 2.5 3 13 -4 5\n1 2 3\n1 2 3\n1 1 0 0 0\n";
    return out.str();
}

std::string bundle_list() {
    const auto views = scene_views();
    return "./images/" + views[0].name + "\n" + views[1].name + " 0 660.5\ngone.png\n" + views[2].name + "\n";
}

TEST(ImportBundler, PutsPointsWhereTheyAre) {
    const std::pair<const char*, const char*> places[] = {
        {"bundle.out", "list.txt"}, {"bundle/bundle.out", "list.txt"}, {"a.bundle.out", "a.list.txt"}};
    for (const auto& [file, names] : places) {
        SCOPED_TRACE(file);
        const TempFolder folder;
        write_scene_images(folder);
        std::filesystem::create_directories((folder / file).parent_path());
        folder.write(file, bundle_text());
        folder.write(names, bundle_list());
        for (const std::filesystem::path& path : {folder.path(), folder / file}) {
            const Dataset dataset = load_dataset(path, {});
            EXPECT_EQ(dataset.format, "Bundler");
            expect_scene(dataset, of_bundler);
            EXPECT_EQ(dataset.points.positions, (std::vector<glm::dvec3>{{0.1, 0.2, 0.3}, {1, 2, 3}}));
            EXPECT_EQ(dataset.points.colors[0], (std::array<uint8_t, 3>{255, 7, 0}));
            EXPECT_EQ(dataset.notes, std::vector<std::string>{"1 image without a pose is skipped"});
            // Sorted by name: a2, b 1, c. Cameras 0, 1 and 3 of the file are b 1, a2 and c.
            ASSERT_TRUE(dataset.frames[0].seen && dataset.frames[1].seen && dataset.frames[2].seen);
            EXPECT_EQ(*dataset.frames[0].seen, std::vector<uint32_t>{1});
            EXPECT_EQ(*dataset.frames[1].seen, std::vector<uint32_t>{0});
            EXPECT_EQ(*dataset.frames[2].seen, std::vector<uint32_t>{0});
        }
    }
}

TEST(ImportBundler, WithoutAListImagesAreInOrder) {
    const TempFolder folder;
    write_scene_images(folder);
    folder.write("bundle.out", bundle_text());
    expect_error<InputError>([&] { load_dataset(folder.path(), {}); },
                             {"bundle.out: list.txt, which names its 4 images, is not beside it"});
    save_image(folder / "images" / "b 2.png", Image(kSceneWidth, kSceneHeight, 3));
    EXPECT_EQ(load_dataset(folder.path(), {}).frames.size(), 3u);
    folder.write("list.txt", "a2.png\n");
    expect_error<InputError>([&] { load_dataset(folder.path(), {}); },
                             {"list.txt: names 1 image, and bundle.out has 4 cameras"});
}

TEST(ImportBundler, MalformedFilesAreOneLine) {
    const std::vector<std::array<std::string, 3>> cases{
        {"\n4 2\n", "\n-4 2\n", ":2: the number of cameras is not a whole number"},
        {"\n4 2\n", "\n4 x\n", ":2: the number of points: \"x\" is not a finite number"},
        {"43.5 ", "nan ", ":3: a focal length and two terms of distortion: \"nan\""},
        {"43.5 ", "-43.5 ", "a focal length is not positive"},
        {"\n4 2\n", "\n4 3\n", "ends before a position"},
        {"\n4 2\n", "\n4000000000 2\n", "number of cameras is not a whole number"},
        {"\n2 0 12", "\n2000000 0 12", "number of views is not a whole number"},
        {"\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n", "\n9 0 0\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n",
         "it mirrors or is degenerate"}};
    for (const auto& [from, to, part] : cases) {
        const TempFolder folder;
        write_scene_images(folder);
        std::string text = bundle_text();
        const size_t at = text.find(from);
        ASSERT_NE(at, std::string::npos) << from;
        folder.write("bundle.out", text.replace(at, from.size(), to));
        folder.write("list.txt", bundle_list());
        expect_error<InputError>([&] { load_dataset(folder.path(), {}); }, {"bundle.out", part});
    }
}

/// A NumPy array of the scene's views in the order of their names. Axes are x down, y right, z back.
template <class Number>
std::string poses_bounds(bool by_columns = false,
                         const std::string& type = sizeof(Number) == 8 ? "<f8" : "<f4") {
    auto views = scene_views();
    std::swap(views[0], views[1]);  // a2, b 1, c
    std::vector<std::vector<double>> rows;
    for (const SceneView& view : views) {
        const glm::dmat3 axes = glm::transpose(view.rotation);  // right, down, forward
        const double hwf[] = {kSceneHeight, kSceneWidth, kBundleFocal};
        std::vector<double> row;
        for (int r = 0; r < 3; ++r)
            row.insert(row.end(), {axes[1][r], axes[0][r], -axes[2][r], view.center[r], hwf[r]});
        row.insert(row.end(), {0.5, 9.0});
        rows.push_back(row);
    }
    std::string header = "{'descr': '" + type + "', 'fortran_order': " + (by_columns ? "True" : "False") +
                         ", 'shape': (" + std::to_string(rows.size()) + ", 17), }";
    header.resize(117, ' ');
    header += '\n';
    std::string text("\x93NUMPY\x01\x00\x76\x00", 10);
    text += header;
    for (size_t i = 0; i < 17 * rows.size(); ++i) {
        const auto value = Number(by_columns ? rows[i % rows.size()][i / rows.size()] : rows[i / 17][i % 17]);
        text.append(reinterpret_cast<const char*>(&value), sizeof(value));
    }
    return text;
}

glm::dvec2 of_llff(const glm::dvec3& p) {
    return kBundleFocal * tangents(p) + glm::dvec2(0.5 * kSceneWidth, 0.5 * kSceneHeight);
}

TEST(ImportLlff, PutsPointsWhereTheyAre) {
    const TempFolder folder;
    write_scene_images(folder);
    for (const bool by_columns : {false, true}) {
        folder.write("poses_bounds.npy", poses_bounds<double>(by_columns));
        const Dataset dataset = load_dataset(folder.path(), {});
        EXPECT_EQ(dataset.format, "LLFF poses_bounds.npy");
        expect_scene(dataset, of_llff);
    }
    folder.write("poses_bounds.npy", poses_bounds<float>());
    expect_scene(load_dataset(folder / "poses_bounds.npy", {}), of_llff, 1e-4);
}

TEST(ImportLlff, MalformedFilesAreOneLine) {
    const TempFolder folder;
    write_scene_images(folder);
    const auto refuse = [&](const std::string& text, const std::string& part) {
        folder.write("poses_bounds.npy", text);
        expect_error<InputError>([&] { load_dataset(folder.path(), {}); }, {"poses_bounds.npy", part});
    };
    const std::string good = poses_bounds<double>();
    const auto changed = [&](const std::string& from, const std::string& to) {
        std::string text = good;
        return text.replace(text.find(from), from.size(), to);
    };
    refuse(good.substr(0, good.size() - 1), "the numbers");
    refuse(changed("17)", "15)"), "is not a NumPy array of 17 floats for each image");
    refuse(changed("<f8", ">f8"), "is not a NumPy array of 17 floats for each image");
    refuse(changed("(3,", "(99999999999,"), "has more than 100000 images");
    refuse(changed("(3,", "(0,"), "has 0 poses");
    std::string text = good;
    const double bad = 2.5;
    std::memcpy(text.data() + 128 + 4 * 8, &bad, 8);
    refuse(text, "image 0: the size of the image is not a whole number of pixels");
    std::memcpy(text.data() + 128, &bad, 8);
    std::memcpy(text.data() + 128 + 4 * 8, good.data() + 128 + 4 * 8, 8);
    refuse(text, "image 0: the pose is not a rotation");
    save_image(folder / "images" / "z.png", Image(kSceneWidth, kSceneHeight, 3));
    refuse(good, "has 3 poses, and");
}

}  // namespace
