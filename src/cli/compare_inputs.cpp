// SPDX-License-Identifier: Apache-2.0
#include "cli/compare_inputs.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>

#include "ewa/error.h"
#include "ewa/renderer.h"
#include "ewa/splat_files.h"
#include "image/image_files.h"
#include "report/pictures.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

class ImageSide : public ComparedSide {
  public:
    explicit ImageSide(const fs::path& path) : path_(path) {
        std::error_code ignored;
        names_.side = path.string();
        names_.one_image = !fs::is_directory(path, ignored);
        if (names_.one_image)
            read_image_size(path);  // throws if there is no such image
        else
            names_.asked = image::images_below(path);
    }
    const SideNames& names() const override { return names_; }
    std::string place(const fs::path& name) const override { return file(name).string(); }
    ComparedImage picture(const fs::path& name) override {
        ComparedImage picture{load_image(file(name))};
        const std::string_view format = image::format_name(file(name));
        if (read_image_size(file(name)).eight_bit)
            picture.levels = 255;
        else if (format == "png")
            picture.levels = 65535;
        picture.transparent = picture.image.channels == 4 && format != "openexr";
        return picture;
    }
    uint32_t skipped_splats() const override { return 0; }

  private:
    fs::path file(const fs::path& name) const { return name.empty() ? path_ : path_ / name; }

    fs::path path_;
    SideNames names_;
};

class SceneSide : public ComparedSide {
  public:
    SceneSide(const fs::path& splats, const SceneViews& views)
        : renderer_(views.device, load_splats(splats), views.options) {
        names_.side = splats.string();
        names_.is_scene = true;
        const std::vector<fs::path> stems = report::picture_names(views.cameras.frames);
        const std::set<int> asked(views.frames.begin(), views.frames.end());
        for (int frame = 0; frame < int(stems.size()); ++frame) {
            const fs::path name = stems[frame].string() + ".exr";
            (asked.contains(frame) ? names_.asked : names_.other).push_back(name);
            cameras_[name] = views.cameras.frames[frame].camera;
        }
    }
    const SideNames& names() const override { return names_; }
    std::string place(const fs::path& name) const override {
        return names_.side + ", image " + fs::path(name).replace_extension().string();
    }
    ComparedImage picture(const fs::path& name) override {
        const Rendering rendering = renderer_.render(cameras_.at(name));
        skipped_ = std::max(skipped_, renderer_.skipped_nonfinite());
        return {with_alpha(rendering.color, rendering.alpha)};
    }
    uint32_t skipped_splats() const override { return skipped_; }

  private:
    SideNames names_;
    Renderer renderer_;
    std::map<fs::path, Camera> cameras_;
    uint32_t skipped_ = 0;
};

Image without_alpha(const Image& image) {
    Image out(image.width, image.height, 3);
    for (size_t i = 0; i < out.pixels.size(); ++i) out.pixels[i] = image.pixels[i / 3 * 4 + i % 3];
    return out;
}

fs::path without_extension(fs::path path) {
    return path.replace_extension();
}

/// Moves the entries whose key is unique in both sets into `matched`.
template <class Key>
void match(std::set<fs::path>& a, std::set<fs::path>& b, const Key& key,
           std::vector<std::pair<fs::path, fs::path>>& matched) {
    std::map<fs::path, std::vector<fs::path>> keyed_a, keyed_b;
    for (const fs::path& path : a) keyed_a[key(path)].push_back(path);
    for (const fs::path& path : b) keyed_b[key(path)].push_back(path);
    for (const auto& [name, paths] : keyed_a) {
        const auto other = keyed_b.find(name);
        if (paths.size() != 1 || other == keyed_b.end() || other->second.size() != 1) continue;
        matched.emplace_back(paths[0], other->second[0]);
        a.erase(paths[0]);
        b.erase(other->second[0]);
    }
}

std::set<fs::path> all_names(const SideNames& side) {
    std::set<fs::path> names(side.asked.begin(), side.asked.end());
    names.insert(side.other.begin(), side.other.end());
    return names;
}

bool is_asked(const SideNames& side, const fs::path& name) {
    return std::find(side.other.begin(), side.other.end(), name) == side.other.end();
}

/// The side with its number of images and the name of one.
std::string described(const SideNames& side) {
    const size_t count = side.asked.size();
    return side.side + " (" + std::to_string(count) + (count == 1 ? " image" : " images") +
           (count == 0 ? "" : ", " + without_extension(side.asked[0]).string()) + ")";
}

ImagePairs pair_one(const SideNames& a, const SideNames& b) {
    if (a.one_image && b.one_image) return {{{"", {}, {}}}, {}, {}};
    const SideNames &one = a.one_image ? a : b, &several = a.one_image ? b : a;
    if (!several.is_scene || several.asked.size() != 1)
        throw InputError(one.side + " is one image and " + several.side + " has " +
                         std::to_string(several.asked.size()) +
                         (several.is_scene ? "; choose one with --frames"
                                           : " in a folder; compare takes two images or two folders"));
    const fs::path& name = several.asked[0];
    return {{{"", a.one_image ? fs::path() : name, a.one_image ? name : fs::path()}}, {}, {}};
}

}  // namespace

bool names_splat_scene(const fs::path& path) try {
    std::error_code ignored;
    if (fs::is_regular_file(path, ignored))
        format_of_file(path);
    else if (fs::exists(path, ignored))
        return false;
    else
        format_of_name(path);
    return true;
} catch (const InputError&) {
    return false;
}

std::unique_ptr<ComparedSide> image_side(const fs::path& path) {
    return std::make_unique<ImageSide>(path);
}

std::unique_ptr<ComparedSide> scene_side(const fs::path& splats, const SceneViews& views) {
    return std::make_unique<SceneSide>(splats, views);
}

void match_format(ComparedImage& drawn, ComparedImage& other, const std::array<float, 3>& background) {
    if (other.transparent) other.image = over_background(other.image, background);
    Image& image = drawn.image;
    if (other.image.channels == 3) image = without_alpha(image);
    if (other.levels == 0) return;
    const auto levels = float(other.levels);
    for (float& value : image.pixels) value = std::round(std::clamp(value, 0.0f, 1.0f) * levels) / levels;
}

ImagePairs pair_images(const SideNames& a, const SideNames& b) {
    if (a.one_image || b.one_image) return pair_one(a, b);
    std::set<fs::path> left_a = all_names(a), left_b = all_names(b);
    std::vector<std::pair<fs::path, fs::path>> matched;
    match(
        left_a, left_b, [](const fs::path& path) { return path; }, matched);
    match(left_a, left_b, without_extension, matched);
    std::erase_if(matched,
                  [&](const auto& pair) { return !is_asked(a, pair.first) || !is_asked(b, pair.second); });
    std::sort(matched.begin(), matched.end());

    ImagePairs out;
    std::map<fs::path, int> uses;
    for (const auto& pair : matched) ++uses[without_extension(pair.first)];
    for (const auto& [in_a, in_b] : matched) {
        const fs::path stem = without_extension(in_a);
        out.pairs.push_back({(uses[stem] > 1 ? in_a : stem).string(), in_a, in_b});
    }
    std::copy_if(left_a.begin(), left_a.end(), std::back_inserter(out.only_a),
                 [&](const fs::path& name) { return is_asked(a, name); });
    std::copy_if(left_b.begin(), left_b.end(), std::back_inserter(out.only_b),
                 [&](const fs::path& name) { return is_asked(b, name); });
    if (out.pairs.empty())
        throw InputError("no image of " + described(a) + " has the name of one of " + described(b));
    return out;
}

}  // namespace ewa::cli
