// SPDX-License-Identifier: Apache-2.0
#include "viewer/camera_search.h"

#include <nlohmann/json.hpp>
#include <string>

#include "core/folders.h"
#include "core/json_field.h"
#include "ewa/error.h"
#include "ewa/run_options.h"
#include "folders/run_folder.h"

namespace ewa::viewer {
namespace {

namespace fs = std::filesystem;

/// Whether the folder is a dataset that was made, or begun, of these photos.
bool made_of_photos(const fs::path& dataset, const fs::path& photos) {
    try {
        const auto capture = core::read_json_file<nlohmann::json>(dataset / folders::kCaptureFile);
        std::error_code error;
        return core::text_in(capture, "input") == fs::canonical(photos, error).string();
    } catch (const InputError&) {
        return false;
    }
}

}  // namespace

fs::path free_run_folder(const fs::path& input, bool or_own_photos) {
    RunOptions run;
    run.dataset = input;
    const fs::path usual = output_folder(run);
    for (int i = 1;; ++i) {
        fs::path folder = usual;
        if (i > 1) folder += "-" + std::to_string(i);
        std::error_code error;
        if (!fs::exists(folder, error)) return folder;
        if (or_own_photos && made_of_photos(folder / folders::kMadeDataset, input)) return folder;
    }
}

void CameraSearch::start(const fs::path& photos, const fs::path& folder, const CaptureOptions& options) {
    stop_ = false;
    progress_ = {};
    found_.start(wake_, [=, this]() -> std::optional<OpenedScene> {
        const Capture capture =
            make_dataset(photos, folder, options, [this](const CaptureProgress& now) { return note(now); });
        if (capture.interrupted) return std::nullopt;
        OpenedScene scene = open_scene(folder, {});
        scene.photos = photos;
        scene.title = scene_title(photos);
        if (!capture.axes.empty()) scene.remark = capture.axes + "; " + scene.remark;
        for (const std::string& remark : capture.remarks) scene.remark = remark + "; " + scene.remark;
        return scene;
    });
}

CaptureProgress CameraSearch::progress() const {
    const std::lock_guard lock(mutex_);
    return progress_;
}

bool CameraSearch::note(const CaptureProgress& now) {
    bool changed = false;
    {
        const std::lock_guard lock(mutex_);
        changed = now.what != progress_.what || now.unit != progress_.unit || now.done != progress_.done ||
                  now.total != progress_.total || !now.note.empty();
        const std::string note = now.note.empty() ? progress_.note : now.note;  // it comes once
        progress_ = now;
        progress_.note = note;
    }
    if (changed) wake_();
    return !stop_;
}

}  // namespace ewa::viewer
