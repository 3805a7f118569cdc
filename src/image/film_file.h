// SPDX-License-Identifier: Apache-2.0
// Writes a film through the program ffmpeg.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/folders.h"
#include "platform/process.h"

namespace ewa::image {

inline constexpr int kFilmRate = 30;  // frames per second, of films that have no rate of their own

/// Whether the name is that of a film: .mp4, .mov, .mkv or .webm.
bool is_film_name(const std::filesystem::path& path);

/// The program ffmpeg in $PATH. Throws RunError that says what to install, and that a folder of PNGs needs none.
std::filesystem::path find_ffmpeg();

/// ffmpeg's encoder for h264, hevc, av1 or vp9. Empty for an empty codec: ffmpeg then chooses one by the file's name. Throws
/// InputError if a film of that name cannot have the codec, RunError if ffmpeg has no encoder for it.
std::string find_encoder(const std::string& codec, const std::filesystem::path& file);

/// A film that is being written. ffmpeg runs as a process of its own, without a shell, and gets the frames on its
/// standard input. It writes into a temporary folder; finish() moves the film to its place. The destructor ends an
/// unfinished one and leaves nothing.
class FilmFile {
  public:
    /// file: its name decides the format. width, height: of each frame, px. An odd last row or column is cut, since
    /// films have none. encoder: of find_encoder. rate: frames per second. Throws RunError.
    FilmFile(const std::filesystem::path& file, int width, int height, const std::string& encoder,
             double rate);
    ~FilmFile();
    FilmFile(const FilmFile&) = delete;
    FilmFile& operator=(const FilmFile&) = delete;

    /// rgba: width * height pixels, row by row from the top. Alpha is ignored. Throws RunError with ffmpeg's own
    /// reason if it has ended.
    void add(const std::vector<uint8_t>& rgba);
    /// Waits for ffmpeg, and moves the film to its path. Throws RunError, also if the disk is full.
    void finish();

  private:
    [[noreturn]] void fail(const platform::ProcessEnd& ended);
    platform::ProcessEnd end();  // after the last frame

    std::filesystem::path file_;
    core::TemporaryFolder folder_;
    std::filesystem::path made_;  // in folder_
    platform::Process process_;
    platform::PipeTo input_;
};

}  // namespace ewa::image
