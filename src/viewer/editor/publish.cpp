// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/publish.h"

#include <algorithm>

#include "core/folders.h"
#include "core/packages.h"
#include "core/text.h"
#include "edit/edited_splats.h"
#include "ewa/error.h"
#include "ewa/splat_files.h"
#include "platform/desktop.h"

namespace ewa::viewer {
namespace {

namespace fs = std::filesystem;

constexpr auto kWakePeriod = std::chrono::milliseconds(300);
constexpr size_t kMostPublishText = 1u << 20;  // bytes

/// The last line that is not empty.
std::string last_line(std::string_view text) {
    text = core::trim(text);
    const size_t begin = text.find_last_of('\n');
    return core::one_line(begin == std::string_view::npos ? text : text.substr(begin + 1));
}

}  // namespace

core::Ended run_ewa(const fs::path& program, std::vector<std::string> arguments,
                    const std::function<bool(std::string_view)>& hear) {
    arguments.insert(arguments.begin(), program.string());
    return core::run_program({.command = std::move(arguments), .environment = {}, .log = {}, .joined = true},
                             hear);
}

std::vector<std::string> publish_arguments(const PublishOrder& order) {
    // An absolute path is no option, whatever the name.
    const auto whole = [](const fs::path& path) { return fs::absolute(path).string(); };
    std::vector<std::string> words{"convert", whole(order.scene), whole(order.out)};
    if (!order.edits.empty()) words.insert(words.end(), {"--edits", whole(order.edits)});
    if (!order.title.empty()) words.push_back("--title=" + order.title);
    if (!order.views.empty()) words.insert(words.end(), {"--views", whole(order.views)});
    if (order.levels > 0) words.insert(words.end(), {"--levels", std::to_string(order.levels)});
    return words;
}

std::optional<float> share_of_line(std::string_view line) {
    while (!line.empty()) {
        const std::string_view word = core::next_word(line);
        const size_t slash = word.find('/');
        if (slash == std::string_view::npos) continue;
        const auto done = core::parse_integer<uint64_t>(word.substr(0, slash)),
                   all = core::parse_integer<uint64_t>(word.substr(slash + 1));
        if (done && all && *all > 0) return float(std::min(1.0, double(*done) / double(*all)));
    }
    return std::nullopt;
}

void open_outside(const fs::path& path) {
    if (const std::string reason = platform::open_outside(path, core::how_to_install(core::Thing::opener));
        !reason.empty())
        throw RunError(reason + "; open " + core::one_line(path.string()));
}

Publisher::Publisher(fs::path program, std::function<void()> wake)
    : program_(std::move(program)), wake_(std::move(wake)) {}

void Publisher::start(PublishOrder order) {
    if (running()) return;
    stop_ = false;
    text_.clear();
    started_ = woken_ = Clock::now();
    result_.start(wake_, [this, order = std::move(order)]() mutable {
        try {
            return run(std::move(order));
        } catch (const std::exception& error) {
            return Result{.text = core::one_line(error.what())};
        }
    });
}

Publisher::Result Publisher::run(PublishOrder order) {
    std::optional<core::TemporaryFolder> folder;
    if (order.splats) {
        order.scene = folder.emplace("ewa-publish-").path() / "scene.ply";
        save_splats(order.scene,
                    order.states ? edit::splats_left(*order.splats, *order.states) : *order.splats);
        order.splats = nullptr;
    }
    core::make_folder(order.out.parent_path());
    const core::Ended ended =
        run_ewa(program_, publish_arguments(order), [this](std::string_view piece) { return hear(piece); });
    const std::lock_guard lock(mutex_);
    return {ended == core::Ended::done, ended == core::Ended::stopped, text_};
}

/// Returns whether the program continues.
bool Publisher::hear(std::string_view piece) {
    {
        const std::lock_guard lock(mutex_);
        text_.append(piece, 0, kMostPublishText - text_.size());
    }
    if (const auto now = Clock::now(); now - woken_ > kWakePeriod) {
        woken_ = now;
        wake_();
    }
    return !stop_;
}

Publisher::Progress Publisher::progress() const {
    const std::lock_guard lock(mutex_);
    Progress progress{.text = last_line(text_),
                      .share = 0,
                      .seconds = std::chrono::duration<double>(Clock::now() - started_).count()};
    progress.share = share_of_line(progress.text).value_or(0);
    return progress;
}

std::optional<Publisher::Result> Publisher::take() {
    if (!result_.ready()) return std::nullopt;
    return result_.take();
}

}  // namespace ewa::viewer
