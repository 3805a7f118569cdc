// SPDX-License-Identifier: Apache-2.0
#include "cli/capture_progress.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "ewa/device.h"
#include "run/forecast.h"

namespace ewa::cli {
namespace {

// Seconds by those to search a photo, from photos of 270x480 and 540x960. Photos with twice the details take twice the time to
// search, and four times to compare.
double seconds_of_pair(double search) {
    constexpr double kMostDetails = 0.2;  // COLMAP keeps 8,192 details of a photo
    return std::min(kMostDetails, 0.24 * std::pow(search, 1.75));
}
double seconds_to_place(double search) {
    return 1.05 * std::pow(search, 0.8);
}

constexpr double kInSequence = 19, kByLook = 7;  // pairs by photo
constexpr int kMostByLook = 1000;                // photos, with Matching::automatic
// Costs on the machine of docs/performance.md, used until this machine has measured its own.
constexpr double kSearchPerPixel = 0.8e-6;  // s
constexpr double kPointsPerPixel = 0.1;     // first splats, of the pixels of one photo

}  // namespace

/// Seconds of the parts after this one.
double CaptureProgressLine::rest() const {
    const double after = after_ ? after_(photos_, search_seconds_) : 0;
    if (phase_ == CapturePhase::cameras) return after;
    const double placing = photos_ * seconds_to_place(search_seconds_) + after;
    if (phase_ == CapturePhase::matches && (what_ == "matched" || what_ == "verified")) return placing;
    const bool automatic = matching_ == Matching::automatic;
    double each = (photos_ - 1) / 2.0;
    if (automatic && photos_ <= kMostByLook)
        each = std::min(each, kByLook);
    else if (automatic || matching_ == Matching::sequence)
        each = std::min(each, kInSequence);
    const double matching = photos_ * each * seconds_of_pair(search_seconds_) + placing;
    return phase_ == CapturePhase::photos || phase_ == CapturePhase::frames
               ? matching + photos_ * search_seconds_
               : matching;
}

void CaptureProgressLine::update(const CaptureProgress& now) {
    if (!now.note.empty()) progress_.note(now.note);
    if (now.total < 1) return;
    if (now.phase != phase_ || now.what != what_) {
        phase_ = now.phase;
        what_ = now.what;
        total_ = now.total;
        first_ = done_ = now.done;  // an interrupted search continues
        progress_.begin(now.what, now.total, now.unit);
        progress_.skip(now.done);
        if (now.unit == "photos" || now.what == "extracted") photos_ = now.total;
    }
    // A video may have more frames than its header says.
    if (now.total != total_) progress_.set_total(total_ = now.total);
    if (phase_ == CapturePhase::features && now.done > done_)
        search_seconds_ = progress_.seconds() / (now.done - first_);
    done_ = now.done;
    progress_.set_rest(rest());
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

}  // namespace ewa::cli
