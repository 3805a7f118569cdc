// SPDX-License-Identifier: Apache-2.0
#include "run/first_checks.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <glm/matrix.hpp>
#include <map>
#include <optional>

#include "core/parallel.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "image/image_files.h"
#include "scene/frame_images.h"
#include "scene/frustum.h"
#include "scene/mask.h"
#include "scene/native_lens.h"
#include "scene/readout.h"

namespace ewa::train {
namespace {

/// The frame with the pixels of its file: undistortion and downscaling find no damage.
Frame as_stored(Frame frame) {
    frame.distortion = {};
    frame.downscale = 1;
    frame.left_out.reset();
    return frame;
}

bool has_value(const Image& image, int channel) {
    for (size_t i = size_t(channel); i < image.pixels.size(); i += size_t(image.channels))
        if (image.pixels[i] > 0) return true;
    return false;
}

/// Whether a pixel is neither masked nor transparent.
bool shows_something(const Image& image) {
    return image.channels != 4 || has_value(image, 3);
}

/// The same of a frame, whose image is read only where it may have alpha.
bool shows_something(const Frame& frame) {
    if (frame.masks == MaskUse::none || !frame.image_exists) return true;
    if (!frame.mask_path.empty()) return has_value(scene::load_mask(frame.mask_path), 0);
    return image::format_name(frame.image_path) == "jpeg" ||
           shows_something(load_frame_image(as_stored(frame)));
}

std::string and_more(size_t count) {
    return count > 1 ? fmt::format(", and {} more", count - 1) : std::string();
}

std::optional<Finding> nothing_shown(const Dataset& dataset, const std::vector<int>& frames,
                                     const char* images, const char* effect) {
    if (frames.empty()) return std::nullopt;
    for (const int i : frames)
        if (shows_something(dataset.frames[size_t(i)])) return std::nullopt;
    return Finding{fmt::format(
        "every pixel of {} is masked or transparent, and {}; masks are white where an image counts",
        core::counted(frames.size(), images), effect)};
}

/// The held-out images, as the evaluation reads them.
std::optional<Finding> damaged_held_out(const Dataset& dataset, const std::vector<int>& frames) {
    const std::vector<const Frame*> each = scene::frames_at(dataset, frames);
    std::vector<std::string> faults(each.size());
    core::on_all_cores(
        each.size(),
        [&](size_t k) {
            try {
                load_frame_image(as_stored(*each[k]));
            } catch (const InputError& error) {
                faults[k] = error.what();
            }
        },
        scene::images_at_once(each));
    std::erase(faults, std::string());
    if (faults.empty()) return std::nullopt;
    return Finding{faults[0] + "; it is held out for the evaluation" + and_more(faults.size()), true};
}

std::optional<Finding> damaged_files(const Dataset& dataset) {
    std::vector<std::string> faults;
    for (const Frame& frame : dataset.frames) {
        if (!frame.image_exists || image::ends_as_an_image(frame.image_path)) continue;
        const std::string fault = image::image_fault(frame.image_path);
        if (!fault.empty())
            faults.push_back(core::one_line(frame.name) +
                             " cannot be read: " + std::string(core::trim(fault)));
    }
    if (faults.empty()) return std::nullopt;
    return Finding{faults[0] + and_more(faults.size()), true};
}

/// Masks of another shape than their images, and those that cannot be read. One is decoded where there are many.
std::optional<Finding> bad_masks(const Dataset& dataset) {
    constexpr size_t kMostPixels = 20'000'000;
    std::map<std::filesystem::path, ImageSize> sizes;
    std::vector<std::string> faults;
    const auto try_mask = [&](const std::function<void()>& work) {
        try {
            work();
        } catch (const InputError& error) {
            faults.emplace_back(error.what());
        }
    };
    size_t pixels = 0;
    for (const Frame& frame : dataset.frames)
        if (frame.masks != MaskUse::none && !frame.mask_path.empty() && frame.image_exists)
            try_mask([&] {
                const auto [at, is_new] = sizes.try_emplace(frame.mask_path);
                if (is_new) at->second = read_image_size(frame.mask_path);
                if (at->second.width > 0)
                    scene::mask_turn(frame.mask_path, at->second, read_image_size(frame.image_path));
                pixels += is_new ? size_t(at->second.width) * size_t(at->second.height) : 0;
            });
    size_t decoded = pixels > kMostPixels ? 1 : sizes.size();
    for (const auto& [path, size] : sizes)
        if (size.width > 0 && decoded > 0) {
            try_mask([&] { scene::load_mask(path); });
            --decoded;
        }
    if (faults.empty()) return std::nullopt;
    return Finding{faults[0] + and_more(faults.size()), true};
}

/// Another meaning of the poses in a file.
struct OtherPoses {
    const char* what;
    void (*apply)(Camera& camera);
};
constexpr std::array kOtherPoses{
    OtherPoses{"y and z of the cameras' axes reversed, as OpenGL's are of OpenCV's",
               [](Camera& c) {
                   const glm::dmat3 reversed(1, 0, 0, 0, -1, 0, 0, 0, -1);
                   c.rotation = reversed * c.rotation;
                   c.translation = reversed * c.translation;
               }},
    OtherPoses{"the poses inverted, from the camera to the world or back", [](Camera& c) {
                   c.rotation = glm::transpose(c.rotation);
                   c.translation = -(c.rotation * c.translation);
               }}};

/// At most `most` of the values at(0) to at(count - 1), evenly spread.
template <class At>
auto some_of(size_t count, size_t most, const At& at) {
    std::vector<decltype(at(count))> some;
    for (size_t i = 0, taken = std::min(count, most); i < taken; ++i) some.push_back(at(i * count / taken));
    return some;
}

/// The share of the places that at least one camera shows. other: changes the cameras; null: nothing does.
double share_in_view(const Dataset& dataset, const std::vector<int>& frames, const FirstPlaces& places,
                     const OtherPoses* other) {
    constexpr size_t kMostPlaces = 2000, kMostCameras = 500;
    const std::vector<glm::dvec3> tried = some_of(places.count, kMostPlaces, places.at);
    std::vector<char> seen(tried.size());
    for (const int i : some_of(frames.size(), kMostCameras, [&](size_t k) { return frames[k]; })) {
        Camera camera = scene::at_middle(dataset.frames[size_t(i)].camera);
        if (other) other->apply(camera);
        const double limit = scene::lens_limit(camera);
        for (size_t k = 0; k < tried.size(); ++k) {
            if (seen[k]) continue;
            const glm::dvec3 point = camera.rotation * tried[k] + camera.translation;
            const auto pixel = scene::pixel_of(camera, limit, point);
            seen[k] = pixel && pixel->x >= 0 && pixel->x <= camera.width && pixel->y >= 0 &&
                      pixel->y <= camera.height;
        }
    }
    return double(std::ranges::count(seen, 1)) / double(tried.size());
}

std::optional<Finding> out_of_view(const Dataset& dataset, const std::vector<int>& frames,
                                   const FirstPlaces& places) {
    // Points that were reconstructed from the images are all in view. Splats of a larger scene are partly so.
    constexpr double kFew = 0.05, kSurprising = 0.1, kMost = 0.5;
    const double share = share_in_view(dataset, frames, places, nullptr);
    if (share >= kSurprising) return std::nullopt;
    std::string better;
    for (const OtherPoses& other : kOtherPoses)
        if (better.empty() && share_in_view(dataset, frames, places, &other) >= kMost)
            better = fmt::format("; with {}, they would be", other.what);
    if (share > 0 && better.empty() && (places.file.empty() || share >= kFew)) return std::nullopt;
    const std::string what =
        places.file.empty() ? "points" : "first splats of " + core::one_line(places.file);
    const std::string count = share > 0 ? fmt::format("only {:.1f} % of the {} are", 100 * share, what)
                                        : fmt::format("none of the {} is", what);
    return Finding{count + " in view of a training camera: " +
                   (places.file.empty() || !better.empty()
                        ? "the axes or the direction of the poses are probably wrong"
                        : "they are probably of another scene") +
                   better};
}

std::optional<Finding> too_few(const FirstPlaces& places) {
    constexpr size_t kFewest = 10;
    if (places.count >= kFewest) return std::nullopt;
    return Finding{fmt::format("training starts from {}{}; --init random starts from many in view",
                               core::counted(places.count, places.file.empty() ? "point" : "splat"),
                               places.file.empty() ? "" : " of " + core::one_line(places.file))};
}

std::vector<Finding> found(std::initializer_list<std::optional<Finding>> all) {
    std::vector<Finding> findings;
    for (const std::optional<Finding>& one : all)
        if (one) findings.push_back(*one);
    return findings;
}

}  // namespace

std::string nothing_to_train_on(const Dataset& dataset, const Split& split) {
    if (!split.train.empty()) return {};
    const bool own = std::ranges::all_of(dataset.frames, [](const Frame& frame) { return frame.split == 2; });
    return fmt::format("{} {} held out, and none is left to train on{}; {}",
                       core::counted(dataset.frames.size(), "image"), core::is_or_are(dataset.frames.size()),
                       dataset.missing_images > 0 ? fmt::format(" ({} missing)", dataset.missing_images) : "",
                       own ? "the dataset itself says so; --test-every 0 trains on all of them"
                           : "--test-every 0 holds none out");
}

std::vector<Finding> check_images(const Dataset& dataset, const Split& split, bool decode) try {
    std::vector<int> weighed;
    for (const int i : split.test)
        if (dataset.frames[size_t(i)].alpha_weighs()) weighed.push_back(i);
    if (weighed.size() < split.test.size()) weighed.clear();
    return found({bad_masks(dataset), decode ? damaged_held_out(dataset, split.test) : damaged_files(dataset),
                  nothing_shown(dataset, split.train, "training image", "nothing is learned from them"),
                  nothing_shown(dataset, weighed, "held-out image", "no figure is measured")});
} catch (const InputError& error) {
    return {{error.what(), true}};
}

std::vector<Finding> check_start(const Dataset& dataset, const std::vector<int>& frames,
                                 const FirstPlaces& places) {
    if (places.count == 0 || frames.empty()) return {};
    return found({out_of_view(dataset, frames, places), too_few(places)});
}

}  // namespace ewa::train
