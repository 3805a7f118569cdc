// What is asked of a dataset once it is loaded. Loading it is src/io/dataset.cpp.
#include "ewa/dataset.h"

#include <algorithm>
#include <cmath>

#include "core/text.h"
#include "ewa/error.h"
#include "scene/undistort.h"

namespace ewa {

namespace {

/// One value that is not finite would make the loss, and every gradient of its view, not finite.
void check_finite(const Image& image, const std::filesystem::path& path) {
    const auto bad = std::find_if(image.pixels.begin(), image.pixels.end(),
                                  [](float value) { return !std::isfinite(value); });
    if (bad == image.pixels.end()) return;
    const auto pixel = (bad - image.pixels.begin()) / image.channels;
    throw InputError(core::one_line(path.string()) + ": the pixel at column " +
                     std::to_string(pixel % image.width) + ", row " + std::to_string(pixel / image.width) +
                     " holds a value that is not finite; write it as a number, or leave the picture out");
}

}  // namespace

Split split_frames(const Dataset& dataset, int test_every) {
    Split split;
    for (int i = 0; i < int(dataset.frames.size()); ++i) {
        const int own = dataset.frames[size_t(i)].split;
        const bool test = own != 0 ? own == 2 : test_every > 0 && i % test_every == 0;
        (test ? split.test : split.train).push_back(i);
    }
    return split;
}

double scene_extent(const Dataset& dataset, const std::vector<int>& frames) {
    glm::dvec3 mean(0.0);
    for (int i : frames) mean += dataset.frames[size_t(i)].camera.position() / double(frames.size());
    double largest = 0;
    for (int i : frames)
        largest = std::max(largest, glm::length(dataset.frames[size_t(i)].camera.position() - mean));
    return 1.1 * largest;
}

Image load_frame_image(const Frame& frame) {
    Image image = load_image(frame.image_path);
    check_finite(image, frame.image_path);
    if (frame.orientation != 1) image = oriented(image, frame.orientation);
    if (image.width != frame.source.width || image.height != frame.source.height)
        throw InputError(frame.image_path.string() + ": is " + std::to_string(image.width) + " x " +
                         std::to_string(image.height) + " pixels, but its camera has " +
                         std::to_string(frame.source.width) + " x " + std::to_string(frame.source.height));
    if (!frame.distortion.none())
        image = scene::undistort_image(image, frame.source, frame.distortion, frame.pinhole);
    return frame.downscale == 1 ? image : downscale(image, frame.downscale);
}

}  // namespace ewa
