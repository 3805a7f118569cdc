// SPDX-License-Identifier: Apache-2.0
// The images, splits and extent of a loaded dataset. src/io/datasets/dataset.cpp loads it.
#include "ewa/dataset.h"

#include <algorithm>
#include <cmath>

#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "scene/camera.h"
#include "scene/lens.h"
#include "scene/mask.h"

namespace ewa {

namespace {

/// The image with its alpha multiplied by the mask. The mask is sampled at the image's
/// size.
Image with_mask(const Image& image, const Image& mask) {
    Image result(image.width, image.height, 4);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            const float* from = image.at(x, y);
            const int column = int((2 * int64_t(x) + 1) * mask.width / (2 * int64_t(image.width)));
            const int row = int((2 * int64_t(y) + 1) * mask.height / (2 * int64_t(image.height)));
            float* to = result.at(x, y);
            std::copy_n(from, 3, to);
            to[3] = *mask.at(column, row) * (image.channels == 4 ? from[3] : 1.0f);
        }
    return result;
}

Image channels_of(const Image& image, int first, int count) {
    Image result(image.width, image.height, count);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) std::copy_n(image.at(x, y) + first, count, result.at(x, y));
    return result;
}

Image load_file(const Frame& frame) {
    Image image = scene::load_finite_image(frame.image_path);
    if (frame.masks == MaskUse::none && image.channels != 3) return channels_of(image, 0, 3);
    if (frame.masks == MaskUse::none || frame.mask_path.empty()) return image;
    return with_mask(image, scene::load_mask(frame.mask_path, read_image_size(frame.image_path)));
}

/// The image with the weights of its pixels as alpha. frame: with left_out.
Image without_left_out(const Image& image, const Frame& frame) {
    check(*frame.left_out);
    if (frame.left_out->channels != 1 || frame.left_out->pixels.empty())
        throw InputError("frame " + frame.name + ": the mask left_out is not an image of one channel");
    const bool cut = frame.masks == MaskUse::cut && frame.behind && image.channels == 4;
    return with_mask(cut ? over_background(image, *frame.behind) : image, *frame.left_out);
}

}  // namespace

TrainingImage load_training_image(const Frame& frame, const std::array<float, 3>& background) {
    const Image image = load_frame_image(frame);
    if (image.channels == 3 || !frame.alpha_weighs()) return {over_background(image, background), {}};
    return {channels_of(image, 0, 3), channels_of(image, 3, 1)};
}

std::string used_text(const Dataset& dataset) {
    std::string text;
    for (const UsedOf& kind : dataset.used) {
        // Points and models are many or one, and nearly always used.
        const bool all = kind.used == kind.found && kind.what != "photo" && kind.what != "mask" &&
                         kind.what != "depth map";
        text += (text.empty() ? "" : ", ") + (all ? "" : std::to_string(kind.used) + " of ") +
                core::counted(kind.found, kind.what);
        if (!kind.where.empty()) text += " in " + kind.where;
        if (!kind.why.empty()) text += " (" + kind.why + ")";
    }
    return text;
}

Split split_frames(const Dataset& dataset, int test_every) {
    Split split;
    for (int i = 0; i < int(dataset.frames.size()); ++i) {
        const int own = dataset.frames[size_t(i)].split;
        const bool test = own != 0 ? own == 2 : test_every > 0 && i % test_every == 0;
        (test ? split.test : split.train).push_back(i);
    }
    if (test_every == 0 && split.train.empty()) std::swap(split.train, split.test);
    return split;
}

void check(const Dataset& dataset, const std::vector<int>& frames) {
    for (const int i : frames)
        if (i < 0 || size_t(i) >= dataset.frames.size())
            throw InputError("there is no frame " + std::to_string(i) + " in a dataset of " +
                             std::to_string(dataset.frames.size()));
}

double scene_extent(const Dataset& dataset, const std::vector<int>& frames) {
    check(dataset, frames);
    glm::dvec3 mean(0.0);
    for (int i : frames) mean += dataset.frames[size_t(i)].camera.position() / double(frames.size());
    double largest = 0;
    for (int i : frames)
        largest = std::max(largest, glm::length(dataset.frames[size_t(i)].camera.position() - mean));
    return 1.1 * largest;
}

Image load_frame_image(const Frame& frame) {
    Image image = load_file(frame);
    if (frame.orientation != 1) image = oriented(image, frame.orientation);
    if (frame.reduced && image.width >= frame.source.width && image.height >= frame.source.height)
        image = reduced(image, frame.source.width, frame.source.height);
    if (image.width != frame.source.width || image.height != frame.source.height)
        throw InputError(frame.image_path.string() + ": is " + std::to_string(image.width) + " x " +
                         std::to_string(image.height) + " pixels, but its camera has " +
                         std::to_string(frame.source.width) + " x " + std::to_string(frame.source.height));
    if (!frame.distortion.none())
        image = scene::undistort_image(image, frame.source, frame.distortion, frame.pinhole);
    if (frame.downscale != 1) image = downscale(image, frame.downscale);
    if (frame.left_out) return without_left_out(image, frame);
    return image;
}

}  // namespace ewa
