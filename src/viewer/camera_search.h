// SPDX-License-Identifier: Apache-2.0
// Finds the cameras of photos or of a video while the window stays responsive.
#pragma once
#include <atomic>
#include <filesystem>
#include <functional>
#include <future>
#include <mutex>
#include <optional>

#include "ewa/capture.h"
#include "viewer/opening.h"

namespace ewa::viewer {

/// The folder of the run that `ewa train` of these photos would write, or the first with a number behind it that does
/// not belong to others. The dataset is in its folder `dataset`.
std::filesystem::path folder_for_photos(const std::filesystem::path& photos);

class CameraSearch {
  public:
    /// wake: called on a thread when progress() has changed, and at the end.
    explicit CameraSearch(std::function<void()> wake) : wake_(std::move(wake)) {}
    /// Stops the search. What is done is kept.
    ~CameraSearch() { cancel(); }
    CameraSearch(const CameraSearch&) = delete;
    CameraSearch& operator=(const CameraSearch&) = delete;

    /// Starts to make the dataset `folder`. Only while none is running.
    void start(const std::filesystem::path& photos, const std::filesystem::path& folder,
               const CaptureOptions& options);
    bool running() const { return found_.valid(); }
    bool ended() const;
    void cancel() { stop_ = true; }
    CaptureProgress progress() const;

    /// Once it has ended: the dataset, as opened. Empty if it was cancelled. Throws InputError, RunError.
    std::optional<OpenedScene> take() { return found_.get(); }

  private:
    bool note(const CaptureProgress& now);

    std::function<void()> wake_;
    std::atomic<bool> stop_ = false;
    mutable std::mutex mutex_;
    CaptureProgress progress_;
    std::future<std::optional<OpenedScene>> found_;  // its thread ends before the rest
};

}  // namespace ewa::viewer
