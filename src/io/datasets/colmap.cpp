// SPDX-License-Identifier: Apache-2.0
// Binary and text files of COLMAP (colmap.github.io/format.html).
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/file_reader.h"
#include "core/folders.h"
#include "core/text.h"
#include "ewa/error.h"
#include "io/datasets/colmap_lens.h"
#include "io/datasets/image_records.h"
#include "io/datasets/importers/image_finder.h"
#include "scene/lens.h"
#include "scene/native_lens.h"
#include "scene/statistics.h"

namespace ewa::io {

namespace {

/// Throws InputError that names the position in the file.
using Fail = std::function<void(const std::string&)>;

/// An image that saw a point, by its id, and the number of the feature that shows it.
struct TrackEntry {
    uint32_t image = 0, feature = 0;
};

/// Collects a model and checks its ids. Errors go to the Fail of the file that is being read.
class ColmapBuilder {
  public:
    void add_camera(uint32_t id, const ColmapLens& lens, uint64_t width, uint64_t height,
                    const std::vector<double>& parameters, const Fail& fail);
    /// pose: qw qx qy qz tx ty tz, world to camera.
    void add_image(uint32_t id, const std::array<double, 7>& pose, uint32_t camera_id,
                   const std::string& name, const Fail& fail);
    /// Where the image that was added last shows a point, as its feature of this number. In the order of the numbers.
    void add_feature(uint32_t number, const glm::vec2& at) { features_.back().push_back({number, at}); }
    /// track: ids of the images that saw the point, and the numbers of their features. Other images than the model's do not count.
    /// `where` is called for the first dropped point.
    bool add_point(const glm::dvec3& position, const std::array<uint8_t, 3>& color,
                   const std::vector<TrackEntry>& track, const std::function<std::string()>& where) {
        if (!io::add_point(result_.points, result_.dropped, position, color, where)) return false;
        for (const TrackEntry& entry : track) {
            const auto image = image_of_.find(entry.image);
            if (image == image_of_.end()) continue;
            result_.images[image->second].seen.push_back(uint32_t(result_.points.positions.size() - 1));
            add_error(image->second, entry.feature, position);
        }
        return true;
    }
    /// The colours of all points, times the scale.
    void set_colors(const std::vector<std::array<float, 3>>& colors, float scale) {
        for (size_t i = 0; i < colors.size(); ++i)
            for (size_t k = 0; k < 3; ++k)
                result_.points.colors[i][k] = uint8_t(std::lround(colors[i][k] * scale));
    }
    ImageRecords take() {
        for (size_t i = 0; i < errors_.size(); ++i)
            result_.images[i].point_error = scene::quantile(errors_[i], 0.5);
        return std::move(result_);
    }

  private:
    struct Feature {
        uint32_t number = 0;
        glm::vec2 at{0};  // px
    };
    /// Adds how far the point's image is from the feature that shows it.
    void add_error(size_t image, uint32_t feature, const glm::dvec3& position);

    struct CameraModel {
        Camera camera;
        Distortion distortion;
    };
    std::map<uint32_t, CameraModel> cameras_;
    std::map<uint32_t, size_t> image_of_;  // by id: of result_.images
    // Of each image: the features that show points, and the errors of these, px. Empty where the file has none.
    std::vector<std::vector<Feature>> features_;
    std::vector<std::vector<float>> errors_;
    ImageRecords result_;
};

void ColmapBuilder::add_error(size_t image, uint32_t feature, const glm::dvec3& position) {
    const auto found = std::ranges::lower_bound(features_[image], feature, {}, &Feature::number);
    if (found == features_[image].end() || found->number != feature) return;
    const ImageRecord& record = result_.images[image];
    const Camera& camera = record.camera;
    const glm::dvec3 seen = camera.rotation * position + camera.translation;
    if (record.distortion.lens == Lens::equirectangular || !(seen.z > 0)) return;
    const glm::dvec2 bent = scene::distort(record.distortion, {seen.x / seen.z, seen.y / seen.z});
    const double error = glm::distance(
        glm::dvec2(camera.fx * bent.x + camera.cx, camera.fy * bent.y + camera.cy), glm::dvec2(found->at));
    if (std::isfinite(error)) errors_[image].push_back(float(error));
}

constexpr uint64_t kMaxSize = 1u << 20;  // px

void ColmapBuilder::add_camera(uint32_t id, const ColmapLens& lens, uint64_t width, uint64_t height,
                               const std::vector<double>& parameters, const Fail& fail) {
    const std::string camera_name = "camera " + std::to_string(id);
    if (width < 1 || height < 1 || width > kMaxSize || height > kMaxSize)
        fail(camera_name + " has an invalid size of " + std::to_string(width) + " x " +
             std::to_string(height) + " pixels");
    Camera camera;
    camera.width = static_cast<int>(width);
    camera.height = static_cast<int>(height);
    if (lens.focal_lengths == 0) {
        scene::set_equirectangular(camera);
    } else {
        camera.fx = parameters[0];
        camera.fy = parameters[lens.focal_lengths - 1];
        camera.cx = parameters[lens.focal_lengths];
        camera.cy = parameters[lens.focal_lengths + 1];
    }
    Distortion distortion;
    for (size_t i = lens.focal_lengths + 2; i < parameters.size(); ++i)
        distortion.*lens.terms[i - lens.focal_lengths - 2] = parameters[i];
    distortion.lens = lens.lens;
    const bool finite =
        std::all_of(parameters.begin(), parameters.end(), [](double v) { return std::isfinite(v); });
    if (!(camera.fx > 0 && camera.fy > 0) || !finite)
        fail(camera_name + " has a focal length that is not positive, or a parameter that is not finite");
    if (!cameras_.emplace(id, CameraModel{camera, distortion}).second)
        fail(camera_name + " is defined twice");
}

void ColmapBuilder::add_image(uint32_t id, const std::array<double, 7>& pose, uint32_t camera_id,
                              const std::string& name, const Fail& fail) {
    const std::string image_name = "image \"" + core::one_line(name) + "\"";
    if (named_path(name).empty()) fail(image_name + " has no file's name");
    const auto camera = cameras_.find(camera_id);
    if (camera == cameras_.end())
        fail(image_name + " refers to camera " + std::to_string(camera_id) + ", which is not defined");
    double largest = 0;
    for (double v : pose)
        if (!std::isfinite(v)) fail(image_name + " has a pose that is not finite");
    for (size_t i = 0; i < 4; ++i) largest = std::max(largest, std::abs(pose[i]));
    if (largest == 0) fail(image_name + " has a quaternion of zero");
    // The division keeps the squares of very small or large components within the range of double.
    const glm::dquat q = glm::normalize(
        glm::dquat(pose[0] / largest, pose[1] / largest, pose[2] / largest, pose[3] / largest));
    ImageRecord image;
    image.name = name;
    image.camera = camera->second.camera;
    image.distortion = camera->second.distortion;
    image.camera.rotation = glm::mat3_cast(q);
    image.camera.translation = {pose[4], pose[5], pose[6]};
    image_of_.emplace(id, result_.images.size());
    result_.images.push_back(std::move(image));
    features_.emplace_back();
    errors_.emplace_back();
}

/// Gives the images their paths.
void find_images(const ImageFinder& finder, const std::string& where, ImageRecords& records) {
    std::vector<std::string> names;
    for (const ImageRecord& image : records.images) names.push_back(image.name);
    finder.settle(names);
    records.folder = finder.folder();
    for (ImageRecord& image : records.images) finder.find(image.name, where, image);
}

constexpr size_t kMaxName = 4096;
constexpr uint64_t kMostFeatures = 10000;                            // of an image, whose errors are measured
constexpr uint64_t kNoPoint = std::numeric_limits<uint64_t>::max();  // of a feature that shows none
// Bytes of the shortest entry of each list, and of each item that an entry counts.
constexpr uint64_t kCameraBytes = 4 + 4 + 8 + 8 + 2 * 8, kImageBytes = 4 + 7 * 8 + 4 + 1 + 8;
constexpr uint64_t kPointBytes = 8 + 3 * 8 + 3 + 8 + 8, kObservationBytes = 3 * 8, kTrackBytes = 2 * 4;

uint64_t read_count(core::FileReader& reader, uint64_t bytes_each, const char* what) {
    const auto count = reader.read<uint64_t>(what);
    reader.require_room(count, bytes_each, what);
    return count;
}

void read_binary_cameras(const std::filesystem::path& path, ColmapBuilder& builder) {
    core::FileReader reader(path);
    const Fail fail = [&](const std::string& text) { reader.fail(text); };
    const uint64_t count = read_count(reader, kCameraBytes, "cameras");
    for (uint64_t i = 0; i < count; ++i) {
        const auto id = reader.read<uint32_t>("a camera");
        const auto lens_id = reader.read<int32_t>("a camera");
        const auto width = reader.read<uint64_t>("a camera"), height = reader.read<uint64_t>("a camera");
        const ColmapLens* lens = colmap_lens(int64_t(lens_id));
        if (!lens)
            reader.fail("camera " + std::to_string(id) + " has the unknown lens model number " +
                        std::to_string(lens_id) +
                        "; undistort the images with `colmap image_undistorter` and use its output");
        std::vector<double> parameters(lens->parameters());
        for (double& parameter : parameters) parameter = reader.read<double>("a camera");
        builder.add_camera(id, *lens, width, height, parameters, fail);
    }
}

void read_binary_images(const std::filesystem::path& path, ColmapBuilder& builder) {
    core::FileReader reader(path);
    const Fail fail = [&](const std::string& text) { reader.fail(text); };
    const uint64_t count = read_count(reader, kImageBytes, "images");
    for (uint64_t i = 0; i < count; ++i) {
        const auto id = reader.read<uint32_t>("an image");
        std::array<double, 7> pose;
        for (double& value : pose) value = reader.read<double>("an image");
        const auto camera_id = reader.read<uint32_t>("an image");
        const std::string name = reader.read_zero_terminated(kMaxName, "the name of an image");
        builder.add_image(id, pose, camera_id, name, fail);
        const uint64_t observations = read_count(reader, kObservationBytes, "observations");
        // As many as a median needs.
        const uint64_t step = observations / kMostFeatures + 1;
        for (uint64_t number = 0; number < observations; number += step) {
            const auto x = reader.read<double>("an observation"), y = reader.read<double>("an observation");
            if (reader.read<uint64_t>("an observation") != kNoPoint)
                builder.add_feature(uint32_t(number), {x, y});
            reader.skip((std::min(step, observations - number) - 1) * kObservationBytes, "observations");
        }
    }
}

void read_binary_points(const std::filesystem::path& path, ColmapBuilder& builder) {
    core::FileReader reader(path);
    const uint64_t count = read_count(reader, kPointBytes, "points");
    for (uint64_t i = 0; i < count; ++i) {
        const uint64_t begin = reader.offset();
        reader.skip(sizeof(uint64_t), "a point");  // its id
        glm::dvec3 position;
        for (int axis = 0; axis < 3; ++axis) position[axis] = reader.read<double>("a point");
        std::array<uint8_t, 3> color;
        for (uint8_t& channel : color) channel = reader.read<uint8_t>("a point");
        reader.skip(sizeof(double), "a point");  // its reprojection error
        const uint64_t track = read_count(reader, kTrackBytes, "entries of a track");
        std::vector<TrackEntry> entries(track);
        for (TrackEntry& entry : entries) {
            entry.image = reader.read<uint32_t>("a track");
            entry.feature = reader.read<uint32_t>("a track");
        }
        builder.add_point(position, color, entries, [&] {
            return core::one_line(path.string()) + ": the point at byte " + std::to_string(begin);
        });
    }
}

constexpr size_t kShownBytes = 60;            // bytes of a word in an error
constexpr size_t kMaxLine = size_t(1) << 28;  // the observations of one image are one line

/// The lines of a file with their numbers, and the words of a line.
class Lines {
  public:
    explicit Lines(const std::filesystem::path& path) : reader_(path) {}

    /// Reads the next line. False at the end of the file.
    bool next() {
        ++number_;
        const bool there = reader_.read_line(line_, kMaxLine);
        rest_ = line_;
        return there;
    }

    /// Reads the next line that is neither empty nor a comment. False at the end of the file.
    bool next_entry() {
        while (next()) {
            const std::string_view text = core::trim(line_);
            if (!text.empty() && text.front() != '#') return true;
        }
        return false;
    }

    std::string_view word() { return core::next_word(rest_); }
    std::string_view rest() const { return core::trim(rest_); }

    /// The next word as a number of the type T.
    template <class T>
    T value(const char* what) {
        const std::string_view text = word();
        std::optional<T> value;
        if constexpr (std::is_same_v<T, double>)
            value = core::parse_number(text);
        else
            value = core::parse_integer<T>(text);
        if (!value)
            fail(std::string(what) + ": \"" + std::string(text.substr(0, kShownBytes)) + "\" is not " +
                 (std::is_same_v<T, double> ? "a number" : "an integer in range"));
        return *value;
    }

    std::string where() const { return reader_.name() + ":" + std::to_string(number_); }
    void fail(const std::string& text) const { throw InputError(where() + ": " + core::one_line(text)); }

  private:
    core::FileReader reader_;
    std::string line_;
    std::string_view rest_;
    size_t number_ = 0;
};

// # CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]
void read_text_cameras(const std::filesystem::path& path, ColmapBuilder& builder) {
    Lines lines(path);
    const Fail fail = [&](const std::string& text) { lines.fail(text); };
    while (lines.next_entry()) {
        const auto id = lines.value<uint32_t>("camera id");
        const std::string_view name = lines.word();
        const ColmapLens* lens = colmap_lens(name);
        if (!lens) {
            lines.fail("unknown lens model \"" + std::string(name.substr(0, kShownBytes)) +
                       "\"; undistort the images with `colmap image_undistorter` and use its output");
            return;
        }
        const auto width = lines.value<uint64_t>("width"), height = lines.value<uint64_t>("height");
        std::vector<double> parameters(lens->parameters());
        for (size_t i = 0; i < parameters.size(); ++i) {
            if (lines.rest().empty())
                lines.fail("a camera of the model " + std::string(name) + " has " +
                           std::to_string(parameters.size()) + " parameters after its size, and here are " +
                           std::to_string(i));
            parameters[i] = lines.value<double>("camera parameter");
        }
        if (!lines.rest().empty()) lines.fail("a " + std::string(name) + " camera has too many parameters");
        builder.add_camera(id, *lens, width, height, parameters, fail);
    }
}

/// Whether the line has observations: triples of numbers. A line of an image ends in a name instead, which is hardly ever numbers.
bool is_observations(std::string_view line) {
    constexpr size_t kEnough = 12;  // words; images have ten before the second word of their name
    const std::string_view last = core::trim(line).substr(core::trim(line).find_last_of(" \t") + 1);
    size_t words = 0;
    for (std::string_view rest = line; words <= kEnough; ++words) {
        const std::string_view word = core::next_word(rest);
        if (word.empty()) break;
        if (!core::parse_number(word)) return false;
    }
    return core::parse_number(last) && (words > kEnough || words % 3 == 0);
}

/// Calls `visit` at each line of an image. Some programs write no lines of observations, or no empty ones.
template <class Visit>
void visit_text_images(Lines& lines, const Visit& visit) {
    for (bool more = lines.next_entry(); more;) {
        visit();
        more = lines.next_entry();
        if (more && is_observations(lines.rest())) more = lines.next_entry();
    }
}

// # IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME, then a line of observations that may be empty.
void read_text_images(const std::filesystem::path& path, ColmapBuilder& builder) {
    Lines lines(path);
    const Fail fail = [&](const std::string& text) { lines.fail(text); };
    visit_text_images(lines, [&] {
        const auto id = lines.value<uint32_t>("image id");
        std::array<double, 7> pose;
        for (double& value : pose) value = lines.value<double>("pose");
        const auto camera_id = lines.value<uint32_t>("camera id");
        if (lines.rest().empty()) lines.fail("the image has no name");
        builder.add_image(id, pose, camera_id, std::string(lines.rest()), fail);
    });
}

// # POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[]
void read_text_points(const std::filesystem::path& path, ColmapBuilder& builder) {
    constexpr float kGrey = 128;
    Lines lines(path);
    std::vector<std::array<float, 3>> colors;  // integers, or with decimals, up to 255 or to 1
    float largest = 0;
    bool whole = true;
    while (lines.next_entry()) {
        lines.value<uint64_t>("point id");
        glm::dvec3 position;
        for (int axis = 0; axis < 3; ++axis) position[axis] = lines.value<double>("coordinate");
        std::array<float, 3> color{kGrey, kGrey, kGrey};
        for (size_t k = 0; k < 3 && !(k == 0 && lines.rest().empty()); ++k) {
            color[k] = float(lines.value<double>("colour"));
            if (!(color[k] >= 0 && color[k] <= 255)) lines.fail("a colour is not in 0..255");
            largest = std::max(largest, color[k]);
            whole = whole && color[k] == std::floor(color[k]);
        }
        // Other programs write other tracks, or neither an error nor a track.
        if (!lines.rest().empty()) lines.value<double>("reprojection error");
        std::vector<TrackEntry> track;
        while (const auto id = core::parse_integer<uint32_t>(lines.word()))
            track.push_back({*id, core::parse_integer<uint32_t>(lines.word()).value_or(0)});
        if (builder.add_point(position, {}, track, [&] { return lines.where(); })) colors.push_back(color);
    }
    builder.set_colors(colors, !whole && largest <= 1 ? 255 : 1);
}

/// The file of the model, in any case of its name; empty if there is none.
std::filesystem::path file_of(const ColmapModel& model, const std::string& name) {
    const std::filesystem::path file = entry_in(model.folder, name);
    return core::is_file(file) ? file : std::filesystem::path();
}

/// The points of the model's kind, else of the other.
void read_points(const ColmapModel& model, ColmapBuilder& builder,
                 std::vector<std::filesystem::path>& files) {
    for (const std::string& extension :
         {model.extension, std::string(model.extension == ".bin" ? ".txt" : ".bin")})
        if (const auto file = file_of(model, "points3D" + extension); !file.empty()) {
            (extension == ".bin" ? read_binary_points : read_text_points)(file, builder);
            files.push_back(file);
            return;
        }
}

}  // namespace

uint64_t count_images(const ColmapModel& model) try {
    const std::filesystem::path file = file_of(model, "images" + model.extension);
    if (model.extension == ".bin") return core::FileReader(file).read<uint64_t>("images");
    Lines lines(file);
    uint64_t count = 0;
    visit_text_images(lines, [&] { ++count; });
    return count;
} catch (const InputError&) {
    return 0;
}

ImageRecords read_colmap(const ColmapModel& model, const ImageFinder* images) {
    ColmapBuilder builder;
    const bool binary = model.extension == ".bin";
    const std::filesystem::path cameras_file = entry_in(model.folder, "cameras" + model.extension),
                                images_file = entry_in(model.folder, "images" + model.extension);
    (binary ? read_binary_cameras : read_text_cameras)(cameras_file, builder);
    (binary ? read_binary_images : read_text_images)(images_file, builder);
    std::vector<std::filesystem::path> files{cameras_file, images_file};
    read_points(model, builder, files);
    ImageRecords records = builder.take();
    records.format = "COLMAP";
    // The images of a rig have their whole pose in the list of images, too.
    if (!file_of(model, "rigs" + model.extension).empty())
        records.program = "COLMAP 3.12 or later, which writes rigs";
    records.files = std::move(files);
    if (!images) return records;
    find_images(*images, core::one_line(images_file.string()), records);
    // The first of them replaces points that the model lacks.
    for (const std::filesystem::path& cloud :
         {entry_in(model.folder, "points3D.ply"), entry_in(model.dataset, "points3D.ply"),
          records.folder.parent_path() / "fused.ply"}) {
        if (!records.points.positions.empty() || records.dropped.count > 0 || !core::is_file(cloud)) continue;
        PlyPoints read = read_points_ply(cloud);
        records.points = std::move(read.points);
        records.dropped = std::move(read.dropped);
        records.files.push_back(cloud);
    }
    return records;
}

}  // namespace ewa::io
