// SPDX-License-Identifier: Apache-2.0
// The image of a dataset camera beside or over the render, and the difference of the two. Loading and
// comparing take long and run on threads of their own. Independent of the window.
#pragma once
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "ewa/dataset.h"
#include "viewer/byte_image.h"
#include "viewer/latest.h"
#include "viewer/layout.h"
#include "viewer/render_thread.h"

namespace ewa::viewer {

/// |rendering - image| per channel, in the size of the render. The image is sampled bilinearly to fill `place`
/// (px of the render). The result is black outside `place`.
ByteImage difference(const ByteImage& rendering, const ByteImage& image, const Rectangle& place);
/// Multiplies every value by `gain`, up to 255.
void amplify(ByteImage& picture, float gain);

struct ImageRequest {
    uint64_t scene = 0;  // ImageComparison::scene_
    int index = -1;
    Frame frame;
    Size size;                          // of the image's place in the window, px
    std::array<float, 3> background{};  // behind transparent pixels
};

struct CameraImage {
    uint64_t scene = 0;
    int frame = -1;
    ByteImage picture;    // divided by the largest whole factor that still covers twice the requested size
    std::string failure;  // one line, if there is no image
};

/// Never throws: an error is CameraImage::failure.
CameraImage load_camera_image(const ImageRequest& request);

struct ComparisonRequest {
    std::shared_ptr<const RenderedFrame> rendering;
    std::shared_ptr<const CameraImage> image;
    Rectangle place;  // of the image, px of the render
    float gain = 1;   // factor of the difference image
    bool operator==(const ComparisonRequest&) const = default;
};

struct Compared {
    ComparisonRequest of;
    ByteImage difference;  // amplified
};

Compared compare_with_image(const ComparisonRequest& request);

/// Loads the image of the camera that the view is at, and compares it with the render, on threads of its own.
class ImageComparison {
  public:
    /// wake: called on the threads that load and compare, when take() has something new.
    explicit ImageComparison(const std::function<void()>& wake)
        : images_(load_camera_image, wake), comparisons_(compare_with_image, wake) {}

    /// Forgets the image: frame indices of another scene mean other images.
    void forget_scene();
    /// Loads the image of a frame. Does nothing if a loaded or requested image already serves for this place (px) and background.
    void load(int index, const Frame& frame, Size place, const std::array<float, 3>& background);
    /// Starts this comparison, unless it is running or done. An empty request drops the last comparison.
    void compare(const std::optional<ComparisonRequest>& request);
    /// Takes what is new. Returns whether image() is another one.
    bool take();

    /// Whether loading the image of this frame has ended, with the image or a failure.
    bool loaded(int frame) const { return image_ && image_->frame == frame; }
    /// The image of the frame, or null.
    std::shared_ptr<const CameraImage> image_of(int frame) const {
        return loaded(frame) && image_->failure.empty() ? image_ : nullptr;
    }
    std::string failure_of(int frame) const { return loaded(frame) ? image_->failure : std::string(); }
    std::shared_ptr<const CameraImage> image() const { return image_; }
    /// The result of the requested comparison, or null while it is not ready.
    std::shared_ptr<const Compared> compared() const;
    const std::optional<ComparisonRequest>& requested() const { return requested_; }

  private:
    uint64_t scene_ = 0;  // scenes forgotten so far
    std::shared_ptr<const CameraImage> image_;
    std::optional<ImageRequest> image_requested_;
    std::optional<ComparisonRequest> requested_;
    std::shared_ptr<const Compared> compared_;
    Latest<ImageRequest, CameraImage> images_;
    Latest<ComparisonRequest, Compared> comparisons_;
};

}  // namespace ewa::viewer
