// SPDX-License-Identifier: Apache-2.0
// The dialogs of the film strip, and what they begin.
#include <imgui.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "core/outputs.h"
#include "core/process.h"
#include "ewa/error.h"
#include "viewer/editor/timeline.h"

namespace ewa::viewer {
namespace {

constexpr const char* kFilmTitle = "Save film";
constexpr const char* kPictureTitle = "Save picture";
constexpr const char* kFileLabel = "file";
constexpr const char* kSizeLabel = "size";
constexpr const char* kPixelsLabel = "px";
constexpr const char* kRateLabel = "frames a second";
constexpr const char* kCodecLabel = "codec";
constexpr const char* kSaveLabel = "Save";
constexpr const char* kCancelLabel = "Cancel";
constexpr const char* kOtherSize = "other";
constexpr const char* kWindowSize = "the window's";
constexpr const char* kFilmNames =
    "A film ends in .mp4, .mov, .mkv or .webm. Another name is that of a folder of PNG pictures.";
constexpr const char* kPictureNames = "A picture ends in .png, .jpg, .webp or .exr.";
constexpr const char* kReplaces = "The file exists and will be replaced.";
constexpr const char* kLengthFormat = "%d frames, %.1f s";
constexpr const char* kNoFfmpeg =
    "ffmpeg is not installed (Debian: apt install ffmpeg): the frames become PNG pictures in ";

constexpr int kLongestSide = 16384;  // px
constexpr Size kFilmSizes[] = {{1280, 720}, {1920, 1080}, {3840, 2160}};
constexpr int kFilmRates[] = {24, 30, 60};
constexpr const char* kCodecs[] = {"h264", "hevc", "av1", "vp9"};

std::string size_text(const Size& size) {
    return std::to_string(size.width) + " x " + std::to_string(size.height);
}

/// A choice of usual sizes, and two fields for any numbers.
void edit_size(Size& size, const Size& window) {
    std::string present = size == window ? kWindowSize : kOtherSize;
    for (const Size& usual : kFilmSizes)
        if (size == usual) present = size_text(usual);
    if (ImGui::BeginCombo(kSizeLabel, present.c_str())) {
        for (const Size& usual : kFilmSizes)
            if (ImGui::Selectable(size_text(usual).c_str(), size == usual)) size = usual;
        if (ImGui::Selectable(kWindowSize, size == window)) size = window;
        ImGui::EndCombo();
    }
    int sides[] = {size.width, size.height};
    if (!ImGui::InputInt2(kPixelsLabel, sides)) return;
    size = {std::clamp(sides[0], 2, kLongestSide), std::clamp(sides[1], 2, kLongestSide)};
}

/// Begins a dialog in the middle of the window, which fits into it. Returns whether it stays open.
bool begin_dialog(const char* title) {
    const ImVec2 window = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos(ImVec2(window.x / 2, window.y / 2), ImGuiCond_Appearing, ImVec2(0.5f, 0.5f));
    ImGui::SetNextWindowSizeConstraints(ImVec2(0, 0), window);
    bool open = true;
    ImGui::Begin(
        title, &open,
        ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoSavedSettings);
    ImGui::PushItemWidth(std::min(14 * ImGui::GetTextLineHeight(), 0.6f * window.x));
    return open;
}

/// The field of the file's name. Returns whether Enter ends it.
template <size_t N>
bool edit_name(std::array<char, N>& name) {
    if (ImGui::IsWindowAppearing()) ImGui::SetKeyboardFocusHere();
    return ImGui::InputText(kFileLabel, name.data(), name.size(),
                            ImGuiInputTextFlags_EnterReturnsTrue | ImGuiInputTextFlags_AutoSelectAll);
}

enum class Answer { none, save, cancel };

/// The lower rows of a dialog. entered: Enter was pressed. names: what the endings of names mean.
Answer end_dialog(bool entered, const char* file, const char* names) {
    ImGui::PushTextWrapPos(std::min(22 * ImGui::GetTextLineHeight(), 0.95f * ImGui::GetIO().DisplaySize.x));
    std::error_code error;
    ImGui::TextDisabled("%s", names);
    ImGui::TextUnformatted(std::filesystem::is_regular_file(file, error) ? kReplaces : "");
    ImGui::PopTextWrapPos();
    Answer answer = entered && *file != 0 ? Answer::save : Answer::none;
    ImGui::BeginDisabled(*file == 0);
    if (ImGui::Button(kSaveLabel)) answer = Answer::save;
    ImGui::EndDisabled();
    ImGui::SameLine();
    if (ImGui::Button(kCancelLabel)) answer = Answer::cancel;
    ImGui::PopItemWidth();
    ImGui::End();
    return answer;
}

template <size_t N>
void set_name(std::array<char, N>& name, const std::filesystem::path& file) {
    std::snprintf(name.data(), name.size(), "%s", file.c_str());
}

}  // namespace

void FilmStrip::open_picture() {
    dialog_ = Dialog::picture;
    set_name(picture_name_, free_name("ewa-picture", ".png"));
}

void FilmStrip::open_film() {
    dialog_ = Dialog::film;
    set_name(film_name_, free_name("ewa-film", ".mp4"));
}

void FilmStrip::draw_film_dialog() {
    bool open = begin_dialog(kFilmTitle) && !views().empty();
    const bool entered = edit_name(film_name_);
    edit_size(output_.size, state_.picture_area().size());
    if (ImGui::BeginCombo(kRateLabel, std::to_string(output_.rate).c_str())) {
        for (const int rate : kFilmRates)
            if (ImGui::Selectable(std::to_string(rate).c_str(), rate == output_.rate)) output_.rate = rate;
        ImGui::EndCombo();
    }
    if (ImGui::BeginCombo(kCodecLabel, output_.codec.c_str())) {
        for (const char* codec : kCodecs)
            if (ImGui::Selectable(codec, codec == output_.codec)) output_.codec = codec;
        ImGui::EndCombo();
    }
    if (!views().empty()) {
        const int frames = path().frames(output_.rate);
        ImGui::Text(kLengthFormat, frames, double(frames) / output_.rate);
    }
    const Answer answer = end_dialog(entered, film_name_.data(), kFilmNames);
    if (answer == Answer::save && !writing() && open) start_film();
    if (answer != Answer::none || !open) dialog_ = Dialog::none;
}

void FilmStrip::draw_picture_dialog() {
    const bool open = begin_dialog(kPictureTitle);
    const bool entered = edit_name(picture_name_);
    edit_size(picture_size_, state_.picture_area().size());
    const Answer answer = end_dialog(entered, picture_name_.data(), kPictureNames);
    if (answer == Answer::save) start_picture();
    if (answer != Answer::none || !open) dialog_ = Dialog::none;
}

void FilmStrip::start_film() {
    try {
        output_.file = film_name_.data();
        if (image::is_film_name(output_.file)) {
            core::check_outputs({{"the film", output_.file}}, {{"the scene", state_.scene.path}});
            if (core::find_program("ffmpeg").empty()) {
                output_.file = free_name(output_.file.replace_extension().string(), "");
                state_.say(kNoFfmpeg + output_.file.string());
            }
        }
        give_times(views(), distance());
        const Look look = shown_.look_for(path().at(0));
        writer_ = std::make_unique<FilmWriter>(path(), output_, look, state_.wake);
    } catch (const std::exception& error) {
        state_.say(error.what());
    }
}

void FilmStrip::start_picture() {
    const std::filesystem::path file = picture_name_.data();
    try {
        core::check_outputs({{"the picture", file}}, {{"the scene", state_.scene.path}});
        core::make_folder(file.parent_path());
    } catch (const std::exception& error) {
        return state_.say(error.what());
    }
    const Camera camera = shown_.camera(picture_size_);
    pictures_[shown_.renders.ask_extra({.camera = camera, .look = shown_.look_for(camera), .file = file})] =
        file;
}

void FilmStrip::take() {
    const std::vector<ExtraDone> done = std::exchange(shown_.extras, {});
    const auto say = [&](const std::exception_ptr& failure) {
        try {
            std::rethrow_exception(failure);
        } catch (const std::exception& error) {
            state_.say(error.what());
        }
    };
    const auto wrote = [&](const std::filesystem::path& file, const std::string& more) {
        state_.say("wrote " + std::filesystem::absolute(file).string() + more);
    };
    for (const ExtraDone& one : done) {
        const auto picture = pictures_.find(one.number);
        if (picture == pictures_.end()) continue;
        if (one.failure)
            say(one.failure);
        else
            wrote(picture->second, "");
        pictures_.erase(picture);
    }
    if (!writer_) return;
    if (!done.empty() || writer_->ending()) state_.redraw();
    try {
        if (!writer_->step(shown_.renders, done, steady_now())) return;
        wrote(writer_->output().file, ": " + std::to_string(writer_->frames()) + " frames");
    } catch (...) {
        say(std::current_exception());
    }
    writer_.reset();
}

}  // namespace ewa::viewer
