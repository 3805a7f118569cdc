// SPDX-License-Identifier: Apache-2.0
#include "capture/times.h"

#include <algorithm>
#include <cmath>

namespace ewa::capture {
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

}  // namespace

/// Seconds of the parts after this one.
double Times::rest() const {
    if (phase_ == CapturePhase::cameras) return 0;
    const double placing = photos_ * seconds_to_place(photo_seconds_);
    if (phase_ == CapturePhase::matches && (what_ == "matched" || what_ == "verified")) return placing;
    const bool automatic = matching_ == Matching::automatic;
    double each = (photos_ - 1) / 2.0;
    if (automatic && photos_ <= kMostByLook)
        each = std::min(each, kByLook);
    else if (automatic || matching_ == Matching::sequence)
        each = std::min(each, kInSequence);
    return photos_ * each * seconds_of_pair(photo_seconds_) + placing;
}

void Times::complete(CaptureProgress& now) {
    if (now.total < 1) return;
    if (now.phase != phase_ || now.what != what_) {
        phase_ = now.phase;
        what_ = now.what;
        first_ = now.done;  // an interrupted search continues
        start_ = Clock::now();
        pace_ = core::Pace(0, now.done);
    }
    if (now.unit == "photos") photos_ = now.total;
    const double seconds = std::chrono::duration<double>(Clock::now() - start_).count();
    pace_.add(seconds, now.done);
    if (phase_ == CapturePhase::features && now.done > first_) photo_seconds_ = seconds / (now.done - first_);
    now.photo_seconds = photo_seconds_;
    const auto part = pace_.left(seconds, now.total);
    if (photo_seconds_ > 0 && part) now.left = *part + rest();
}

}  // namespace ewa::capture
