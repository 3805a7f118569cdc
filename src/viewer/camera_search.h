// SPDX-License-Identifier: Apache-2.0
// Finds the cameras of photos or of a video while the window stays responsive.
#pragma once
#include <atomic>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>

#include "ewa/capture.h"
#include "viewer/latest.h"
#include "viewer/opening.h"

namespace ewa::viewer {

/// The folder that `ewa train` would write for this input. If it exists, the first numbered name that does not exist.
/// or_own_photos: also returns an existing folder whose subfolder `dataset` was made, or begun, from these photos.
std::filesystem::path free_run_folder(const std::filesystem::path& input, bool or_own_photos = false);

class CameraSearch {
  public:
    /// wake: called on the thread of the search when progress() has changed, and at the end of the search.
    explicit CameraSearch(std::function<void()> wake) : wake_(std::move(wake)) {}
    /// Stops the search. Finished steps stay on disk.
    ~CameraSearch() { cancel(); }
    CameraSearch(const CameraSearch&) = delete;
    CameraSearch& operator=(const CameraSearch&) = delete;

    /// Starts a search, which makes the dataset `folder` of the photos. No other search may be running.
    void start(const std::filesystem::path& photos, const std::filesystem::path& folder,
               const CaptureOptions& options);
    bool running() const { return found_.running(); }
    bool ended() const { return found_.ready(); }
    void cancel() { stop_ = true; }
    CaptureProgress progress() const;

    /// Returns the opened dataset once the search has ended. Empty if the search was cancelled. Throws InputError, RunError.
    std::optional<OpenedScene> take() { return found_.take(); }

  private:
    bool note(const CaptureProgress& now);

    std::function<void()> wake_;
    std::atomic<bool> stop_ = false;
    mutable std::mutex mutex_;
    CaptureProgress progress_;
    Task<std::optional<OpenedScene>> found_;  // its thread ends before the rest
};

}  // namespace ewa::viewer
