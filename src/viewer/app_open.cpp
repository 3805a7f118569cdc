// SPDX-License-Identifier: Apache-2.0
// What the window shows: scenes that are opened, and training runs.
#include <cstdio>

#include "core/process.h"
#include "core/text.h"
#include "ewa/error.h"
#include "live/run_folder.h"
#include "run/earlier_run.h"
#include "scene/names.h"
#include "viewer/app.h"

namespace ewa::viewer {
namespace {

/// The folder that `ewa train` takes for the dataset, or the first with a number behind it that does not exist.
std::filesystem::path free_run_folder(const std::filesystem::path& dataset) {
    RunOptions run;
    run.dataset = dataset;
    const std::filesystem::path usual = output_folder(run);
    for (int i = 1;; ++i) {
        std::filesystem::path folder = usual;
        if (i > 1) folder += "-" + std::to_string(i);
        std::error_code error;
        if (!std::filesystem::exists(folder, error)) return folder;
    }
}

}  // namespace

void App::adopt(OpenedScene scene, std::optional<int> frame) {
    scene_ = std::move(scene);
    scene_.set_gaussians(scene_.gaussians);
    renders_.set_scene(scene_.gaussians);
    settings_.look.kernel = scene_.look.kernel;
    settings_.look.points = scene_.look.points;
    settings_.look.nearest = scene_.look.nearest;
    settings_.look.background = scene_.look.background;
    settings_.look.sh_degree = scene_.sh_degree;
    message_.note.clear();
    if (!scene_.remark.empty()) say(scene_.remark);
    navigation_.framed = scene_.gaussians->size() > 0;
    shown_.comparison.forget_scene();
    shown_.quality.forget();
    navigation_.leave_camera();
    navigation_.start_frame.reset();
    if (scene_.dataset) {
        navigation_.camera_size = camera_size(*scene_.dataset, navigation_.view.radius());
        navigation_.start_frame = navigation_.at_camera = frame.value_or(0);
    }
    redraw(Loop::kRedraws);
}

void App::show_opened(OpenedScene scene) {
    session_.search_failure.clear();
    navigation_.view.restart(start_view(scene, {}, picture_area().size()));
    window_.set_title(window_title(scene));
    adopt(std::move(scene), {});
}

/// shown: what the files may add to; an empty scene if they are opened by themselves.
void App::open(const std::vector<std::filesystem::path>& paths, const OpenedScene& shown) {
    if (session_.opening.valid()) return say("another file is being opened");
    if (session_.search.running()) return say("cameras of photos are being found; Esc stops that");
    say("opening " + core::one_line(paths.front().string()));
    session_.opening = std::async(std::launch::async, [this, paths, shown] {
        const Wake wake{system_};
        return open_dropped(paths, shown);
    });
}

void App::take_opened() {
    if (!Session::finished(session_.opening)) return;
    try {
        OpenedScene scene = session_.opening.get();
        if (!scene.photos.empty()) return find_cameras(scene.photos);
        const bool same_splats = scene.gaussians == scene_.gaussians;
        show_opened(std::move(scene));
        if (same_splats) {
            settings_.cameras = true;
            return;
        }
        session_.live.stop();
        if (!scene_.run.empty()) watch({scene_.run, {}, {}, scene_.splats_time}, nullptr);
    } catch (const std::exception& error) {
        say(error.what());
    }
}

/// What the file dialog has answered.
void App::take_chosen() {
    try {
        if (const auto path = session_.dialog.take()) open({*path}, {});
    } catch (const std::exception& error) {
        say(error.what());
    }
}

void App::find_cameras(const std::filesystem::path& photos) {
    session_.search_failure.clear();
    message_.note.clear();
    const bool train = startup_.later && photos == startup_.scene.photos;
    session_.search.start(photos, (train ? startup_.later->folder : folder_for_photos(photos)) / "dataset",
                          train ? startup_.later->capture : CaptureOptions());
    redraw(Loop::kRedraws);
}

void App::take_found() {
    if (!session_.search.running()) return;
    redraw();
    if (!session_.search.ended()) return;
    try {
        std::optional<OpenedScene> scene = session_.search.take();
        if (!scene) return say("stopped; opened again, the photos go on from here");
        const bool train = startup_.later && scene->photos == startup_.scene.photos;
        session_.live.stop();
        show_opened(std::move(*scene));
        settings_.cameras = true;
        if (train && !training()) start_training(startup_.later->options, startup_.later->folder);
    } catch (const std::exception& error) {
        session_.search_failure = error.what();
        if (core::find_program("colmap").empty())
            session_.search_failure += "; or run ewa cameras where it is, and open the dataset that it makes";
        say(session_.search_failure);
    }
}

void App::watch(const live::WhatToWatch& what, TrainProcess* trainer) {
    // A run in a folder may have ended before the window reaches it. Its files then tell how it went.
    session_.live_failed = !what.folder.empty();
    session_.live.watch(what, trainer);
    redraw();
}

/// New splats of the run replace those that are shown.
void App::take_live() {
    if (const auto status = session_.live.failure(); status && message_.note.empty())
        say("the training ended with status " + std::to_string(*status) +
            "; see the terminal for the reason");
    // A screenshot waits for its full frame, which new splats would start again.
    if (loop_.capture && navigation_.framed) return;
    const LiveRun::News news = session_.live.take();
    if (news.any) redraw();
    const live::Update* run = session_.live.update();
    if (run && !run->problem.empty() && run->status.steps == 0 && !session_.live_failed) {
        session_.live_failed = true;
        std::fprintf(stderr, "ewa-view: %s\n", core::one_line(run->problem).c_str());
    }
    if (!news.splats) return;
    const int degree_before = scene_.sh_degree;
    scene_.set_gaussians(news.splats);
    scene_.points = false;
    renders_.set_scene(news.splats);
    if (settings_.look.sh_degree == degree_before) settings_.look.sh_degree = scene_.sh_degree;
    // The first splats tell what to look at, unless the user has moved the camera.
    if (!navigation_.framed && (!scene_.dataset || navigation_.at_camera == navigation_.start_frame))
        navigation_.view.restart(start_view(scene_, navigation_.start_frame, picture_area().size()));
    navigation_.framed = true;
}

bool App::training() {
    return (trainer_ && !trainer_->status()) || (startup_.trainer && !startup_.trainer->status());
}

/// Starts `ewa train` on the dataset that is shown, in a folder of its own.
void App::train() {
    if (training()) return say("a training that this window has started still runs");
    // Photos have their dataset in the folder of the run.
    const std::filesystem::path made_in = scene_.path.parent_path();
    const bool first = !scene_.photos.empty() && !live::find_run(made_in);
    const std::filesystem::path dataset = first ? scene_.photos : scene_.path;
    std::vector<std::string> options{dataset.string(), "--steps", std::to_string(settings_.train_steps),
                                     "--quiet"};
    if (!startup_.device.empty()) options.insert(options.end(), {"--device", startup_.device});
    start_training(options, first                   ? made_in
                            : scene_.photos.empty() ? free_run_folder(scene_.path)
                                                    : free_run_folder(scene_.photos));
}

void App::start_training(const std::vector<std::string>& options, const std::filesystem::path& folder) {
    try {
        const auto now = std::filesystem::file_time_type::clock::now();
        session_.live.stop();
        trainer_ = std::make_unique<TrainProcess>(options, folder);
        watch({folder, {}, {}, now, now}, trainer_.get());
        say("training into " + std::filesystem::absolute(folder).string());
    } catch (const std::exception& error) {
        say(error.what());
    }
}

bool App::empty() const {
    return scene_.gaussians->size() == 0 && scene_.title.empty() && !scene_.dataset &&
           !session_.opening.valid() && !session_.search.running() && !session_.live.update();
}

/// What the middle of the picture says where there is nothing to see.
std::optional<Headline> App::headline() const {
    if (scene_.gaussians->size() > 0 || session_.search.running()) return std::nullopt;
    if (!session_.search_failure.empty() && !scene_.dataset)
        return Headline{"no cameras", session_.search_failure};
    if (session_.opening.valid()) return Headline{"opening ...", ""};
    if (const live::Update* run = session_.live.update()) {
        if (!run->problem.empty())
            return Headline{run->problem, "The window keeps trying, and shows the training once it answers."};
        return Headline{"waiting for the first splats", ""};
    }
    if (!scene_.title.empty() && !scene_.dataset)
        return Headline{scene_.title + " has no splats", "Drop another file here."};
    if (scene_.dataset) return std::nullopt;
    return Headline{"drop a file here",
                    "splats, photos, a video, a dataset, or the folder of a training run"};
}

/// What the picture is, if it is no splats.
std::string App::banner() const {
    const live::Update* run = session_.live.update();
    if (!scene_.points || !run || scene_.gaussians->size() == 0) return "";
    std::string text = "These are the points of the dataset, not splats: the picture is of step 0.";
    if (!run->connected && !session_.live.own())
        text += " ewa train with --serve or --save-every lets it move.";
    return text;
}

}  // namespace ewa::viewer
