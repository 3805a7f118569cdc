// SPDX-License-Identifier: Apache-2.0
#include "core/file_reader.h"
#include "core/text.h"
#include "ewa/error.h"
#include "io/datasets/colmap_model.h"

namespace ewa::io {

namespace {

constexpr size_t kMaxLine = size_t(1) << 28;  // the observations of one image are one line

/// Lines of a file, counted, and their words.
class Lines {
  public:
    explicit Lines(const std::filesystem::path& path) : reader_(path) {}

    /// The next line, or false at the end.
    bool next() {
        ++number_;
        const bool there = reader_.read_line(line_, kMaxLine);
        rest_ = line_;
        return there;
    }

    /// The next line that is neither empty nor a comment.
    bool next_entry() {
        while (next()) {
            const std::string_view text = core::trim(line_);
            if (!text.empty() && text.front() != '#') return true;
        }
        return false;
    }

    std::string_view word() { return core::next_word(rest_); }
    std::string_view rest() const { return core::trim(rest_); }

    double number(const char* what) {
        const std::string_view text = word();
        const std::optional<double> value = core::parse_number(text);
        if (!value) fail(std::string(what) + ": \"" + std::string(text.substr(0, 60)) + "\" is no number");
        return *value;
    }

    template <class T>
    T integer(const char* what) {
        const std::string_view text = word();
        const std::optional<T> value = core::parse_integer<T>(text);
        if (!value)
            fail(std::string(what) + ": \"" + std::string(text.substr(0, 60)) + "\" is no fitting integer");
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
void read_cameras(const std::filesystem::path& path, ColmapBuilder& builder) {
    Lines lines(path);
    const Fail fail = [&](const std::string& text) { lines.fail(text); };
    while (lines.next_entry()) {
        const auto id = lines.integer<uint32_t>("camera id");
        const std::string_view name = lines.word();
        const ColmapLens* lens = colmap_lens(name);
        if (!lens) {
            lines.fail(
                "the lens model \"" + std::string(name) +
                "\" is not known; undistort the images with `colmap image_undistorter` and use its output");
            return;
        }
        const auto width = lines.integer<uint64_t>("width"), height = lines.integer<uint64_t>("height");
        std::vector<double> parameters(lens->parameters());
        for (double& parameter : parameters) parameter = lines.number("camera parameter");
        if (!lines.rest().empty()) lines.fail("a " + std::string(name) + " camera has too many parameters");
        builder.add_camera(id, *lens, width, height, parameters, fail);
    }
}

// # IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME, then a line of observations, which may be empty.
void read_images(const std::filesystem::path& path, ColmapBuilder& builder) {
    Lines lines(path);
    const Fail fail = [&](const std::string& text) { lines.fail(text); };
    while (lines.next_entry()) {
        lines.integer<uint32_t>("image id");
        std::array<double, 7> pose;
        for (double& value : pose) value = lines.number("pose");
        const auto camera_id = lines.integer<uint32_t>("camera id");
        if (lines.rest().empty()) lines.fail("the image has no name");
        builder.add_image(pose, camera_id, std::string(lines.rest()), fail);
        lines.next();
    }
}

// # POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[]
void read_points(const std::filesystem::path& path, ColmapBuilder& builder) {
    Lines lines(path);
    while (lines.next_entry()) {
        lines.integer<uint64_t>("point id");
        glm::dvec3 position;
        for (int axis = 0; axis < 3; ++axis) position[axis] = lines.number("coordinate");
        std::array<uint8_t, 3> color;
        for (uint8_t& channel : color) channel = lines.integer<uint8_t>("colour");
        lines.number("reprojection error");
        builder.add_point(position, color, [&] { return lines.where(); });
    }
}

}  // namespace

void read_colmap_text(const std::filesystem::path& model, ColmapBuilder& builder) {
    read_cameras(model / "cameras.txt", builder);
    read_images(model / "images.txt", builder);
    if (std::filesystem::exists(model / "points3D.txt")) read_points(model / "points3D.txt", builder);
}

}  // namespace ewa::io
