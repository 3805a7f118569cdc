// SPDX-License-Identifier: Apache-2.0
// What ewa compare is given on either side: a picture, a folder of pictures, or a splat scene.
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

/// A picture, and how its file holds such things.
struct ComparedPicture {
    Image image;               // 3 or 4 channels
    int levels = 0;            // above 0 that a value may have, where they are whole numbers; else 0
    bool see_through = false;  // the colour of 4 channels is that in front of no background, as in PNG
};

/// The names of a side's pictures.
struct SideNames {
    std::string side;  // what messages call it
    bool one_picture = false;
    bool is_scene = false;                     // whose pictures are drawn here
    std::vector<std::filesystem::path> asked;  // relative to the side, with extension; empty of one picture
    std::vector<std::filesystem::path> other;  // what it could also show and was not asked to
};

class ComparedSide {
  public:
    virtual ~ComparedSide() = default;

    virtual const SideNames& names() const = 0;

    /// What messages call one of them.
    virtual std::string place(const std::filesystem::path& name) const = 0;

    /// One of SideNames::asked. Throws InputError.
    virtual ComparedPicture picture(const std::filesystem::path& name) = 0;

    /// The most splats that a picture so far left out because a value of theirs is not finite.
    virtual uint32_t skipped_splats() const = 0;
};

/// Whether a side is a splat scene: by what the file begins with; by its name where that does not tell, or it
/// is not there.
bool names_splat_scene(const std::filesystem::path& path);

/// Throws InputError where there is no such picture or folder.
std::unique_ptr<ComparedSide> picture_side(const std::filesystem::path& path);

/// How scenes are drawn.
struct SceneViews {
    Dataset cameras;
    std::vector<int> frames;  // of them
    RenderOptions options;
    std::shared_ptr<gpu::Device> device;
};

/// The scene as `ewa render --format exr` would write it: floating point, with alpha, by the same names. Each
/// picture is drawn when it is asked for. Throws InputError for what is no scene, RunError where it does not
/// fit in the device's memory.
std::unique_ptr<ComparedSide> scene_side(const std::filesystem::path& splats, const SceneViews& views);

/// Makes of what was drawn what the other picture's file would hold of it: alpha only where that has one,
/// clamped and rounded where that has whole numbers. Where that can be seen through it is laid over the
/// background that was drawn over.
void adapt_drawn(ComparedPicture& drawn, ComparedPicture& other, const std::array<float, 3>& background);

}  // namespace ewa::cli
