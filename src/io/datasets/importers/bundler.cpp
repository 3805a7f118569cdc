// SPDX-License-Identifier: Apache-2.0
// bundle.out of Bundler, which Photo Tourism, 1DSfM, VisualSFM, RealityCapture and COLMAP's model_converter write, too. list.txt beside
// it names the images.
//
//   # Bundle file v0.3
//   cameras points
//   of each camera: f k1 k2, the rotation (three rows) and the translation, from the world to the camera (x right, y up, z back)
//   of each point: position, colour, and the cameras that see it: their number, and for each its index, a key and a pixel
// A camera with f = 0 has no pose. The image's middle is the principal point.
#include <algorithm>
#include <cmath>

#include "core/file_reader.h"
#include "core/folders.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "io/datasets/importers/image_finder.h"
#include "io/datasets/importers/importer.h"
#include "io/datasets/rotation.h"

namespace ewa::io {

namespace {

namespace fs = std::filesystem;

constexpr size_t kLongestLine = size_t(1) << 24;
constexpr uint64_t kMostListed = 1000000, kMostPoints = uint64_t(1) << 32;

/// The numbers of a file, over all of its lines.
class BundleNumbers {
  public:
    explicit BundleNumbers(const fs::path& path) : reader_(path) {}

    double next(const char* what) {
        while (core::trim(rest_).empty()) {
            if (!reader_.read_line(line_, kLongestLine)) reader_.fail(std::string("ends before ") + what);
            ++number_;
            rest_ = line_.starts_with("#") ? std::string_view() : std::string_view(line_);
        }
        const std::string_view word = core::next_word(rest_);
        const std::optional<double> value = core::parse_number(word);
        if (!value || !std::isfinite(*value))
            fail(std::string(what) + ": \"" + std::string(word.substr(0, 60)) + "\" is not a finite number");
        return *value;
    }
    uint64_t count(const char* what, uint64_t most) {
        const double value = next(what);
        if (!(value >= 0 && value <= double(most)) || value != std::floor(value))
            fail(std::string(what) + " is not a whole number of 0 to " + std::to_string(most));
        return uint64_t(value);
    }
    glm::dvec3 vector(const char* what) {
        const double x = next(what), y = next(what), z = next(what);
        return {x, y, z};
    }
    std::string where() const { return reader_.name() + ":" + std::to_string(number_); }
    [[noreturn]] void fail(const std::string& text) const {
        throw InputError(where() + ": " + core::one_line(text));
    }

  private:
    core::FileReader reader_;
    std::string line_;
    std::string_view rest_;
    size_t number_ = 0;
};

/// A line "name", or "name 0 focal".
std::string name_in(std::string_view line) {
    std::vector<std::string_view> words;
    for (std::string_view rest = line; !core::trim(rest).empty();) words.push_back(core::next_word(rest));
    const bool focal = words.size() > 2 && words[words.size() - 2] == "0" && core::parse_number(words.back());
    if (focal) line = line.substr(0, size_t(words[words.size() - 2].data() - line.data()));
    return std::string(core::trim(line));
}

/// The images' names, by list.txt, COLMAP's NAME.list.txt of NAME.bundle.out, or RealityCapture's list.lst; else those of the folder.
std::vector<std::string> names_of(const ImportSource& source, const ImageFinder& images, uint64_t cameras,
                                  ImageRecords& records) {
    const fs::path folder = source.file.parent_path();
    std::string start = source.file.stem().string();
    start.erase(start.size() - std::min(start.size(), std::string_view("bundle").size()));
    std::vector<std::string> names;
    for (const fs::path& list : {folder / (start + "list.txt"), folder / "list.txt", folder / "imagelist.lst",
                                 source.dataset / "list.txt"}) {
        if (!core::is_file(list)) continue;
        core::FileReader reader(list);
        for (std::string line; reader.read_line(line, kLongestLine);)
            if (!core::trim(line).empty()) names.push_back(name_in(line));
        if (names.size() < cameras)
            throw InputError(reader.name() + ": names " + core::counted(names.size(), "image") + ", and " +
                             core::one_line(source.file.filename().string()) + " has " +
                             core::counted(cameras, "camera"));
        records.files.push_back(list);
        return names;
    }
    if (images.names().size() != cameras)
        throw InputError(core::one_line(source.file.string()) + ": list.txt, which names its " +
                         core::counted(cameras, "image") + ", is not beside it");
    for (const fs::path& name : images.names()) names.push_back(name.string());
    return names;
}

/// Empty without a pose.
std::optional<ImageRecord> read_camera(BundleNumbers& numbers) {
    const glm::dvec3 lens = numbers.vector("a focal length and two terms of distortion");
    glm::dmat3 rows;  // the axes of the camera in the world
    for (int i = 0; i < 3; ++i) rows[i] = numbers.vector("a rotation");
    const glm::dvec3 translation = numbers.vector("a translation");
    if (lens[0] == 0) return std::nullopt;
    ImageRecord record;
    record.camera.fx = record.camera.fy = lens[0];
    record.distortion.k1 = lens[1];
    record.distortion.k2 = lens[2];
    if (const std::string fault = rotation_fault(rows); !fault.empty())
        numbers.fail("the rotation that ends before this line: " + fault);
    const glm::dmat3 axes = nearest_rotation(rows);
    set_pose(record.camera, from_opengl(axes), -(axes * translation));
    return record;
}

}  // namespace

ImageRecords import_bundler(const ImportSource& source) {
    BundleNumbers numbers(source.file);
    const uint64_t cameras = numbers.count("the number of cameras", kMostListed),
                   points = numbers.count("the number of points", kMostPoints);
    const ImageFinder images(source.dataset, {"images"});
    ImageRecords records = begin_records(source, {}, images.folder());
    const std::vector<std::string> names = names_of(source, images, cameras, records);
    std::vector<size_t> places(cameras, SIZE_MAX);  // of a camera in records.images
    size_t unplaced = 0;
    for (uint64_t i = 0; i < cameras; ++i) {
        std::optional<ImageRecord> record = read_camera(numbers);
        if (!record) {
            ++unplaced;
            continue;
        }
        images.find(names[i], numbers.where(), *record);
        if (core::is_file(record->path)) {
            const ImageSize size = read_image_size(record->path);
            record->camera.width = size.width;
            record->camera.height = size.height;
            record->camera.cx = 0.5 * size.width;
            record->camera.cy = 0.5 * size.height;
        }
        finish_record(*record, numbers.where());
        places[i] = records.images.size();
        records.images.push_back(std::move(*record));
    }
    for (uint64_t i = 0; i < points; ++i) {
        const glm::dvec3 position = numbers.vector("a position"), color = numbers.vector("a colour");
        std::array<uint8_t, 3> bytes;
        for (int c = 0; c < 3; ++c) bytes[size_t(c)] = uint8_t(std::clamp(color[c], 0.0, 255.0) + 0.5);
        const auto index = uint32_t(records.points.positions.size());
        const bool added =
            add_point(records.points, records.dropped, position, bytes, [&] { return numbers.where(); });
        for (uint64_t seen = numbers.count("the number of views", kMostListed); seen > 0; --seen) {
            const uint64_t camera = numbers.count("a camera of a point", kMostListed);
            numbers.vector("a view");  // a key and a pixel
            if (added && camera < cameras && places[camera] != SIZE_MAX)
                records.images[places[camera]].seen.push_back(index);
        }
    }
    note_unplaced(unplaced, records);
    return records;
}

}  // namespace ewa::io
