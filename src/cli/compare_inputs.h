// SPDX-License-Identifier: Apache-2.0
// The inputs of ewa compare: an image, a folder of images or a splat scene on each side, and their pairs.
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "cli/arguments.h"
#include "ewa/image.h"

namespace ewa::cli {

/// An image, and how its file stores values.
struct ComparedImage {
    Image image;               // 3 or 4 channels
    int levels = 0;            // largest stored value of integer formats; 0: floating point
    bool transparent = false;  // 4 channels whose colour is not multiplied by alpha, as in PNG
};

/// The images of one side.
struct ComparedSide {
    virtual ~ComparedSide() = default;
    /// The name of an image in messages.
    virtual std::string place(const std::filesystem::path& name) const = 0;
    /// One of `asked`. Throws InputError.
    virtual ComparedImage picture(const std::filesystem::path& name) = 0;

    std::string side;  // its name in messages
    bool one_image = false;
    bool is_scene = false;                     // its images are rendered
    std::vector<std::filesystem::path> asked;  // relative to the side, with extension; empty for one image
    std::vector<std::filesystem::path> other;  // images of this side that --frames does not select
    uint32_t skipped_splats = 0;  // the most that a render skipped so far because a value was not finite
    std::string undrawable;       // why they are skipped
};

struct CompareInputs {
    std::filesystem::path a, b;
    // How splat scenes are rendered.
    std::filesystem::path cameras;
    std::filesystem::path refined_a, refined_b;  // cameras.json of the run of each side; empty: none
    std::string frames = "all";
    int test_every = 8;
    RunOptions run;  // --downscale, --max-width and --lens
    DrawArguments draw;
    DeviceOptions device;
};

struct Sides {
    std::unique_ptr<ComparedSide> a, b;
    Dataset cameras;  // for splat scenes
    RenderOptions options;
};

/// Replaces folders of training runs by the runs' splats. The first run sets --cameras and the options of use_options_of(),
/// unless the command line has them. Without --cameras, each run is rendered through its own refined cameras. Other
/// splats are rendered through those of the first run. A folder of images stays as it is. Throws InputError, also if two
/// runs differ in --kernel or --background.
void resolve_runs(CLI::App& app, CompareInputs& inputs);

/// Opens both sides. A file's first bytes tell whether it is a splat scene; if they do not, its name does. A scene is
/// rendered when an image is requested, as `ewa render --format exr` does: float32 with alpha, under the same names.
/// Throws InputError (no such image or folder, a scene without --cameras), RunError if a scene exceeds the device's memory.
Sides open_sides(const CompareInputs& inputs);

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
ImagePairs pair_images(const ComparedSide& a, const ComparedSide& b);

}  // namespace ewa::cli
