// SPDX-License-Identifier: Apache-2.0
// The inputs of ewa compare: an image, a folder of images or a splat scene on each side, and their pairs.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/device.h"
#include "ewa/image.h"
#include "ewa/render_options.h"

namespace ewa::cli {

/// An image, and how its file stores values.
struct ComparedImage {
    Image image;               // 3 or 4 channels
    int levels = 0;            // largest stored value of integer formats; 0: floating point
    bool transparent = false;  // 4 channels whose colour is not multiplied by alpha, as in PNG
};

/// The names of a side's images.
struct SideNames {
    std::string side;  // its name in messages
    bool one_image = false;
    bool is_scene = false;                     // its images are rendered
    std::vector<std::filesystem::path> asked;  // relative to the side, with extension; empty for one image
    std::vector<std::filesystem::path> other;  // images it has that --frames does not select
};

class ComparedSide {
  public:
    virtual ~ComparedSide() = default;

    virtual const SideNames& names() const = 0;

    /// The name of an image in messages.
    virtual std::string place(const std::filesystem::path& name) const = 0;

    /// One of SideNames::asked. Throws InputError.
    virtual ComparedImage picture(const std::filesystem::path& name) = 0;

    /// The most splats that a render skipped so far because a value was not finite.
    virtual uint32_t skipped_splats() const = 0;
};

/// Whether the path names a splat scene: by the first bytes of the file, else by its name.
bool names_splat_scene(const std::filesystem::path& path);

/// Throws InputError if there is no such image or folder.
std::unique_ptr<ComparedSide> image_side(const std::filesystem::path& path);

/// How splat scenes are rendered.
struct SceneViews {
    Dataset cameras;
    std::vector<int> frames;  // indices of cameras.frames
    RenderOptions options;
    std::shared_ptr<gpu::Device> device;
};

/// The scene as `ewa render --format exr` writes it: float32 with alpha, under the same names. Renders an
/// image when it is asked for. Throws InputError if the file is no splat scene, RunError if it exceeds the
/// device's memory.
std::unique_ptr<ComparedSide> scene_side(const std::filesystem::path& splats, const SceneViews& views);

/// Converts a render to what the file of the other image could store: without alpha if the other has none,
/// clamped and rounded if the other holds integers. A transparent other image is blended over the background.
void match_format(ComparedImage& drawn, ComparedImage& other, const std::array<float, 3>& background);

struct ImagePair {
    std::string name;  // without extension; empty for two files
    std::filesystem::path a, b;
};

struct ImagePairs {
    std::vector<ImagePair> pairs;               // at least one
    std::vector<std::filesystem::path> only_a;  // selected images without a partner
    std::vector<std::filesystem::path> only_b;
};

/// Pairs images of equal names, then images whose names differ in the extension only. An image that --frames
/// does not select is skipped together with its partner. A single image pairs with a single image, or with
/// the only selected image of a scene. Throws InputError if no pair remains.
ImagePairs pair_images(const SideNames& a, const SideNames& b);

}  // namespace ewa::cli
