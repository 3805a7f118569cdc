// SPDX-License-Identifier: Apache-2.0
#include "viewer/view_session.h"

#include <cstdio>
#include <utility>

#include "capture/found_colmap.h"
#include "core/text.h"
#include "ewa/error.h"
#include "folders/run.h"
#include "run/earlier_run.h"
#include "scene/names.h"
#include "viewer/editor/texts.h"

namespace ewa::viewer {

ViewSession::ViewSession(ViewState& state, Navigation& navigation, Shown& shown)
    : search(state.wake),
      dialog(state.wake),
      live_run(state.wake),
      state_(state),
      navigation_(navigation),
      shown_(shown) {}

void ViewSession::start() {
    const Startup& startup = state_.startup;
    adopt(startup.scene, startup.frame);
    state_.settings.look = startup.settings.look;
    if (startup.watch) watch(*startup.watch, startup.trainer);
    if (!startup.scene.photos.empty()) find_cameras(startup.scene.photos);
}

void ViewSession::adopt(OpenedScene opened, std::optional<int> frame) {
    OpenedScene& scene = state_.scene = std::move(opened);
    scene.set_gaussians(scene.gaussians);
    Look& look = state_.settings.look;
    const Look before = std::exchange(look, scene.look);
    look.mode = before.mode;
    look.splat_scale = before.splat_scale;
    look.sh_degree = scene.sh_degree;
    state_.message.note.clear();
    offer_answered_ = false;
    newer_ = nullptr;
    if (!scene.remark.empty()) state_.say(scene.remark);
    shown_.enter_scene();
    navigation_.enter_scene(frame);
    state_.redraw(Loop::kRedraws);
}

void ViewSession::show_opened(OpenedScene scene) {
    search_failure_.clear();
    if (state_.empty()) state_.message.hint();
    state_.scene.title = scene.title;  // the area is that beside the panel
    navigation_.view.restart(start_view(scene, {}, state_.picture_area().size()));
    state_.window.set_title(window_title(scene));
    adopt(std::move(scene), {});
}

void ViewSession::open(const std::vector<std::filesystem::path>& paths, const OpenedScene& shown) {
    if (opening_.running()) return state_.say("another file is being opened");
    if (search.running()) return state_.say("cameras of photos are being found; Esc stops that");
    state_.say("opening " + core::one_line(paths.front().string()));
    opening_.start(state_.wake, [paths, shown, budget = state_.startup.budget.value_or(kUsualBudget)] {
        return open_dropped(paths, shown, budget);
    });
}

void ViewSession::take_opened() {
    if (!opening_.ready()) return;
    try {
        OpenedScene scene = opening_.take();
        if (!scene.photos.empty()) return find_cameras(scene.photos);
        const bool same_splats = scene.gaussians == state_.scene.gaussians;
        show_opened(std::move(scene));
        if (same_splats) {
            state_.settings.cameras = true;
            return;
        }
        live_run.stop();
        if (!state_.scene.run.empty()) watch({state_.scene.run, {}, {}, state_.scene.splats_time}, nullptr);
    } catch (const std::exception& error) {
        state_.say(error.what());
    }
}

void ViewSession::find_cameras(const std::filesystem::path& photos) {
    search_failure_.clear();
    state_.message.note.clear();
    const auto& later = state_.startup.later;
    const bool train = later && photos == state_.startup.scene.photos;
    search.start(photos, (train ? later->folder : free_run_folder(photos, true)) / folders::kMadeDataset,
                 train ? later->capture : CaptureOptions());
    state_.redraw(Loop::kRedraws);
}

void ViewSession::take_found() {
    if (!search.ended()) return;
    try {
        std::optional<OpenedScene> scene = search.take();
        if (!scene) return state_.say("stopped; opened again, the photos go on from here");
        const auto& later = state_.startup.later;
        const bool train = later && scene->photos == state_.startup.scene.photos;
        live_run.stop();
        show_opened(std::move(*scene));
        state_.settings.cameras = true;
        if (train && !training()) start_training(later->options, later->folder);
    } catch (const std::exception& error) {
        search_failure_ = error.what();
        if (!capture::find_colmap())
            search_failure_ += "; or run ewa cameras where it is, and open the dataset that it makes";
        state_.say(search_failure_);
    }
}

void ViewSession::watch(const live::WhatToWatch& what, TrainProcess* trainer) {
    // A run in a folder may have ended before the window reaches it. Its files then tell how it went.
    live_failed_ = !what.folder.empty();
    live_run.watch(what, trainer);
    state_.redraw();
}

void ViewSession::take_live(bool keep) {
    if (const auto status = live_run.failure(); status && state_.message.note.empty())
        state_.say("the training ended with status " + std::to_string(*status) +
                   "; see the terminal for the reason");
    // A screenshot waits for its full frame, which new splats would start again.
    if (state_.loop.capture && navigation_.framed) return;
    const auto done = [&] {
        const live::Update* run = live_run.update();
        return run && run->status.state == live::State::done && run->status.step == run->status.steps;
    };
    const bool before = done();
    const LiveRun::News news = live_run.take();
    if (live_run.own() && !before && done())
        state_.say("the training is done; " + how_to_share(live_run.folder()));
    if (news.any) state_.redraw();
    const live::Update* run = live_run.update();
    if (run && !run->problem.empty() && run->status.steps == 0 && !live_failed_) {
        live_failed_ = true;
        std::fprintf(stderr, "ewa-view: %s\n", core::one_line(run->problem).c_str());
    }
    if (news.splats) newer_ = news.splats;
    if (news.splats && keep) state_.say(texts::kNewerSplats);
    if (!newer_ || keep) return;
    const auto splats = std::exchange(newer_, nullptr);
    OpenedScene& scene = state_.scene;
    int& degree = state_.settings.look.sh_degree;
    const bool highest = degree == scene.sh_degree;
    scene.set_gaussians(splats);
    scene.points = false;
    scene.coarse = nullptr;  // of the scene before
    shown_.renders.set_scene(splats);
    if (highest) degree = scene.sh_degree;
    navigation_.take_splats();
}

bool ViewSession::training() const {
    const auto running = [](TrainProcess* trainer) { return trainer && !trainer->status(); };
    return running(state_.trainer.get()) || running(state_.startup.trainer);
}

void ViewSession::train() {
    if (training()) return state_.say("a training that this window has started still runs");
    const OpenedScene& scene = state_.scene;
    const std::string& device = state_.startup.device.selector;
    // Photos have their dataset in the folder of the run.
    const std::filesystem::path made_in = scene.path.parent_path();
    const std::filesystem::path& named = scene.photos.empty() ? scene.path : scene.photos;
    const bool first = !scene.photos.empty() && !folders::find_run(made_in);
    std::vector<std::string> options{(first ? named : scene.path).string(), "--steps",
                                     std::to_string(state_.settings.train_steps), "--quiet"};
    if (!device.empty()) options.insert(options.end(), {"--device", device});
    start_training(options, first ? made_in : free_run_folder(named));
}

bool ViewSession::offers_training() const {
    const OpenedScene& scene = state_.scene;
    return !offer_answered_ && !scene.photos.empty() && scene.dataset && scene.points && !search.running() &&
           !live_run.update() && !training();
}

void ViewSession::answer_offer(int steps) {
    offer_answered_ = true;
    if (steps == 0) return;
    state_.settings.train_steps = steps;
    train();
}

void ViewSession::start_training(const std::vector<std::string>& options,
                                 const std::filesystem::path& folder) {
    try {
        const auto now = std::filesystem::file_time_type::clock::now();
        live_run.stop();
        state_.trainer = std::make_unique<TrainProcess>(options, folder);
        watch({folder, {}, {}, now, now}, state_.trainer.get());
        state_.say("training into " + std::filesystem::absolute(folder).string());
    } catch (const std::exception& error) {
        state_.say(error.what());
    }
}

void ViewSession::save(Image&& image) {
    state_.loop.capture = false;
    if (state_.scripted()) {
        save_image(state_.startup.picture, image);
        state_.loop.done = true;
        return;
    }
    saving_.start(state_.wake, [image = std::move(image)]() -> std::string {
        try {
            const std::filesystem::path path = free_name("ewa-view", ".png");
            save_image(path, image);
            return "wrote " + std::filesystem::absolute(path).string();
        } catch (const std::exception& error) {
            return error.what();
        }
    });
}

void ViewSession::take_saved() {
    if (saving_.ready()) state_.say(saving_.take());
}

bool ViewSession::empty() const {
    return state_.empty() && !opening_.running() && !search.running() && !live_run.update();
}

std::optional<Headline> ViewSession::headline() const {
    const OpenedScene& scene = state_.scene;
    if (scene.gaussians->size() > 0 || search.running()) return std::nullopt;
    if (!search_failure_.empty() && !scene.dataset) return Headline{"no cameras", search_failure_};
    if (opening_.running()) return Headline{"opening ...", ""};
    if (const live::Update* run = live_run.update()) {
        if (!run->problem.empty())
            return Headline{run->problem, "The window keeps trying, and shows the training once it answers."};
        return Headline{"waiting for the first splats", ""};
    }
    if (scene.dataset) return std::nullopt;
    if (!scene.title.empty()) return Headline{scene.title + " has no splats", "Drop another file here."};
    return std::nullopt;
}

std::string ViewSession::banner() const {
    const live::Update* run = live_run.update();
    if (!state_.scene.points || !run || state_.scene.gaussians->size() == 0) return "";
    std::string text = "These are the points of the dataset, not splats: the picture is of step 0.";
    if (!run->connected && !live_run.own()) text += " ewa train with --serve or --save-every lets it move.";
    return text;
}

}  // namespace ewa::viewer
