// SPDX-License-Identifier: Apache-2.0
// The dialogs of the film strip, and what they begin.
#include <imgui.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/outputs.h"
#include "core/packages.h"
#include "core/process.h"
#include "core/text.h"
#include "viewer/editor/texts.h"
#include "viewer/editor/timeline.h"

namespace ewa::viewer {
namespace {

namespace fs = std::filesystem;

constexpr int kLongestSide = 16384;  // px
constexpr Size kFilmSizes[] = {{1280, 720}, {1920, 1080}, {3840, 2160}};
constexpr int kFilmRates[] = {24, 30, 60};
const std::string kRateNames[] = {"24", "30", "60"}, kCodecs[] = {"h264", "hevc", "av1", "vp9"};

/// The place of a value among the values, or -1.
template <class Values, class Value>
int place_of(const Values& values, const Value& value) {
    const auto found = std::ranges::find(values, value);
    return found == std::end(values) ? -1 : int(found - std::begin(values));
}

/// A choice of usual sizes, and two fields for any numbers.
void edit_size(Size& size, const Size& window) {
    std::vector<Size> sizes(std::begin(kFilmSizes), std::end(kFilmSizes));
    sizes.push_back(window);
    std::vector<std::string> names;
    for (const Size& each : sizes)
        names.push_back(std::to_string(each.width) + " x " + std::to_string(each.height));
    names.back().insert(0, texts::film::kAsTheWindow);
    int chosen = place_of(sizes, size);
    if (form_list(texts::files::kSize, names, chosen)) size = sizes[size_t(chosen)];
    int sides[] = {size.width, size.height};
    form_row(texts::film::kPixels);
    if (!ImGui::InputInt2("##pixels", sides)) return;
    size = {std::clamp(sides[0], 2, kLongestSide), std::clamp(sides[1], 2, kLongestSide)};
}

/// Why the file cannot be written; empty: it can.
std::string refused(const char* name, const fs::path& file, const fs::path& scene) {
    try {
        core::check_outputs({{name, file}}, {{"the scene", scene}});
    } catch (const std::exception& error) {
        return core::one_line(error.what());
    }
    return {};
}

}  // namespace

fs::path FilmStrip::views_file() {
    if (views().size() < 2) return {};
    try {
        if (!folder_) folder_.emplace("ewa-views-");
        give_times(views(), distance());
        io::write_views(folder_->path() / "views.json", views());
        return folder_->path() / "views.json";
    } catch (const std::exception& error) {
        state_.say(error.what());
        return {};
    }
}

void FilmStrip::open_picture() {
    file_.set(fs::absolute(free_name("ewa-picture", ".png")));
    dialogs_.show([this] { return draw_picture_dialog(); });
}

void FilmStrip::open_film() {
    ffmpeg_ = !core::find_program("ffmpeg").empty();
    file_.set(fs::absolute(free_name("ewa-film", ffmpeg_ ? ".mp4" : "")));
    dialogs_.show([this] { return draw_film_dialog(); });
}

/// The lower part of a dialog. names: what the endings of names mean. Returns whether the dialog stays open.
bool FilmStrip::end_dialog(const char* names, bool (FilmStrip::*start)()) {
    ImGui::TextDisabled("%s", names);
    const char* save = file_.replaces() ? texts::files::kReplace : texts::files::kSave;
    const Choice choice = draw_choices(save, nullptr, texts::files::kCancel, !file_.path().empty());
    const bool stays = choice == Choice::none || (choice == Choice::confirm && !(this->*start)());
    end_modal(stays);
    return stays;
}

bool FilmStrip::draw_film_dialog() {
    if (views().empty() || writing()) return false;
    if (!begin_modal(texts::film::kFilmTitle)) return true;
    if (begin_form(file_, &files_)) {
        edit_size(output_.size, state_.picture_area().size());
        int rate = place_of(kFilmRates, output_.rate), codec = place_of(kCodecs, output_.codec);
        if (form_list(texts::film::kRate, kRateNames, rate)) output_.rate = kFilmRates[rate];
        ImGui::BeginDisabled(!ffmpeg_);
        if (form_list(texts::film::kCodec, kCodecs, codec)) output_.codec = kCodecs[codec];
        ImGui::EndDisabled();
        end_form();
    }
    const int frames = path().frames(output_.rate);
    ImGui::Text(texts::film::kFrames, frames, double(frames) / output_.rate);
    if (!ffmpeg_)
        modal_text(texts::film::kNoFfmpeg + (" (" + core::how_to_install(core::Thing::ffmpeg) + ")") +
                       texts::film::kPngFrames,
                   true);
    return end_dialog(texts::film::kFilmNames, &FilmStrip::start_film);
}

bool FilmStrip::draw_picture_dialog() {
    if (!begin_modal(texts::film::kPictureTitle)) return true;
    if (begin_form(file_, &files_)) {
        edit_size(picture_size_, state_.picture_area().size());
        end_form();
    }
    return end_dialog(texts::film::kPictureNames, &FilmStrip::start_picture);
}

bool FilmStrip::start_film() {
    const fs::path file = fs::absolute(file_.path());
    const bool film = image::is_film_name(file);
    if (!file_.accept(file, film ? refused("the film", file, state_.scene.path) : "")) return false;
    try {
        output_.file = file;
        give_times(views(), distance());
        const Look look = shown_.look_for(path().at(0));
        writer_ = std::make_unique<FilmWriter>(path(), output_, look, state_.wake);
    } catch (const std::exception& error) {
        file_.complain(core::one_line(error.what()));
    }
    return writing();
}

bool FilmStrip::start_picture() {
    const fs::path file = fs::absolute(file_.path());
    if (!file_.accept(file, refused("the picture", file, state_.scene.path))) return false;
    try {
        core::make_folder(file.parent_path());
    } catch (const std::exception& error) {
        file_.complain(core::one_line(error.what()));
        return false;
    }
    shown_.write(shown_.camera(picture_size_), file);
    return true;
}

void FilmStrip::stop_film() {
    const FilmOutput& output = writer_->output();
    state_.say(image::is_film_name(output.file)
                   ? texts::film::kStopped
                   : std::to_string(writer_->written()) + texts::film::kFramesStay + output.file.string());
    writer_.reset();
}

void FilmStrip::take() {
    file_.take(files_);
    const std::vector<ExtraDone> done = std::exchange(shown_.extras, {});
    if (!writer_) return;
    try {
        if (!writer_->step(shown_.renders, done, steady_now())) return;
        state_.say("wrote " + writer_->output().file.string() + ": " + std::to_string(writer_->frames()) +
                   " frames");
    } catch (const std::exception& error) {
        state_.say(error.what());
    }
    writer_.reset();
}

}  // namespace ewa::viewer
