// SPDX-License-Identifier: Apache-2.0
// Films: their properties by ffprobe or ffmpeg, and the colours of films of high dynamic range.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "ewa/image.h"

namespace ewa::capture {

/// Properties of a film that are known before its frames are read. Unknown numbers are 0, and unknown names empty.
struct FilmInfo {
    int stream = -1;  // index of the video stream with the largest pictures; -1: not known
    int width = 0, height = 0;
    int frames = 0;                // estimate
    int stated = 0;                // frames that the header states
    double rate = 0;               // frames a second
    std::string matrix, transfer;  // ITU-T H.273's, by ffmpeg's names
    int streams = 0;               // number of video streams
};

/// The properties that ffprobe prints, or ffmpeg if ffprobe is not installed. All are unknown if neither can read the film. go_on:
/// called now and then; false ends it with Stopped. Throws InputError for a film without pictures, or of a pair of fisheyes.
FilmInfo film_info(const std::filesystem::path& film, const std::function<bool()>& go_on);

/// The matrix by which YCbCr becomes RGB, by its name in ffmpeg's filter `scale`. If the film names none, its size decides.
std::string matrix_word(const FilmInfo& info);

/// A transfer function of high dynamic range (ITU-R BT.2100).
enum class HdrTransfer { none, hlg, pq };
HdrTransfer hdr_transfer(const FilmInfo& info);

/// Converts frames of high dynamic range to sRGB. The frames have the primaries of BT.2020. 203 cd/m², the white of BT.2408,
/// becomes white. Brighter values are clipped.
class HdrMap {
  public:
    explicit HdrMap(HdrTransfer transfer);
    /// rgb: 16 bits a value, the most significant first.
    Image map(const std::uint8_t* rgb, int width, int height) const;

  private:
    HdrTransfer transfer_;
    std::vector<float> linear_;  // by code value, 1 for white; of HLG, the light of the scene
    std::vector<float> coded_;   // sRGB by linear value
};

}  // namespace ewa::capture
