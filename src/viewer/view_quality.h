// SPDX-License-Identifier: Apache-2.0
// The PSNR of a view against its image, at the image's size, as `ewa eval` prints it.
#pragma once
#include <optional>

#include "ewa/appearance.h"
#include "ewa/dataset.h"
#include "viewer/latest.h"
#include "viewer/renders.h"

namespace ewa::viewer {

struct QualityRequest {
    Image rendering;  // of the frame's camera
    Frame frame;
    std::array<float, 3> background{};
    Appearance appearance = kIdentityExposure;  // of the image
    uint64_t number = 0;
};

struct Quality {
    uint64_t number = 0;  // of the request
    double psnr = 0;      // dB; NaN if no pixel counts, or without an image
};

/// Never throws: an image that cannot be read has no PSNR.
Quality quality_of(const QualityRequest& request);

class ViewQuality {
  public:
    /// wake: called on a thread when psnr() may have changed.
    explicit ViewQuality(std::function<void()> wake) : measurements_(quality_of, std::move(wake)) {}

    /// Starts to measure the PSNR of the dataset's frame `index`, unless this measurement has begun already. renders: its
    /// thread calls back, so it ends before this.
    void measure(Renders& renders, int index, const Frame& frame, const Look& look,
                 const Appearance& appearance = kIdentityExposure);
    /// Forgets the frame: indices of another dataset mean other images.
    void forget() { index_ = -1; }

    /// The frame's PSNR, dB. The value of earlier splats stays until that of the present ones is known. Empty: unknown.
    std::optional<double> psnr(int index) const;

  private:
    int index_ = -1;
    uint64_t scene_ = 0;  // number of the splats
    Look look_;
    uint64_t asked_ = 0, first_ = 0;  // numbers of the last request, and of the first one for this frame
    Latest<QualityRequest, Quality> measurements_;
};

}  // namespace ewa::viewer
