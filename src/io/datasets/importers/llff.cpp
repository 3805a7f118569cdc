// SPDX-License-Identifier: Apache-2.0
// poses_bounds.npy of LLFF and of the datasets in its layout: a NumPy array of 17 numbers for each image of images/, in the order of
// their names.
//
//   15  three rows of five: the axes of the camera in the world as columns (x down, y right, z back), its position, and
//       height, width and focal length (px)
//   2   the nearest and the farthest depth, which are not used
#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/file_reader.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "io/datasets/importers/image_finder.h"
#include "io/datasets/importers/importer.h"
#include "io/datasets/rotation.h"

namespace ewa::io {

namespace {

constexpr size_t kPoseColumns = 17, kMostPoses = 100000;

/// The rows of a NumPy array of floats with so many columns. https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html
std::vector<std::array<double, kPoseColumns>> read_pose_rows(const std::filesystem::path& path) {
    core::FileReader reader(path);
    constexpr size_t kMagic = 6, kLongestHeader = 1 << 16;
    reader.skip(kMagic, "the signature");
    const bool long_header = reader.read<uint16_t>("the version") != 1;  // 1.0
    const size_t length = long_header ? reader.read<uint32_t>("the header's length")
                                      : reader.read<uint16_t>("the header's length");
    if (length > kLongestHeader) reader.fail("the header is longer than 65536 bytes");
    std::string header(reinterpret_cast<const char*>(reader.take(length, "the header")), length);
    std::erase_if(header, [](char c) { return c == ' ' || c == '\n'; });
    const auto after = [&](std::string_view key) {
        const size_t at = header.find(key);
        return at == header.npos ? std::string_view() : std::string_view(header).substr(at + key.size());
    };
    const std::string_view shape = after("'shape':("),
                           comma = shape.substr(std::min(shape.find(','), shape.size()));
    const auto count = core::parse_integer<size_t>(shape.substr(0, shape.size() - comma.size()));
    const bool wide = after("'descr':").starts_with("'<f8'"), narrow = after("'descr':").starts_with("'<f4'");
    if (!count || !comma.starts_with(",17)") || !(wide || narrow))
        reader.fail("is not a NumPy array of 17 floats for each image");
    const bool by_columns = after("'fortran_order':").starts_with("True");
    if (*count > kMostPoses) reader.fail("has more than 100000 images");
    reader.require_room(*count * kPoseColumns, wide ? sizeof(double) : sizeof(float), "the numbers");
    std::vector<std::array<double, kPoseColumns>> rows(*count);
    for (size_t i = 0; i < *count * kPoseColumns; ++i) {
        const double value = wide ? reader.read<double>("a number") : double(reader.read<float>("a number"));
        (by_columns ? rows[i % *count][i / *count] : rows[i / kPoseColumns][i % kPoseColumns]) = value;
    }
    return rows;
}

int llff_side(double value, const std::string& where) {
    constexpr double kMostPixels = 1 << 20;
    if (!(value >= 1 && value <= kMostPixels) || value != std::floor(value))
        throw InputError(where + ": the size of the image is not a whole number of pixels");
    return int(value);
}

}  // namespace

ImageRecords import_llff(const ImportSource& source) {
    const std::string name = core::one_line(source.file.string());
    const auto rows = read_pose_rows(source.file);
    const ImageFinder images(source.dataset, {"images"});
    std::vector<std::filesystem::path> names = images.names();
    // Smaller copies have the names, too.
    for (const char* copies : {"images_2", "images_4", "images_8"})
        if (names.empty()) names = list_images(source.dataset / copies, true);
    if (names.size() != rows.size())
        throw InputError(name + ": has " + core::counted(rows.size(), "pose") + ", and " +
                         core::one_line(images.folder().string()) + " has " +
                         core::counted(names.size(), "image") + "; keep only the images that have poses");
    ImageRecords records = begin_records(source, {}, images.folder());
    for (size_t i = 0; i < rows.size(); ++i) {
        const auto at = [&](int row, int column) { return rows[i][size_t(5 * row + column)]; };
        const std::string where = name + ": image " + std::to_string(i);
        ImageRecord record;
        images.find(names[i].string(), where, record);
        Camera& camera = record.camera;
        camera.height = llff_side(at(0, 4), where);
        camera.width = llff_side(at(1, 4), where);
        camera.fx = camera.fy = at(2, 4);
        camera.cx = 0.5 * camera.width;
        camera.cy = 0.5 * camera.height;
        glm::dmat3 axes;
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 3; ++column)
                axes[column][row] = column == 0 ? at(row, 1) : column == 1 ? at(row, 0) : -at(row, 2);
        if (const std::string fault = rotation_fault(axes); !fault.empty())
            throw InputError(where + ": the pose is not a rotation: " + fault);
        set_pose(camera, nearest_rotation(axes), {at(0, 3), at(1, 3), at(2, 3)});
        finish_record(record, where);
        records.images.push_back(std::move(record));
    }
    add_points_beside(source.dataset, source.with_points, records);
    return records;
}

}  // namespace ewa::io
