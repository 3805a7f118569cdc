// SPDX-License-Identifier: Apache-2.0
// The pinhole views of 360° photos, and which photos are 360° photos.
#include "capture/panoramas.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/file_reader.h"
#include "core/folders.h"
#include "core/text.h"
#include "ewa/image.h"
#include "scene/native_lens.h"

namespace ewa::capture {
namespace {

namespace fs = std::filesystem;

constexpr size_t kLooked = 9;        // photos whose borders are compared
constexpr int kNear = 16;            // columns differ that are this part of the width apart
constexpr double kContinues = 0.5;   // the borders differ by less than this part of it
constexpr double kNoise = 1 / 64.0;  // of white
constexpr uint64_t kXmpBytes = 1 << 18;

/// 90 degrees wide and high, with the photo's pixels per degree in its middle.
Camera view_of(const Camera& panorama) {
    Camera view;
    view.width = view.height = std::max(2, int(std::lround(2 * panorama.fx)));
    view.fx = view.fy = view.cx = view.cy = 0.5 * view.width;
    return view;
}

Camera panorama_of(int width, int height) {
    Camera camera{.width = width, .height = height, .distortion = {.lens = Lens::equirectangular}};
    scene::set_equirectangular(camera);
    return camera;
}

/// Between four pixels. The left border continues in the right one.
void sample(const Image& image, double x, double y, float* out) {
    const double column = x - 0.5, row = std::clamp(y - 0.5, 0.0, double(image.height - 1));
    const double left = std::floor(column), top = std::min(std::floor(row), double(image.height - 2));
    const int x0 = (int(left) + image.width) % image.width, x1 = (x0 + 1) % image.width;
    const double u = column - left, v = row - top;
    for (size_t c = 0; c < 3; ++c) {
        const auto at = [&](int px, int py) {
            return double(image.at(px, py)[std::min(c, size_t(image.channels) - 1)]);
        };
        out[c] = float((1 - v) * ((1 - u) * at(x0, int(top)) + u * at(x1, int(top))) +
                       v * ((1 - u) * at(x0, int(top) + 1) + u * at(x1, int(top) + 1)));
    }
}

/// The mean difference of two columns.
double difference(const Image& image, int a, int b) {
    double sum = 0;
    for (int y = 0; y < image.height; ++y)
        for (int c = 0; c < image.channels; ++c)
            sum += std::abs(double(image.at(a, y)[c]) - double(image.at(b, y)[c]));
    return sum / (double(image.height) * image.channels);
}

/// How the left border differs from the right one, and columns near each other differ.
struct Borders {
    double around = 0, apart = 0;
};

Borders borders_of(const Image& image) {
    const int last = image.width - 1, step = std::max(1, image.width / kNear);
    return {difference(image, 0, last),
            0.5 * (difference(image, 0, step) + difference(image, last, last - step))};
}

/// Whether the file's XMP has GPano's projection of all directions.
bool says_panorama(const fs::path& file) {
    core::FileReader reader(file);
    const auto bytes = size_t(std::min<uint64_t>(reader.size(), kXmpBytes));
    const std::string_view head(reinterpret_cast<const char*>(reader.take(bytes, "the photo")), bytes);
    const size_t key = head.find("GPano:ProjectionType");
    return key != head.npos && head.substr(key, 64).find("equirectangular") != head.npos;
}

/// Lists of COLMAP separate names by spaces.
std::string without_spaces(const std::string& name) {
    constexpr std::string_view kDigits = "0123456789abcdef";
    std::string text;
    for (const char c : name) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte > ' ' && byte != 0x7f && c != '%')
            text += c;
        else
            (text += '%').append({kDigits[byte >> 4], kDigits[byte & 15]});
    }
    return text;
}

std::optional<std::string> with_spaces(std::string_view text) {
    std::string name;
    for (size_t i = 0; i < text.size(); ++i) {
        if (text[i] != '%') {
            name += text[i];
            continue;
        }
        unsigned value = 0;
        if (i + 2 >= text.size() ||
            std::from_chars(&text[i + 1], &text[i + 1] + 2, value, 16).ptr != &text[i + 1] + 2)
            return {};
        name += char(value);
        i += 2;
    }
    return name;
}

constexpr std::string_view kPrefix = "ewa-view-", kSuffix = ".png";

}  // namespace

glm::dmat3 view_rotation(int k) {
    const double turn = 2 * std::numbers::pi * k / kPanoramaViews, c = std::cos(turn), s = std::sin(turn);
    return {c, 0, s, 0, 1, 0, -s, 0, c};
}

Image panorama_view(const Image& photo, int k) {
    const Camera panorama = panorama_of(photo.width, photo.height), view = view_of(panorama);
    const glm::dmat3 back = glm::transpose(view_rotation(k));
    Image out(view.width, view.height, 3);
    for (int y = 0; y < view.height; ++y)
        for (int x = 0; x < view.width; ++x) {
            const glm::dvec3 ray((x + 0.5 - view.cx) / view.fx, (y + 0.5 - view.cy) / view.fy, 1);
            const auto pixel = scene::pixel_of(panorama, 0, back * ray);
            sample(photo, pixel->x, pixel->y, out.at(x, y));
        }
    return out;
}

fs::path view_name(int k, const fs::path& photo) {
    return std::string(kPrefix) + std::to_string(k) + "/" + without_spaces(photo.string()) +
           std::string(kSuffix);
}

std::pair<int, std::string> photo_of_view(const std::string& view) {
    const std::string_view text = view;
    const size_t slash = text.find('/');
    if (!text.starts_with(kPrefix) || !text.ends_with(kSuffix) || slash == text.npos) return {};
    const auto k = core::parse_integer<int>(text.substr(kPrefix.size(), slash - kPrefix.size()));
    if (!k || *k < 0 || *k >= kPanoramaViews || slash + 1 + kSuffix.size() > text.size()) return {};
    return {*k, with_spaces(text.substr(slash + 1, text.size() - slash - 1 - kSuffix.size())).value_or("")};
}

bool are_panoramas(const fs::path& folder, const std::vector<fs::path>& names) {
    for (const fs::path& name : names) {
        const ImageSize size = read_image_size(folder / name);
        if (size.width != 2 * size.height) return false;
    }
    if (std::ranges::all_of(names, [&](const fs::path& name) { return says_panorama(folder / name); }))
        return !names.empty();
    const size_t step = (names.size() + kLooked - 1) / kLooked;
    Borders sum;
    int looked = 0;
    for (size_t i = 0; i < names.size(); i += step, ++looked) {
        const Borders borders = borders_of(load_image(folder / names[i]));
        if (borders.around > std::max(borders.apart, kNoise)) return false;
        sum.around += borders.around;
        sum.apart += borders.apart;
    }
    // A blank background says nothing.
    return sum.apart > kNoise * looked && sum.around < kContinues * sum.apart;
}

PanoramaViews views_of_panoramas(const Photos& photos, const fs::path& folder,
                                 const ProgressFunction& progress) {
    PanoramaViews views{{folder, {}, photos.pairing}, {}};
    const int total = int(photos.names.size());
    int done = 0;
    for (const fs::path& name : photos.names) {
        if (!progress({CapturePhase::photos, "cut into views", "photos", done++, total, {}})) throw Stopped();
        const ImageSize size = read_image_size(photos.folder / name);
        const int width = view_of(panorama_of(size.width, size.height)).width;
        std::optional<Image> photo;
        for (int k = 0; k < kPanoramaViews; ++k) {
            const fs::path view = view_name(k, name);
            views.photos.names.push_back(view);
            views.cameras[{width, k}].push_back(view);
            if (core::is_file(folder / view)) continue;
            if (!photo) photo = load_image(photos.folder / name);
            core::make_folder((folder / view).parent_path());
            save_image(folder / view, panorama_view(*photo, k));
        }
    }
    return views;
}

std::vector<ImagePair> pairs_of_views(const std::vector<ImagePair>& photos) {
    std::vector<ImagePair> pairs;
    for (const auto& [a, b] : photos)
        for (int i = 0; i < kPanoramaViews; ++i)
            for (int k = 0; k < kPanoramaViews; ++k)
                pairs.emplace_back(a * kPanoramaViews + i, b * kPanoramaViews + k);
    return pairs;
}

}  // namespace ewa::capture
