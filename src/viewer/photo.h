// SPDX-License-Identifier: Apache-2.0
// The photograph of a camera, and the splats against it. Both take long: they are made beside the window's
// own thread.
#pragma once
#include <array>
#include <memory>
#include <string>

#include "ewa/dataset.h"
#include "viewer/photo_comparison.h"
#include "viewer/render_thread.h"

namespace ewa::viewer {

struct PhotoRequest {
    uint64_t scene = 0;  // which of those opened here the frame belongs to
    int index = -1;
    Frame frame;
    Size size;                          // of the place that it has, px
    std::array<float, 3> background{};  // where it is transparent
};

struct Photo {
    uint64_t scene = 0;
    int frame = -1;
    Picture picture;  // as its camera sees it, a whole factor smaller where that still covers twice the size
                      // asked for
    std::string failure;  // one line, where there is no picture
};

Photo load_photo(const PhotoRequest& request);

struct ComparisonRequest {
    std::shared_ptr<const FinishedPicture> rendering;
    std::shared_ptr<const Photo> photo;
    Rectangle place;  // of the photograph, px of the rendering
    float gain = 0;   // of the difference's picture; 0: none is wanted
    bool operator==(const ComparisonRequest&) const = default;
};

struct Compared {
    ComparisonRequest of;
    double psnr = 0;     // over the place, as psnr() has it
    Picture difference;  // amplified; empty where none is wanted
};

Compared compare_with_photo(const ComparisonRequest& request);

}  // namespace ewa::viewer
