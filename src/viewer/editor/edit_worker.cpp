// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/edit_worker.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "core/folders.h"
#include "edit/edited_splats.h"
#include "ewa/renderer.h"
#include "ewa/splat_edit.h"
#include "scene/splat_arrays.h"

namespace ewa::viewer {
namespace {

static_assert(int(edit::kSelected) == kMarkSelected && int(edit::kLocked) == kMarkLocked &&
              int(edit::kHidden) == kMarkHidden && int(edit::kDeleted) == kMarkDeleted);

constexpr auto kPublishPeriod = std::chrono::milliseconds(250);  // while tasks wait
constexpr const char *kSeparate = "Separate", *kFrozen = "Frozen by the training";

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

void EditWorker::set_budget(size_t budget) {
    if (budget_.exchange(budget) != budget) post([this] { joined_of_.clear(); });  // the draft is made again
}

EditWorker::~EditWorker() {
    cancel();
    thread_.request_stop();
    thread_.join();
    for (auto& [id, scene] : scenes_)
        if (scene.journal && scene.untouched()) scene.journal->remove();
}

void EditWorker::post(Task task) {
    const std::lock_guard lock(mutex_);
    ++pending_;
    ++posted_;
    tasks_.push_back(std::move(task));
    waits_.notify_one();
}

void EditWorker::work(const std::stop_token& stop) {
    using Clock = std::chrono::steady_clock;
    Clock::time_point published{};
    for (;;) {
        Task task;
        {
            std::unique_lock lock(mutex_);
            waits_.wait(lock, stop, [this] { return !tasks_.empty(); });
            if (stop.stop_requested()) return;
            task = std::move(tasks_.front());
            tasks_.pop_front();
            ++comparing_->task;
        }
        const auto start = Clock::now();
        const auto attempt = [this](const auto& action) {
            try {
                action();
            } catch (const std::exception& error) {
                note_ = error.what();
            }
        };
        attempt(task);
        milliseconds_ = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
        bool last = false;
        {
            const std::lock_guard lock(mutex_);
            last = tasks_.empty();
        }
        // A thousand undos are one change.
        if (last || Clock::now() - published > kPublishPeriod) {
            attempt([this] { publish(); });
            published = Clock::now();
            last = true;
        }
        {
            const std::lock_guard lock(mutex_);
            done_.any |= last;
            if (!note_.empty()) done_.note = std::exchange(note_, {});
            ++finished_;
        }
        wake_();
    }
}

/// An opening scene is not published before it is there.
void EditWorker::publish() {
    if (scenes_.empty()) return;
    join();
    const auto present = snapshot();
    std::vector<SceneState> states;
    for (auto& [id, scene] : scenes_) {
        const bool unsaved = scene.unsaved();
        if (!unsaved && std::exchange(scene.unmarked, false))
            record(scene, [](edit::Journal& journal) { journal.saved(); });
        states.push_back({id, unsaved, scene.journaled});
    }
    const std::lock_guard lock(mutex_);
    if (period_ != next_period_) return;
    done_.snapshot = present;
    done_.preview_count =
        previewed_.empty() ? std::nullopt : std::optional(size_t(std::ranges::count(previewed_, true)));
    std::ranges::move(std::exchange(moves_, {}), std::back_inserter(done_.moves));
    done_.scenes = std::move(states);
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
    result->drawn = joined_;
    result->draft = draft_;
    result->marks = marks();
    const auto found = scenes_.find(active_);
    if (found == scenes_.end()) return result;
    const edit::History& history = *found->second.history;
    const edit::EditedSplats& splats = history.splats();
    result->scene = active_;
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
    edit::EditedSplats splats = found->second.history->splats();
    previewed_.resize(splats.size());
    for (const std::string& shape : preview_) {
        edit::delete_shape(splats, edit::parse_shape(shape, "--remove"));
        const auto& before = found->second.history->splats().states();
        for (size_t i = 0; i < before.size(); ++i)
            previewed_[i] = ((before[i] ^ splats.states()[i]) & edit::kDeleted) != 0;
    }
}

void EditWorker::add(uint64_t id, std::shared_ptr<const Gaussians> splats, edit::Cameras cameras, Place place,
                     std::vector<bool> frozen) {
    post([this, id, splats = std::move(splats), cameras = std::move(cameras), place = std::move(place),
          frozen = std::move(frozen)] {
        Scene& scene = scenes_[id] = {std::make_shared<edit::History>(splats, cameras), cameras, place};
        if (!frozen.empty()) {
            scene.history->perform({kFrozen, {{"select", edit::splats_shape(frozen)}, {"lock", ""}}});
            scene.least = scene.history->done();
            scene.saved = scene.lasting();
        }
        active_ = id;
        preview_.clear();
        previewed_.clear();
    });
}

void EditWorker::separate(uint64_t id, uint64_t of, Place place) {
    post([this, id, of, place = std::move(place)] {
        moves_.emplace_back(id, false);  // unless all goes well
        const auto found = scenes_.find(of);
        if (found == scenes_.end()) return;
        Scene& from = found->second;
        Scene part{std::make_shared<edit::History>(*from.history), from.cameras, place};
        part.history->perform(
            {kSeparate, {{"unlock", ""}, {"unhide", ""}, {"select", "invert"}, {"delete", ""}}});
        part.least = part.history->done();
        const edit::Step step{kSeparate, {{"delete", ""}}};
        if (!from.history->perform(step)) return;
        part.from = of;
        part.from_step = from.history->done();
        write_journal(part);
        record(from, [&](edit::Journal& journal) { journal.did(step); });
        scenes_[id] = std::move(part);
        moves_.pop_back();
        if (!previewed_.empty()) find_preview();
    });
}

void EditWorker::restore(uint64_t id, uint64_t of, Place place, edit::ReadJournal journal) {
    post([this, id, of, place = std::move(place), journal = std::move(journal)] {
        const auto from = scenes_.find(of);
        if (from == scenes_.end()) return;
        if (id != of)
            scenes_[id] = {
                std::make_shared<edit::History>(from->second.history->first(), from->second.cameras),
                from->second.cameras, place};
        Scene& scene = scenes_.at(id);
        size_t done = 0;
        bool whole = true;
        try {
            for (; done < journal.steps.size(); ++done) whole &= scene.history->perform(journal.steps[done]);
        } catch (const std::exception& error) {
            whole = false;
            note_ = "restored " + std::to_string(done) + " of " + std::to_string(journal.steps.size()) +
                    " edits: " + error.what();
        }
        scene.least = std::min(journal.separated, scene.history->done());
        scene.saved = journal.saved;
        if (id != of && journal.separated_at > 0) {
            scene.from = of;
            scene.from_step = journal.separated_at;
        }
        // A journal has the edits of its history, and no others.
        scene.goes_on = whole && core::is_file(edit::journal_of(scene.place.file, scene.place.part));
        if (!scene.goes_on) return write_journal(scene);
        record(scene, [](edit::Journal&) {});
    });
}

void EditWorker::remove(uint64_t id, bool discard) {
    cancel();
    post([this, id, discard] {
        const auto found = scenes_.find(id);
        if (found == scenes_.end()) return;
        Scene& scene = found->second;
        if (scene.journal && (scene.untouched() || (discard && scene.unsaved()))) scene.journal->remove();
        scenes_.erase(found);
        std::erase_if(scenes_,
                      [id](const auto& each) { return each.second.closed && each.second.from == id; });
        previewed_.clear();
    });
}

void EditWorker::clear() {
    {
        const std::lock_guard lock(mutex_);
        ++next_period_;
        done_ = {};
    }
    post([this] {
        for (auto& [id, scene] : scenes_)
            if (scene.journal && scene.untouched()) scene.journal->remove();
        scenes_.clear();
        previewed_.clear();
        moves_.clear();
        joined_.reset();
        draft_ = {};
        drag_.reset();
        ++period_;
    });
}

void EditWorker::discard() {
    auto promise = std::make_shared<std::promise<void>>();
    post([this, promise] {
        for (auto& [id, scene] : scenes_)
            if (scene.journal && scene.unsaved()) scene.journal->remove();
        promise->set_value();
    });
    promise->get_future().wait();
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

void EditWorker::change(uint64_t id, const std::function<void(Scene&)>& edit) {
    post([this, id, edit] {
        const auto found = scenes_.find(id);
        if (found == scenes_.end() || found->second.closed) return;
        const uint64_t before = found->second.history->version();
        edit(found->second);
        if (found->second.history->version() == before) return;
        preview_.clear();  // it was of the splats before
        previewed_.clear();
    });
}

/// Writes to the journal of a scene, from its first edit on. A journal that cannot be written changes nothing but that.
void EditWorker::record(Scene& scene, const std::function<void(edit::Journal&)>& write) {
    if (!scene.journaled && !scene.journal) return;
    const Place& place = scene.place;
    try {
        if (!scene.journal) {
            scene.journal = std::make_unique<edit::Journal>(edit::journal_of(place.file, place.part),
                                                            place.head, scene.goes_on);
            // Scenes of an earlier session were separated from other edits than these.
            const bool first = place.part == 1 && scene.history->done() == 1 && !scene.goes_on;
            for (size_t part = 2; first && part <= edit::kMostParts; ++part)
                edit::set_aside(edit::journal_of(place.file, part));
        }
        write(*scene.journal);
    } catch (const std::exception& error) {
        scene.journaled = false;
        note_ = std::string(scene.journal ? "edits are no longer kept" : "edits are not kept") +
                " beside the file: " + error.what();
    }
}

/// Writes the whole journal again, from the history.
void EditWorker::write_journal(Scene& scene) {
    const auto from = scenes_.find(scene.from);
    // The step of a scene that was itself separated is no step of the file's journal.
    const size_t at = from == scenes_.end() || from->second.least > 0 ? 0 : scene.from_step;
    scene.journal.reset();
    scene.goes_on = false;
    record(scene, [&](edit::Journal& journal) {
        size_t done = 0;
        for (const edit::Step& step : scene.history->in_effect()) {
            journal.did(step);
            if (++done == scene.least) journal.separated(at);
        }
    });
    scene.unmarked = !scene.saved.empty();
}

/// A scene that was separated by this step of `of` goes where the step is undone, and comes where it is redone.
void EditWorker::follow(uint64_t of, size_t step, bool undone) {
    for (auto& [id, part] : scenes_) {
        if (part.from != of || part.from_step != step || part.closed == undone) continue;
        const auto own = part.history->in_effect().subspan(part.least);
        if (undone && !edit::lasting_edits(own).empty()) {
            note_ = "the separated scene has edits of its own, and stays";
            continue;
        }
        part.closed = undone;
        part.shown = !undone;
        moves_.emplace_back(id, !undone);
        if (!undone) {
            write_journal(part);
        } else if (part.journal) {
            part.journal->remove();
        }
    }
}

void EditWorker::perform(uint64_t id, edit::Step step) {
    change(id, [this, id, step = std::move(step)](Scene& scene) {
        if (!scene.history->perform(step)) return;
        // Steps that were undone are dropped, and with them the scenes that they had separated.
        for (auto& [each, part] : scenes_)
            if (part.from == id && part.from_step >= scene.history->done()) part.from = 0;
        std::erase_if(scenes_, [](const auto& each) { return each.second.closed && each.second.from == 0; });
        record(scene, [&](edit::Journal& journal) { journal.did(scene.history->steps().back()); });
    });
}

void EditWorker::undo(uint64_t id) {
    change(id, [this, id](Scene& scene) {
        const size_t step = scene.history->done();
        if (step <= scene.least || !scene.history->undo()) return;
        record(scene, [](edit::Journal& journal) { journal.undid(); });
        follow(id, step, true);
    });
}

void EditWorker::redo(uint64_t id) {
    change(id, [this, id](Scene& scene) {
        if (!scene.history->redo()) return;
        record(scene, [](edit::Journal& journal) { journal.redid(); });
        follow(id, scene.history->done(), false);
    });
}

void EditWorker::saved(uint64_t id, const std::vector<edit::Step>& steps) {
    change(id, [edits = edit::lasting_edits(steps)](Scene& scene) {
        scene.saved = edits;
        scene.unmarked = true;
    });
}

void EditWorker::preview(const std::vector<std::string>& shapes) {
    post([this, shapes] {
        preview_ = shapes;
        try {
            find_preview();
        } catch (const std::exception& error) {
            note_ = error.what();  // what is found so far is shown
        }
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
        const auto steps = history.in_effect();
        promise->set_value({{steps.begin(), steps.end()}, history.first(), history.splats().left()});
    });
    return promise->get_future();
}

EditWorker::Done EditWorker::take() {
    const std::lock_guard lock(mutex_);
    pending_ -= std::exchange(finished_, 0);
    Done fresh;
    fresh.preview_count = done_.preview_count;
    return std::exchange(done_, std::move(fresh));
}

}  // namespace ewa::viewer
