// SPDX-License-Identifier: Apache-2.0
// A small dataset with a transforms.json.
#pragma once
#include <gtest/gtest.h>

#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>

#include "ewa/dataset.h"
#include "ewa/error.h"
#include "ewa/image.h"
#include "support/temp_folder.h"

namespace ewa::test {

// A camera at (1, 2, 3) that looks along world -x with world z up: its x axis is +y, its y axis +z, its z
// axis +x.
inline const nlohmann::json kTransformsPose = {{0, 0, 1, 1}, {1, 0, 0, 2}, {0, 1, 0, 3}, {0, 0, 0, 1}};

inline nlohmann::json transforms_frame(const std::string& path) {
    return {{"file_path", path}, {"transform_matrix", kTransformsPose}};
}

/// Two pictures of 8 x 6 and a transforms.json.
struct TransformsScene {
    TempFolder folder;
    nlohmann::json model = {
        {"fl_x", 10},
        {"fl_y", 11},
        {"cx", 4.5},
        {"cy", 2.5},
        {"w", 8},
        {"h", 6.0},
        {"aabb_scale", 4},
        {"frames", {transforms_frame("./images/b.png"), transforms_frame("images\\a.png")}}};

    TransformsScene() {
        std::filesystem::create_directories(folder / "images");
        for (const char* name : {"a.png", "b.png"}) save_image(folder / "images" / name, Image(8, 6, 3));
    }
    std::filesystem::path write(const char* name = "transforms.json") const {
        return folder.write(name, model.dump());
    }
    Dataset load(bool need_files = true) const {
        write();
        DatasetOptions options;
        options.need_images = options.need_points = need_files;
        return load_dataset(folder.path(), options);
    }
    void refuse(std::initializer_list<std::string> parts) const {
        expect_error<InputError>([&] { load(); }, parts);
    }
};

}  // namespace ewa::test
