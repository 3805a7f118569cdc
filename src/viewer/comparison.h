// SPDX-License-Identifier: Apache-2.0
// The image of a dataset camera beside or over the render, and the difference of the two. Loading and
// comparing take long and run on threads of their own. Independent of the window.
#pragma once
#include <array>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "ewa/dataset.h"
#include "viewer/byte_image.h"
#include "viewer/render_thread.h"

namespace ewa::viewer {

enum class Comparison { none, beside, wipe, difference };

/// In pixels, from the top left corner.
struct Rectangle {
    int x = 0, y = 0, width = 0, height = 0;
    bool operator==(const Rectangle&) const = default;
    Size size() const { return {width, height}; }
};

/// The largest rectangle with the aspect ratio of `shape`, centred in `space`.
Rectangle fitted(Size shape, const Rectangle& space);

/// Places in the window. Beside: each gets half of the width right of `covered` px, or half of the whole
/// width if more than a third is covered. Otherwise the render fills the window, and the image the part that
/// its camera saw.
struct Arrangement {
    Rectangle rendering, image;
};
Arrangement arrange(Comparison comparison, Size window, Size image, int covered = 0);

/// |rendering - image| per channel, in the size of the render. The image fills `place` (px of the render) and
/// is sampled bilinearly; outside of it the result is black.
ByteImage difference(const ByteImage& rendering, const ByteImage& image, const Rectangle& place);
/// Multiplies every value by `gain`, up to 255.
void amplify(ByteImage& picture, float gain);

/// PSNR over the pixels of `place`, as psnr() computes it; NaN if the place is empty.
double psnr_of_difference(const ByteImage& difference, const Rectangle& place);

struct ImageRequest {
    uint64_t scene = 0;  // ImageComparison::scene_
    int index = -1;
    Frame frame;
    Size size;                          // of its place in the window, px
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
    float gain = 0;   // factor of the difference image; 0: no difference image
    bool operator==(const ComparisonRequest&) const = default;
};

struct Compared {
    ComparisonRequest of;
    double psnr = 0;       // over the place, as psnr() computes it
    ByteImage difference;  // amplified; empty without a gain
};

Compared compare_with_image(const ComparisonRequest& request);

/// Work on a thread of its own, of which only the last request matters.
template <class Request, class Result>
class Latest {
  public:
    /// make runs on the thread and never throws. on_news is called there when result() has changed.
    Latest(std::function<Result(const Request&)> make, std::function<void()> on_news)
        : make_(std::move(make)),
          on_news_(std::move(on_news)),
          thread_([this](const std::stop_token& stop) { work(stop); }) {}

    /// Replaces a request that is waiting.
    void ask(Request request) {
        const std::lock_guard lock(mutex_);
        waiting_ = std::move(request);
        wake_.notify_one();
    }
    /// The last result, or null.
    std::shared_ptr<const Result> result() const {
        const std::lock_guard lock(mutex_);
        return result_;
    }

  private:
    void work(const std::stop_token& stop) {
        for (;;) {
            std::optional<Request> request;
            {
                std::unique_lock lock(mutex_);
                wake_.wait(lock, stop, [this] { return waiting_.has_value(); });
                if (stop.stop_requested()) return;
                request = std::exchange(waiting_, std::nullopt);
            }
            auto made = std::make_shared<const Result>(make_(*request));
            {
                const std::lock_guard lock(mutex_);
                result_ = std::move(made);
            }
            on_news_();
        }
    }

    std::function<Result(const Request&)> make_;
    std::function<void()> on_news_;
    mutable std::mutex mutex_;
    std::condition_variable_any wake_;
    std::optional<Request> waiting_;
    std::shared_ptr<const Result> result_;
    std::jthread thread_;
};

/// Loads the image of the camera that the view is at, and compares it with the render, on threads of its own.
class ImageComparison {
  public:
    /// wake: called on the threads when take() has something new.
    explicit ImageComparison(const std::function<void()>& wake)
        : images_(load_camera_image, wake), comparisons_(compare_with_image, wake) {}

    /// Forgets the image: frame indices of another scene mean other images.
    void forget_scene();
    /// Loads the image of a frame, unless a loaded or requested one serves for this place and background.
    void load(int index, const Frame& frame, Size place, const std::array<float, 3>& background);
    /// Starts the comparison, unless it is running or done. Empty: none.
    void compare(const std::optional<ComparisonRequest>& request);
    enum class News { none, comparison, image };
    News take();

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
