// SPDX-License-Identifier: Apache-2.0
// A film through saved views: the times of its keys, its path, and the writing of its frames. Independent of the window.
#pragma once
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/progress.h"
#include "image/film_file.h"
#include "io/datasets/view_list.h"
#include "scene/camera.h"
#include "viewer/latest.h"
#include "viewer/layout.h"
#include "viewer/renders.h"

namespace ewa::viewer {

inline constexpr double kLeastGap = 0.05;  // s, from key to key

/// Gives each view a time: one without a time comes `distance` seconds after the latest. Sorts the views by their times, and moves those
/// that are too close to the one before.
void give_times(std::vector<io::NamedView>& views, double distance);
/// Moves a key to another time, also past others. All views have times. Returns its new index.
size_t move_key(std::vector<io::NamedView>& views, size_t key, double time);
/// Spaces the keys evenly. The first and the last keep their times.
void space_evenly(std::vector<io::NamedView>& views);
/// Stretches the film to so many seconds. The first key keeps its time.
void stretch(std::vector<io::NamedView>& views, double length);
/// The time of a key that is added at the playhead: there, halfway to the next key if one is there, or `distance` seconds after the last.
double time_for_key(const std::vector<io::NamedView>& views, double playhead, double distance);

/// The changes of a film's keys, for undo. Edits of the splats may come between them.
class KeyHistory {
  public:
    /// The file of the scene, and its edits that are done.
    using Place = std::pair<std::filesystem::path, size_t>;
    /// Call it before a change.
    void remember(const std::vector<io::NamedView>& views, const Place& now);
    /// Undoes the last change (back), or does it again. Returns false where an edit or another scene came after it, or there is none.
    bool step(bool back, std::vector<io::NamedView>& views, const Place& now);

  private:
    using Changes = std::vector<std::pair<Place, std::vector<io::NamedView>>>;
    Changes before_, after_;
};

class FilmPath {
  public:
    /// views: at least one, in the order of their times. Without times, they are `distance` seconds apart.
    FilmPath(const std::vector<io::NamedView>& views, double distance, bool smooth = true);

    double begin() const { return times_.front(); }  // s
    double end() const { return times_.back(); }
    Camera at(double time) const { return along_path(keys_, times_, time, smooth_); }
    /// The number of frames of a film, which shows the first and the last key.
    int frames(int rate) const { return int((end() - begin()) * rate + 0.5) + 1; }
    /// The camera of a frame of so many.
    Camera frame(int index, int frames) const;

  private:
    std::vector<Camera> keys_;
    std::vector<double> times_;
    bool smooth_, even_;
};

struct FilmOutput {
    std::filesystem::path file;  // a film, or a folder that gets a PNG of each frame
    Size size{1920, 1080};
    int rate = image::kFilmRate;  // frames per second
    std::string codec = "h264";   // as of ewa render --codec
};

/// The file of a frame in a folder.
std::filesystem::path frame_file(const std::filesystem::path& folder, int index);

/// A film that is being written. Its frames are extra renders, so that the window can be used. The destructor stops it.
class FilmWriter {
  public:
    /// Starts ffmpeg, or makes the folder. wake: called on a thread when step() has something to do. Throws InputError, RunError.
    FilmWriter(const FilmPath& path, const FilmOutput& output, const Look& look, std::function<void()> wake);

    /// Takes the frames that are done, and asks for the next ones. seconds: of a steady clock. Returns whether the film is written.
    /// Throws what the writing throws.
    bool step(Renders& renders, const std::vector<ExtraDone>& done, double seconds);

    const FilmOutput& output() const { return output_; }
    int frames() const { return frames_; }
    int written() const { return written_; }
    /// Seconds until the last frame. Empty: not known yet.
    std::optional<double> left(double seconds) const { return pace_.left(seconds, frames_); }
    /// Whether ffmpeg still works after the last frame. It cannot be stopped then.
    bool ending() const { return ending_.running(); }

  private:
    ExtraRequest request(int index) const;

    FilmPath path_;
    FilmOutput output_;
    Look look_;
    std::function<void()> wake_;
    int frames_, asked_ = 0, written_ = 0;
    std::deque<uint64_t> numbers_;  // of the renders on their way
    core::Pace pace_;
    std::shared_ptr<image::FilmFile> film_;  // null: a folder
    Task<void> ending_;
};

}  // namespace ewa::viewer
