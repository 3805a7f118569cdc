// SPDX-License-Identifier: Apache-2.0
#include "cli/compared_side.h"

#include <algorithm>
#include <cmath>
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

class PictureSide : public ComparedSide {
  public:
    explicit PictureSide(const fs::path& path) : path_(path) {
        std::error_code ignored;
        names_.side = path.string();
        names_.one_picture = !fs::is_directory(path, ignored);
        if (names_.one_picture)
            read_image_size(path);  // for its complaint where there is no such picture
        else
            names_.asked = image::images_below(path);
    }
    const SideNames& names() const override { return names_; }
    std::string place(const fs::path& name) const override { return file(name).string(); }
    ComparedPicture picture(const fs::path& name) override {
        ComparedPicture picture{load_image(file(name))};
        const std::string_view format = image::format_name(file(name));
        if (read_image_size(file(name)).eight_bit)
            picture.levels = 255;
        else if (format == "png")
            picture.levels = 65535;
        picture.see_through = picture.image.channels == 4 && format != "openexr";
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
        return names_.side + ", picture " + fs::path(name).replace_extension().string();
    }
    ComparedPicture picture(const fs::path& name) override {
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

std::unique_ptr<ComparedSide> picture_side(const fs::path& path) {
    return std::make_unique<PictureSide>(path);
}

std::unique_ptr<ComparedSide> scene_side(const fs::path& splats, const SceneViews& views) {
    return std::make_unique<SceneSide>(splats, views);
}

void adapt_drawn(ComparedPicture& drawn, ComparedPicture& other, const std::array<float, 3>& background) {
    if (other.see_through) other.image = over_background(other.image, background);
    Image& image = drawn.image;
    if (other.image.channels == 3) image = without_alpha(image);
    if (other.levels == 0) return;
    const auto levels = float(other.levels);
    for (float& value : image.pixels) value = std::round(std::clamp(value, 0.0f, 1.0f) * levels) / levels;
}

}  // namespace ewa::cli
