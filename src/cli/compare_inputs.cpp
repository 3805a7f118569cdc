// SPDX-License-Identifier: Apache-2.0
#include "cli/compare_inputs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <set>

#include "cli/run_inputs.h"
#include "ewa/error.h"
#include "ewa/renderer.h"
#include "ewa/splat_files.h"
#include "image/image_files.h"
#include "io/datasets/refined_cameras.h"
#include "report/pictures.h"
#include "scene/splat_arrays.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

struct ImageSide : ComparedSide {
    explicit ImageSide(const fs::path& path) : path_(path) {
        std::error_code ignored;
        side = path.string();
        one_image = !fs::is_directory(path, ignored);
        if (one_image)
            read_image_size(path);  // throws if there is no such image
        else
            asked = image::images_below(path);
    }
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

  private:
    fs::path file(const fs::path& name) const { return name.empty() ? path_ : path_ / name; }

    fs::path path_;
};

struct SceneSide : ComparedSide {
    /// frames: indices of sides.cameras.frames.
    /// refined: a cameras.json to draw through; empty: through the dataset's cameras.
    SceneSide(const fs::path& splats, const fs::path& refined, const Sides& sides,
              const std::vector<int>& frames, const DrawArguments& draw,
              const std::shared_ptr<gpu::Device>& device)
        : renderer_(renderer_of(splats, sides.options, draw, device, undrawable)) {
        side = splats.string();
        is_scene = true;
        Dataset cameras = sides.cameras;
        if (!refined.empty()) io::use_refined_cameras(cameras, refined);
        const std::vector<fs::path> stems = report::picture_names(cameras.frames);
        const std::set<int> wanted(frames.begin(), frames.end());
        for (int frame = 0; frame < int(stems.size()); ++frame) {
            const fs::path name = stems[size_t(frame)].string() + ".exr";
            (wanted.contains(frame) ? asked : other).push_back(name);
            cameras_[name] = cameras.frames[size_t(frame)].camera;
        }
    }
    std::string place(const fs::path& name) const override {
        return side + ", image " + fs::path(name).replace_extension().string();
    }
    ComparedImage picture(const fs::path& name) override {
        const Rendering rendering = renderer_.render(cameras_.at(name));
        skipped_splats = std::max(skipped_splats, renderer_.skipped_nonfinite());
        return {with_alpha(rendering.color, rendering.alpha)};
    }

  private:
    static Renderer renderer_of(const fs::path& path, RenderOptions options, const DrawArguments& draw,
                                const std::shared_ptr<gpu::Device>& device, std::string& undrawable) {
        const Gaussians gaussians = draw.load(path, options);
        undrawable = scene::undrawable_text(gaussians);
        return {device, gaussians, options};
    }

    Renderer renderer_;
    std::map<fs::path, Camera> cameras_;
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

std::set<fs::path> all_names(const ComparedSide& side) {
    std::set<fs::path> names(side.asked.begin(), side.asked.end());
    names.insert(side.other.begin(), side.other.end());
    return names;
}

bool is_asked(const ComparedSide& side, const fs::path& name) {
    return std::find(side.other.begin(), side.other.end(), name) == side.other.end();
}

/// The side with its number of images and the name of one.
std::string described(const ComparedSide& side) {
    const size_t count = side.asked.size();
    return side.side + " (" + std::to_string(count) + (count == 1 ? " image" : " images") +
           (count == 0 ? "" : ", " + without_extension(side.asked[0]).string()) + ")";
}

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

ImagePairs pair_one(const ComparedSide& a, const ComparedSide& b) {
    if (a.one_image && b.one_image) return {{{"", {}, {}}}, {}, {}};
    const ComparedSide &one = a.one_image ? a : b, &several = a.one_image ? b : a;
    if (!several.is_scene || several.asked.size() != 1)
        throw InputError(one.side + " is one image and " + several.side + " has " +
                         std::to_string(several.asked.size()) +
                         (several.is_scene ? "; choose one with --frames"
                                           : " in a folder; compare takes two images or two folders"));
    const fs::path& name = several.asked[0];
    return {{{"", a.one_image ? fs::path() : name, a.one_image ? name : fs::path()}}, {}, {}};
}

}  // namespace

void resolve_runs(CLI::App& app, CompareInputs& inputs) {
    std::optional<folders::Run> first;
    std::array<std::optional<fs::path>, 2> refined;
    for (const size_t i : {size_t(0), size_t(1)}) {
        fs::path& side = i == 0 ? inputs.a : inputs.b;
        if (!names_run_with_splats(side)) continue;
        const SplatInput input = splat_input(side);
        side = input.file;
        if (!first) first = input.run;
        if (inputs.cameras.empty()) refined[i] = refined_cameras_of(*input.run);
        // With noise, what a run learned looks the same over any background.
        const bool opaque =
            first->config.contains("background-noise") && input.run->config.contains("background-noise");
        for (const char* option : {"kernel", "background"})
            if (first->text(option) != input.run->text(option) &&
                !(opaque && std::string_view(option) == "background") &&
                app.get_option("--" + std::string(option))->empty())
                throw InputError(first->folder.string() + " and " + input.run->folder.string() +
                                 " were trained with another --" + option +
                                 "; choose one with --cameras DATASET --" + option);
        if (first->flag("points") != input.run->flag("points") && app.count("--points") == 0 &&
            app.count("--kernel") == 0)
            throw InputError(first->folder.string() + " and " + input.run->folder.string() +
                             ": one was trained with --points; choose how both are drawn, with --points or "
                             "--kernel peak");
    }
    if (!first) return;
    const fs::path of_first = refined[0] ? *refined[0] : refined[1].value_or(fs::path());
    inputs.refined_a = refined[0].value_or(of_first);
    inputs.refined_b = refined[1].value_or(of_first);
    const fs::path other = inputs.cameras;
    if (inputs.cameras.empty()) inputs.cameras = dataset_of(*first);
    use_options_of(*first, app, other);
}

Sides open_sides(const CompareInputs& inputs) {
    Sides sides;
    const bool scene_a = names_splat_scene(inputs.a), scene_b = names_splat_scene(inputs.b);
    const bool scene = scene_a || scene_b;
    if (!scene && !inputs.cameras.empty())
        throw InputError("--cameras: neither " + inputs.a.string() + " nor " + inputs.b.string() +
                         " is a splat scene");
    if (scene && inputs.cameras.empty())
        throw InputError((scene_a ? inputs.a : inputs.b).string() +
                         " is a splat scene; --cameras DATASET names the cameras to render it through");
    // Images first: their errors are found without rendering.
    if (!scene_a) sides.a = std::make_unique<ImageSide>(inputs.a);
    if (!scene_b) sides.b = std::make_unique<ImageSide>(inputs.b);
    if (!scene) return sides;
    sides.options = inputs.draw.options();
    sides.cameras = load_cameras_as_trained(inputs.cameras, inputs.run);
    const std::vector<int> frames = select_frames(sides.cameras, inputs.frames, inputs.test_every);
    const auto device = open_device(inputs.device);
    if (scene_a)
        sides.a = std::make_unique<SceneSide>(inputs.a, inputs.refined_a, sides, frames, inputs.draw, device);
    if (scene_b)
        sides.b = std::make_unique<SceneSide>(inputs.b, inputs.refined_b, sides, frames, inputs.draw, device);
    return sides;
}

void match_format(ComparedImage& drawn, ComparedImage& other, const std::array<float, 3>& background) {
    if (other.transparent) other.image = over_background(other.image, background);
    Image& image = drawn.image;
    if (other.image.channels == 3) image = without_alpha(image);
    if (other.levels == 0) return;
    const auto levels = float(other.levels);
    for (float& value : image.pixels) value = std::round(std::clamp(value, 0.0f, 1.0f) * levels) / levels;
}

ImagePairs pair_images(const ComparedSide& a, const ComparedSide& b) {
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
