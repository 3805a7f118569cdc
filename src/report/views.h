// SPDX-License-Identifier: Apache-2.0
// The views of a report: each as small pictures, and some at full size, where a slider goes from image to render.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "ewa/image.h"

namespace ewa::report {

// A report must open at once and be small enough for an e-mail, so these bound its JPEGs.
constexpr size_t kSmallBytes = 6u << 20, kFullSizeBytes = 12u << 20;

struct ReportView {
    std::string name;
    double psnr = 0, ssim = 0;
    int frame = -1;  // the caller's
    int width = 0, height = 0;
    using Jpeg = std::vector<unsigned char>;
    Jpeg small_photo, small_rendering, small_error;
    Jpeg photo, rendering;  // empty: not at full size
};

/// A view without its images at full size. photo, rendering: RGB, of equal size.
ReportView small_view(const std::string& name, const Image& photo, const Image& rendering, double psnr,
                      double ssim);

/// Adds the images at full size; more than 4096 px in a direction are reduced. Returns the bytes added.
size_t add_full_size(ReportView& view, const Image& photo, const Image& rendering);

/// Sorts by PSNR, worst first.
void sort_views(std::vector<ReportView>& views);

/// Indices of sorted views in the order in which they get images at full size: the worst, the best, then the middle of each gap
/// between them.
std::vector<size_t> full_size_order(size_t count);

/// The views as HTML, in their order. held_out: they were not trained on.
std::string views_html(const std::vector<ReportView>& views, bool held_out);

/// A training image with the pixels that --robust masks.
struct LeftOutView {
    std::string name;
    double share = 0;  // of the image
    ReportView::Jpeg picture;
};
/// image: RGB. mask: one channel of any size, 0 at masked pixels.
LeftOutView left_out_view(const std::string& name, const Image& image, const Image& mask, double share);
/// The training images with masked pixels as HTML, in their order. Empty without views.
std::string left_out_html(const std::vector<LeftOutView>& views);

/// "23.46 dB", or "∞ dB" for equal images.
std::string decibels(double psnr);

}  // namespace ewa::report
