// SPDX-License-Identifier: Apache-2.0
// The raw data of Polycam: keyframes/ with a JSON file for each image, in corrected_cameras/ (after the optimisation of the session,
// for corrected_images/) or in cameras/ (as the phone tracked them, for images/).
//
// fx fy cx cy width height (px); t_00 to t_23: three rows of four, from the camera (x right, y up, z back) to the world with y up.
#include <array>
#include <nlohmann/json.hpp>

#include "core/folders.h"
#include "core/json_field.h"
#include "core/text.h"
#include "ewa/error.h"
#include "io/datasets/importers/image_finder.h"
#include "io/datasets/importers/importer.h"
#include "io/datasets/rotation.h"

namespace ewa::io {

namespace {

namespace fs = std::filesystem;

constexpr uint64_t kMostCameraBytes = uint64_t(1) << 20;

ImageRecord read_polycam_camera(const fs::path& path, const ImageFinder& images) {
    const auto field = core::JsonField::of_file(path, {.bytes = kMostCameraBytes, .not_finite = true});
    ImageRecord record = begin_record(images, path.stem().string(), field);
    Camera& camera = record.camera;
    camera.cx = field.number("cx");
    camera.cy = field.number("cy");
    glm::dmat3 axes;
    glm::dvec3 center;
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 4; ++column) {
            const std::string key = "t_" + std::to_string(row) + std::to_string(column);
            (column < 3 ? axes[column][row] : center[row]) = field.number(key.c_str());
        }
    if (const std::string fault = rotation_fault(axes); !fault.empty())
        field.fail("t_00 to t_22 are not a rotation: " + fault);
    set_pose(camera, from_opengl(nearest_rotation(axes)), center);
    finish_record(record, field.where());
    return record;
}

}  // namespace

ImageRecords import_polycam(const ImportSource& source) {
    const fs::path folder = source.file.parent_path();
    const bool corrected = folder.filename() == "corrected_cameras";
    const std::string images_name = corrected ? "corrected_images" : "images";
    const fs::path beside = (folder / "..").lexically_normal();
    const fs::path keyframes = folder.has_parent_path() ? folder.parent_path() : beside;
    if (!core::is_folder(keyframes / images_name))
        throw InputError(core::one_line((keyframes / images_name).string()) +
                         ": the folder of the images is missing; export the raw data again, with its images");
    const ImageFinder images(keyframes, {images_name});
    ImageRecords records;
    records.program = "Polycam";
    records.folder = images.folder();
    if (!corrected)
        records.notes.push_back(
            "poses are those of the phone; process the session in Polycam for corrected ones");
    for (const fs::path& file : files_of_folder(folder)) {
        if (core::lower(file.extension().string()) != ".json" || !core::is_file(file)) continue;
        records.files.push_back(file);
        records.images.push_back(read_polycam_camera(file, images));
    }
    add_points_beside(source.dataset, source.with_points, records);
    return records;
}

}  // namespace ewa::io
