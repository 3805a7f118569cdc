// SPDX-License-Identifier: Apache-2.0
#include "cli/capture_progress.h"

#include <spdlog/fmt/fmt.h>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/text.h"
#include "ewa/device.h"
#include "run/forecast.h"

namespace ewa::cli {
namespace {

// Costs on the machine of docs/performance.md, used until this machine has measured its own.
constexpr double kSearchPerPixel = 0.8e-6;  // s
constexpr double kPointsPerPixel = 0.1;     // first splats, of the pixels of one photo

}  // namespace

void CaptureProgressLine::update(const CaptureProgress& now) {
    if (!now.note.empty()) progress_.note(now.note);
    if (now.total < 1) return;
    if (now.phase != phase_ || now.what != what_) {
        phase_ = now.phase;
        what_ = now.what;
        total_ = now.total;
        progress_.begin(now.what, now.total, now.unit);
        progress_.skip(now.done);  // an interrupted search continues
        if (now.unit == "photos" || now.what == "extracted") photos_ = now.total;
        if (const int photos = photos_; photos > 0 && before_)
            progress_.note(std::exchange(before_, {})(photos));
    }
    // A video may have more frames than its header says.
    if (now.total != total_) progress_.set_total(total_ = now.total);
    progress_.set_left(now.left < 0 ? std::nullopt : std::optional(now.left));
    if (after_ && now.photo_seconds > 0) progress_.set_rest(after_(photos_, now.photo_seconds));
    progress_.update(now.done);
}

CaptureProgressLine::After training_after(const RunOptions& options) {
    const bool on_cpu = device_info(*open_device(options.device)).type == "cpu";
    return [train = options.train, on_cpu, shrink = double(options.downscale) * options.downscale](
               int photos, double search) {
        const double pixels = search / kSearchPerPixel / shrink;
        const double splats = std::min(kPointsPerPixel * pixels, 1e9);
        return train::usual_seconds({.pixels = pixels,
                                     .photos = size_t(photos),
                                     .splats = uint32_t(splats),
                                     .evaluated = size_t(std::min(photos, 40))},
                                    train, on_cpu);
    };
}

CaptureProgressLine::Before advice_before(const RunOptions& options, const ImageSize& size,
                                          CaptureProgressLine::After training) {
    constexpr int kShortRun = 2000;  // steps of --quality low
    if (options.train.steps <= kShortRun || size.width < 1 ||
        device_info(*open_device(options.device)).type != "cpu")
        return {};
    return [=, steps = options.train.steps](int photos) {
        const double widest =
            options.max_width > 0 ? double(options.max_width) * options.downscale : size.width;
        const double scale = std::min(1.0, widest / size.width);
        const double search = kSearchPerPixel * size.width * size.height * scale * scale;
        RunOptions shorter = options;
        shorter.train.steps = kShortRun;
        return fmt::format(
            "{} steps take about {} on a processor; --quality low takes about {} for a first look", steps,
            core::duration_text(training(photos, search)),
            core::duration_text(training_after(shorter)(photos, search)));
    };
}

}  // namespace ewa::cli
