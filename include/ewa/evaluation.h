// SPDX-License-Identifier: Apache-2.0
// How close renders of a scene are to a dataset's images.
#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "ewa/appearance.h"
#include "ewa/dataset.h"
#include "ewa/device.h"
#include "ewa/gaussians.h"
#include "ewa/metrics.h"
#include "ewa/render_options.h"

namespace ewa {

/// The figures of one frame.
struct EvalFrame {
    std::string name;  // Frame::name
    double psnr = 0;   // dB
    double ssim = 0;
    std::vector<Figure> figures;  // of Measures::meter
};

/// How renders and images are compared. docs/figures.md describes each protocol.
enum class Protocol {
    ewa,            // values as they are
    nerfbaselines,  // as NeRFBaselines: 8-bit values, SSIM without the image's rim
    inria  // as the evaluation of 3D Gaussian Splatting by INRIA: 8-bit values, images resized as Pillow does
};

/// The protocol of an evaluation, and its metrics beside PSNR and SSIM.
struct Measures {
    Protocol protocol = Protocol::ewa;
    Meter meter;
};

/// The figures of an evaluation.
struct Evaluation {
    double psnr = 0, ssim = 0;    // dB and 1; means over `frames`, NaN without any
    std::vector<Figure> figures;  // means; NaN if a frame has NaN
    std::vector<EvalFrame> frames;
    double seconds = 0;  // wall time
};

/// Renders frames of the dataset and compares each with its image. Values are clamped to [0, 1]. Pixels with
/// weight 0 do not count, and a frame without any other pixel is skipped.
/// frames: indices into dataset.frames.
/// appearances: applied to the renders, one for each of `frames` in the same order; or empty.
/// before_frame: called before each frame; an exception from it ends the evaluation.
/// Throws InputError (an image that cannot be read or changed its size, arrays of a wrong length, frames that the dataset
/// lacks), RunError (device).
Evaluation evaluate(std::shared_ptr<gpu::Device> device, const Gaussians& gaussians, const Dataset& dataset,
                    const std::vector<int>& frames, const RenderOptions& options,
                    const std::vector<Appearance>& appearances = {},
                    const std::function<void()>& before_frame = {}, const Measures& measures = {});

}  // namespace ewa
