// SPDX-License-Identifier: Apache-2.0
// Work in the background of the window: opening scenes, watching training runs, finding cameras, and saving screenshots.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "viewer/camera_search.h"
#include "viewer/file_dialog.h"
#include "viewer/overlay.h"
#include "viewer/shown.h"
#include "viewer/training.h"

namespace ewa::viewer {

/// Its threads call WindowSystem::wake(), so the WindowSystem must outlive it.
class ViewSession {
  public:
    ViewSession(ViewState& state, Navigation& navigation, Shown& shown);

    /// Opens what the command line asks for.
    void start();
    /// Opens files. shown: the scene that they may add to, as in open_dropped(); an empty scene if they replace it.
    void open(const std::vector<std::filesystem::path>& paths, const OpenedScene& shown);
    /// Starts `ewa train` on the dataset that is shown, in a folder of its own.
    void train();
    /// Whether the picture offers a training: the dataset of photos is shown, and nothing is trained.
    bool offers_training() const;
    /// Starts a training with so many steps; 0: the user wants none now.
    void answer_offer(int steps);
    /// Writes a screenshot.
    void save(Image&& image);

    void take_opened();
    void take_found();
    void take_saved();
    /// New splats of the run replace those that are shown. keep: they wait, because edits would be lost.
    void take_live(bool keep);

    bool saving() const { return saving_.running(); }
    bool waiting() const { return opening_.running() || saving() || dialog.open(); }
    bool empty() const;  // nothing is open, nor on its way
    /// The text in the middle of the window while it shows no splats.
    std::optional<Headline> headline() const;
    std::string banner() const;  // what the picture shows, if not splats

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
    bool offer_answered_ = false;
    std::shared_ptr<const Gaussians> newer_;  // splats of the run that wait; null: none
    bool live_failed_ = false;                // a training that cannot be reached was reported
    std::string search_failure_;              // why photos have no cameras; one line
    Task<OpenedScene> opening_;
    Task<std::string> saving_;  // a screenshot; the message about it
};

}  // namespace ewa::viewer
