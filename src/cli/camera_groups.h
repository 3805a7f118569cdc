// SPDX-License-Identifier: Apache-2.0
// Summaries of a dataset's cameras, which ewa info prints.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "ewa/dataset.h"

namespace ewa::cli {

/// The names of a lens: `word` in JSON, `text` in a sentence.
struct LensName {
    const char *word, *text;
};

LensName lens_name(const Distortion& lens);

/// The frames that share a size and intrinsics.
struct CameraGroup {
    int frames = 0;
    Camera camera;
    Distortion lens;         // of the image files
    bool distorted = false;  // undistorted on loading
};

/// The groups of the dataset's cameras. The group with the most frames is first.
std::vector<CameraGroup> camera_groups(const Dataset& dataset);

struct Rolling {
    int frames = 0;
    std::string order;                 // that of the first one
    double degrees = 0, distance = 0;  // medians, during a readout; world units
};

/// The rolling shutter of the frames. Empty if no frame has a readout time.
std::optional<Rolling> rolling_of(const Dataset& dataset);

}  // namespace ewa::cli
