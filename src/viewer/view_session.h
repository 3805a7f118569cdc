// SPDX-License-Identifier: Apache-2.0
// What is on its way into the window, and out of it: scenes that are opened, training runs, and screenshots.
#pragma once
#include <filesystem>
#include <future>
#include <optional>
#include <string>
#include <vector>

#include "viewer/camera_search.h"
#include "viewer/file_dialog.h"
#include "viewer/overlay.h"
#include "viewer/shown.h"
#include "viewer/training.h"

namespace ewa::viewer {

/// Its threads call wake() of the window system. It must end before that does.
class ViewSession {
  public:
    ViewSession(ViewState& state, Navigation& navigation, Shown& shown);

    /// Opens what the command line asks for.
    void start();
    /// shown: what the files may add to; an empty scene if they are opened by themselves.
    void open(const std::vector<std::filesystem::path>& paths, const OpenedScene& shown);
    /// Starts `ewa train` on the dataset that is shown, in a folder of its own.
    void train();
    /// Writes a screenshot.
    void save(Image&& image);

    void take_chosen();  // what the file dialog has answered
    void take_opened();
    void take_found();
    void take_saved();
    void take_live();  // new splats of the run replace those that are shown

    bool saving() const { return saving_.valid(); }
    bool waiting() const { return opening_.valid() || saving_.valid() || dialog.open(); }
    bool empty() const;  // nothing is open, nor on its way
    /// What the middle of the picture says where there is nothing to see.
    std::optional<Headline> headline() const;
    std::string banner() const;  // what the picture is, if it is no splats

    CameraSearch search;
    FileDialog dialog;
    LiveRun live_run;

  private:
    void adopt(OpenedScene scene, std::optional<int> frame);
    void show_opened(OpenedScene scene);
    void find_cameras(const std::filesystem::path& photos);
    void watch(const live::WhatToWatch& what, TrainProcess* trainer);
    void start_training(const std::vector<std::string>& options, const std::filesystem::path& folder);
    bool training() const;  // one that the window has started

    ViewState& state_;
    Navigation& navigation_;
    Shown& shown_;
    bool live_failed_ = false;    // a training that cannot be reached was reported
    std::string search_failure_;  // why photos have no cameras; one line
    std::future<OpenedScene> opening_;
    std::future<std::string> saving_;  // a screenshot; the message about it
};

}  // namespace ewa::viewer
