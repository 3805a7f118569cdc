// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/film.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

#include "core/folders.h"
#include "scene/framing.h"

namespace ewa::viewer {
namespace {

using Views = std::vector<io::NamedView>;

constexpr int kOnTheirWay = 2;  // frames: one is drawn while ffmpeg or the window takes another

}  // namespace

void give_times(Views& views, double distance) {
    double latest = -distance;
    for (const io::NamedView& view : views) latest = std::max(latest, view.time.value_or(latest));
    for (io::NamedView& view : views)
        if (!view.time) view.time = latest += distance;
    std::ranges::stable_sort(views, {}, [](const io::NamedView& view) { return *view.time; });
    for (size_t i = 1; i < views.size(); ++i)
        views[i].time = std::max(*views[i].time, *views[i - 1].time + kLeastGap);
}

size_t move_key(Views& views, size_t key, double time) {
    io::NamedView moved = std::move(views[key]);
    views.erase(views.begin() + std::ptrdiff_t(key));
    const auto later =
        std::ranges::find_if(views, [&](const io::NamedView& view) { return *view.time > time; });
    // A later key stays where it is, if there is room before it.
    if (later != views.end()) time = std::min(time, *later->time - kLeastGap);
    if (later != views.begin()) time = std::max(time, *std::prev(later)->time + kLeastGap);
    moved.time = std::max(time, 0.0);
    const size_t index = size_t(later - views.begin());
    views.insert(later, std::move(moved));
    give_times(views, 0);
    return index;
}

void space_evenly(Views& views) {
    if (views.size() < 2) return;
    const double first = *views.front().time, last = *views.back().time;
    for (size_t i = 0; i < views.size(); ++i)
        views[i].time = first + (last - first) * double(i) / double(views.size() - 1);
}

void stretch(Views& views, double length) {
    if (views.size() < 2) return;
    const double first = *views.front().time;
    const double factor = length / (*views.back().time - first);
    for (io::NamedView& view : views) view.time = first + (*view.time - first) * factor;
    give_times(views, 0);
}

double time_for_key(const Views& views, double playhead, double distance) {
    if (views.empty()) return 0;
    const double last = *views.back().time;
    if (playhead > last - kLeastGap) return last + distance;
    for (size_t i = 0; i + 1 < views.size(); ++i)
        if (std::abs(*views[i].time - playhead) < kLeastGap) return (*views[i].time + *views[i + 1].time) / 2;
    return std::max(playhead, 0.0);
}

void KeyHistory::remember(const Views& views, const Place& now) {
    before_.emplace_back(now, views);
    after_.clear();
}

bool KeyHistory::step(bool back, Views& views, const Place& now) {
    Changes &from = back ? before_ : after_, &to = back ? after_ : before_;
    if (from.empty() || from.back().first != now) return false;
    to.emplace_back(now, std::exchange(views, std::move(from.back().second)));
    from.pop_back();
    return true;
}

FilmPath::FilmPath(const Views& views, double distance, bool smooth)
    : times_(io::times_of(views, distance)), smooth_(smooth), even_(smooth && !views.front().time) {
    for (const io::NamedView& view : views) keys_.push_back(view.camera);
}

Camera FilmPath::frame(int index, int frames) const {
    const double share = frames > 1 ? frames - 1 : 1;
    if (even_) return along_path(keys_, double(index) * double(keys_.size() - 1) / share);
    return at(begin() + (end() - begin()) * index / share);
}

std::filesystem::path frame_file(const std::filesystem::path& folder, int index) {
    std::string number = std::to_string(index);
    number.insert(0, size_t(std::max(0, 5 - int(number.size()))), '0');
    return folder / (number + ".png");
}

FilmWriter::FilmWriter(const FilmPath& path, const FilmOutput& output, const Look& look,
                       std::function<void()> wake)
    : path_(path), output_(output), look_(look), wake_(std::move(wake)), frames_(path.frames(output.rate)) {
    if (!image::is_film_name(output.file)) {
        core::make_folder(output.file);
        return;
    }
    const std::string encoder = image::find_encoder(output.codec, output.file);
    core::make_folder(output.file.parent_path());
    film_ = std::make_shared<image::FilmFile>(output.file, output.size.width, output.size.height, encoder,
                                              output.rate);
}

ExtraRequest FilmWriter::request(int index) const {
    const Camera key = path_.frame(index, frames_);
    ExtraRequest request{.camera = scene::fitted(key, output_.size.width, output_.size.height),
                         .look = look_};
    if (film_)
        request.take = [film = film_](const std::vector<uint8_t>& rgba) { film->add(rgba); };
    else
        request.file = frame_file(output_.file, index);
    return request;
}

bool FilmWriter::step(Renders& renders, const std::vector<ExtraDone>& done, double seconds) {
    if (asked_ == 0) pace_ = core::Pace(seconds);
    for (const ExtraDone& one : done) {
        if (numbers_.empty() || one.number != numbers_.front()) continue;
        if (one.failure) std::rethrow_exception(one.failure);
        numbers_.pop_front();
        pace_.add(seconds, ++written_);
    }
    while (asked_ < frames_ && numbers_.size() < kOnTheirWay)
        numbers_.push_back(renders.ask_extra(request(asked_++)));
    if (written_ < frames_) return false;
    if (!film_) return true;
    if (!ending()) ending_.start(wake_, [film = film_] { film->finish(); });
    if (!ending_.ready()) return false;
    ending_.take();
    film_.reset();
    return true;
}

}  // namespace ewa::viewer
