// SPDX-License-Identifier: Apache-2.0
// Held-out views with a PSNR far below the others, whose cameras may be wrong.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "ewa/camera.h"

namespace ewa::train {

/// The PSNR of a held-out view, dB, with the render's colours fitted to the image.
struct ViewFigure {
    int frame = 0;  // index into Dataset::frames
    double psnr = 0;
};

/// At most three views whose PSNR is far below the median of all and below that of the training views, the worst first. Empty if
/// `views` has fewer than three.
std::vector<ViewFigure> far_below(std::vector<ViewFigure> views, double train_psnr);

/// A view with a PSNR far below the others, and its PSNR after its camera was aligned to its image.
struct DoubtfulView {
    std::string name;
    double psnr = 0, moved_psnr = 0;  // dB
    double degrees = 0;               // by which the alignment turns the camera
    double share = 0;                 // by which it moves the centre, of the scene extent
};

/// A line for the user on these views. usual: the median PSNR of all held-out views, dB. Empty if `views` is empty.
std::string wrong_cameras_text(const std::vector<DoubtfulView>& views, double usual);

}  // namespace ewa::train
