// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/edit_worker.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "edit/edited_splats.h"
#include "ewa/renderer.h"
#include "ewa/splat_edit.h"
#include "scene/splat_arrays.h"

namespace ewa::viewer {
namespace {

static_assert(int(edit::kSelected) == kMarkSelected && int(edit::kLocked) == kMarkLocked &&
              int(edit::kHidden) == kMarkHidden && int(edit::kDeleted) == kMarkDeleted);

/// The `budget` splats that cover most, in order. Null if there are no more than that.
std::shared_ptr<const std::vector<uint32_t>> draft_rows(const Gaussians& g, size_t budget) {
    if (g.size() <= budget) return nullptr;
    std::vector<std::pair<float, uint32_t>> weights(g.size());
    for (size_t i = 0; i < g.size(); ++i) {
        const float* s = &g.log_scales[3 * i];
        const float least = std::min({s[0], s[1], s[2]});
        const float weight = s[0] + s[1] + s[2] - least - std::log1p(std::exp(-g.opacity_logits[i]));
        weights[i] = {std::isnan(weight) ? -std::numeric_limits<float>::infinity() : weight, uint32_t(i)};
    }
    std::ranges::nth_element(weights, weights.begin() + std::ptrdiff_t(budget), std::greater());
    auto rows = std::make_shared<std::vector<uint32_t>>();
    for (size_t k = 0; k < budget; ++k) rows->push_back(weights[k].second);
    std::ranges::sort(*rows);
    return rows;
}

/// The bounds and the sum of finite points.
struct Spread {
    glm::dvec3 low{std::numeric_limits<double>::infinity()}, high{-low}, sum{0};
    size_t count = 0;

    void add(const glm::dvec3& at) {
        if (!std::isfinite(at.x + at.y + at.z)) return;
        ++count;
        sum += at;
        low = glm::min(low, at);
        high = glm::max(high, at);
    }
};

}  // namespace

EditWorker::EditWorker(std::function<void()> wake, size_t budget)
    : wake_(std::move(wake)), budget_(budget), thread_([this](const std::stop_token& stop) { work(stop); }) {}

EditWorker::~EditWorker() {
    thread_.request_stop();
    thread_.join();
    for (const auto& [id, scene] : scenes_)
        if (scene.journal && scene.history->done() == 0) scene.journal->remove();
}

void EditWorker::post(Task task) {
    const std::lock_guard lock(mutex_);
    ++pending_;
    tasks_.push_back(std::move(task));
    waits_.notify_one();
}

void EditWorker::work(const std::stop_token& stop) {
    for (;;) {
        Task task;
        {
            std::unique_lock lock(mutex_);
            waits_.wait(lock, stop, [this] { return !tasks_.empty(); });
            if (stop.stop_requested()) return;
            task = std::move(tasks_.front());
            tasks_.pop_front();
        }
        std::string note;
        try {
            const auto start = std::chrono::steady_clock::now();
            task();
            milliseconds_ =
                std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
            publish();
        } catch (const std::exception& error) {
            note = error.what();
        }
        {
            const std::lock_guard lock(mutex_);
            done_.any = true;
            if (!note.empty()) done_.note = note;
            --pending_;
        }
        wake_();
    }
}

void EditWorker::publish() {
    join();
    const auto present = snapshot();
    const auto bits = marks();
    const std::lock_guard lock(mutex_);
    done_.snapshot = present;
    done_.splats = joined_;
    done_.draft = draft_;
    done_.marks = bits;
    done_.preview_count =
        previewed_.empty() ? std::nullopt : std::optional(size_t(std::ranges::count(previewed_, true)));
    for (edit::Step& step : steps_) done_.steps.push_back(std::move(step));
    steps_.clear();
    done_.changed.insert(done_.changed.end(), changed_.begin(), changed_.end());
    changed_.clear();
}

/// Joins the scenes that are shown, if they or their values have changed.
void EditWorker::join() {
    std::vector<std::pair<uint64_t, uint64_t>> shown;
    for (const auto& [id, scene] : scenes_)
        if (scene.shown) shown.emplace_back(id, scene.history->values_version());
    const bool dragged = drag_.has_value();
    if (shown == joined_of_ && joined_ && !dragged) return;
    joined_of_ = dragged ? decltype(joined_of_)() : shown;
    const auto splats_of = [&](uint64_t id) {
        if (!dragged || id != active_) return scenes_[id].history->splats().splats();
        edit::EditedSplats moved = scenes_[id].history->splats();
        if (moved.count(edit::kSelected) == 0) edit::select(moved, edit::parse_selection("all"));
        moved.change(*drag_);
        return moved.splats();
    };
    if (shown.size() == 1) {
        joined_ = splats_of(shown.front().first);
    } else {
        auto all = std::make_shared<Gaussians>();
        for (const auto& [id, version] : shown) append_splats(*all, *splats_of(id));
        joined_ = std::move(all);
    }
    auto rows = draft_.rows;
    if (!dragged || !rows) rows = draft_rows(*joined_, budget_);
    draft_ = {};
    if (rows) draft_ = {std::make_shared<const Gaussians>(scene::rows_of(*joined_, *rows)), rows};
}

std::shared_ptr<const EditSnapshot> EditWorker::snapshot() const {
    auto result = std::make_shared<EditSnapshot>();
    const auto found = scenes_.find(active_);
    if (found == scenes_.end()) return result;
    const edit::History& history = *found->second.history;
    const edit::EditedSplats& splats = history.splats();
    result->splats = splats.splats();
    result->states = std::make_shared<const std::vector<uint8_t>>(splats.states());
    result->cameras = splats.cameras();
    Spread all, selected;
    for (size_t i = 0; i < splats.size(); ++i) {
        const uint8_t state = splats.states()[i];
        if ((state & edit::kDeleted) != 0) continue;
        ++result->left;
        result->locked += (state & edit::kLocked) != 0;
        result->hidden += (state & edit::kHidden) != 0;
        if (!splats.selectable(i)) continue;
        result->selected += splats.affected(i);
        const glm::dvec3 at = result->splats->world_mean(i);
        all.add(at);
        if (splats.affected(i)) selected.add(at);
    }
    if (all.count > 0) result->bounds_of_all = {all.low, all.high};
    if (selected.count > 0) result->bounds = {selected.low, selected.high};
    const Spread& moved = result->selected > 0 ? selected : all;
    if (moved.count > 0) result->middle = moved.sum / double(moved.count);
    result->steps = history.steps();
    result->done = history.done();
    result->version = history.version();
    result->values_version = history.values_version();
    result->history_bytes = history.bytes();
    result->milliseconds = milliseconds_;
    return result;
}

std::shared_ptr<const std::vector<uint8_t>> EditWorker::marks() const {
    auto bits = std::make_shared<std::vector<uint8_t>>();
    for (const auto& [id, scene] : scenes_) {
        if (!scene.shown) continue;
        const size_t first = bits->size();
        const std::vector<uint8_t>& states = scene.history->splats().states();
        bits->insert(bits->end(), states.begin(), states.end());
        if (id != active_) continue;
        for (size_t i = 0; i < previewed_.size(); ++i)
            if (previewed_[i]) (*bits)[first + i] |= kMarkPreview;
    }
    return bits;
}

void EditWorker::find_preview() {
    previewed_.clear();
    const auto found = scenes_.find(active_);
    if (preview_.empty() || found == scenes_.end()) return;
    const edit::EditedSplats& splats = found->second.history->splats();
    std::vector<bool> flags = edit::parse_selection(preview_).shape(splats);
    for (size_t i = 0; i < flags.size(); ++i)
        if (!splats.selectable(i)) flags[i] = false;
    previewed_ = std::move(flags);
}

void EditWorker::add(uint64_t id, std::shared_ptr<const Gaussians> splats, edit::Cameras cameras) {
    post([this, id, splats = std::move(splats), cameras = std::move(cameras)] {
        scenes_[id] = {std::make_shared<edit::History>(splats, cameras), nullptr, cameras, true};
    });
}

void EditWorker::add_selection(uint64_t id, uint64_t of) {
    post([this, id, of] {
        const Scene& from = scenes_.at(of);
        auto copy = std::make_shared<edit::History>(*from.history);
        copy->perform({"Separate", {{"unlock", ""}, {"unhide", ""}, {"select", "invert"}, {"delete", ""}}});
        scenes_[id] = {std::move(copy), nullptr, from.cameras, true};
    });
}

void EditWorker::remove(uint64_t id) {
    post([this, id] {
        scenes_.erase(id);
        previewed_.clear();
    });
}

void EditWorker::activate(uint64_t id) {
    post([this, id] {
        active_ = id;
        preview_.clear();
        previewed_.clear();
    });
}

void EditWorker::show(uint64_t id, bool shown) {
    post([this, id, shown] {
        if (const auto found = scenes_.find(id); found != scenes_.end()) found->second.shown = shown;
    });
}

void EditWorker::change(uint64_t id, const std::shared_ptr<edit::Journal>& journal,
                        const std::function<void(Scene&)>& edit) {
    post([this, id, journal, edit] {
        const auto found = scenes_.find(id);
        if (found == scenes_.end()) return;
        found->second.journal = journal;
        const uint64_t before = found->second.history->version();
        edit(found->second);
        if (found->second.history->version() == before) return;
        // A selection alone is no work to save.
        const auto changes = [](const edit::Words& words) { return words.name != "select"; };
        if (std::ranges::any_of(found->second.history->edits(), changes)) changed_.push_back(id);
        if (!previewed_.empty()) find_preview();
    });
}

void EditWorker::perform(uint64_t id, std::vector<edit::Step> steps, std::shared_ptr<edit::Journal> journal) {
    change(id, journal, [this, steps = std::move(steps)](Scene& scene) {
        for (const edit::Step& step : steps) {
            if (!scene.history->perform(step)) continue;
            steps_.push_back(step);
            if (scene.journal) scene.journal->did(step);
        }
    });
}

void EditWorker::undo(uint64_t id, std::shared_ptr<edit::Journal> journal) {
    change(id, journal, [](Scene& scene) {
        if (scene.history->undo() && scene.journal) scene.journal->undid();
    });
}

void EditWorker::redo(uint64_t id, std::shared_ptr<edit::Journal> journal) {
    change(id, journal, [](Scene& scene) {
        if (scene.history->redo() && scene.journal) scene.journal->redid();
    });
}

void EditWorker::preview(const std::string& selection) {
    post([this, selection] {
        preview_ = selection;
        find_preview();
    });
}

void EditWorker::drag(const std::optional<glm::dmat4>& transform) {
    {
        const std::lock_guard lock(mutex_);
        if (std::exchange(next_drag_, transform)) return;  // its task waits
    }
    post([this] {
        const std::lock_guard lock(mutex_);
        drag_ = next_drag_.value_or(std::nullopt);
        next_drag_.reset();
    });
}

std::future<EditWorker::State> EditWorker::state_of(uint64_t id) {
    auto promise = std::make_shared<std::promise<State>>();
    post([this, id, promise] {
        const auto found = scenes_.find(id);
        if (found == scenes_.end()) return promise->set_value({});
        const edit::History& history = *found->second.history;
        promise->set_value({history.edits(), history.first()});
    });
    return promise->get_future();
}

EditWorker::Done EditWorker::take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(done_, Done{.snapshot = {},
                                     .splats = {},
                                     .draft = {},
                                     .marks = {},
                                     .preview_count = done_.preview_count,
                                     .steps = {},
                                     .changed = {},
                                     .note = {},
                                     .any = false});
}

}  // namespace ewa::viewer
