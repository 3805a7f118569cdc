// SPDX-License-Identifier: Apache-2.0
#include "run/pose_options.h"

#include "core/text.h"
#include "run/option_rows.h"
#include "scene/readout.h"

namespace ewa::train {
namespace {

constexpr const char* kNoReadout = "none";

}  // namespace

RunOption refine_poses_option() {
    return later_flag(
        "refine-poses",
        "Learn a small rotation and translation for each training camera. Test cameras are aligned to "
        "their images before they are scored",
        [](RunOptions& o) -> bool& { return o.train.refine_poses; });
}

RunOption refine_focal_option() {
    return later_flag("refine-focal",
                      "With --refine-poses: also learn a factor of each camera's focal lengths",
                      [](RunOptions& o) -> bool& { return o.train.refine_focal; });
}

RunOption rolling_shutter_option() {
    RunOption option{"rolling-shutter", "ORDER",
                     "With --refine-poses: the order in which a rolling shutter reads the images: "
                     "top-to-bottom, bottom-to-top, left-to-right, right-to-left or none. How each camera "
                     "moves meanwhile is learned",
                     kDecides};
    option.get = [](const RunOptions& options) {
        return nlohmann::ordered_json(options.rolling_shutter
                                          ? core::word_for(scene::kReadoutWords, *options.rolling_shutter)
                                          : kNoReadout);
    };
    option.set = [](RunOptions& options, const std::string& text) {
        options.rolling_shutter.reset();
        if (text != kNoReadout) options.rolling_shutter = core::value_of(scene::kReadoutWords, text);
    };
    option.before = kNoReadout;
    return option;
}

LensUse lens_use(const RunOptions& options) {
    const bool rows = options.rolling_shutter && options.lens == LensUse::automatic;
    return rows ? LensUse::native : options.lens;
}

void add_unknown_readouts(const RunOptions& options, Dataset& dataset) {
    if (!options.rolling_shutter) return;
    for (Frame& frame : dataset.frames) {
        const std::string name = "--rolling-shutter: frame \"" + core::one_line(frame.name) + "\"";
        if (frame.distortion != Distortion{})
            throw InputError(name + " is undistorted, which leaves no rows of one time; take --lens native");
        if (frame.camera.readout) continue;
        frame.camera.readout =
            Readout{*options.rolling_shutter, frame.camera.rotation, frame.camera.translation};
        try {
            scene::check_readout_lens(frame.camera);
        } catch (const InputError& error) {
            throw InputError(name + ": " + error.what());
        }
    }
}

}  // namespace ewa::train
