// SPDX-License-Identifier: Apache-2.0
// Frames of a video by ffmpeg. A first pass reads all frames at a small size and measures their sharpness. A second pass
// writes those that were chosen.
#include <algorithm>
#include <charconv>
#include <cstddef>

#include "capture/steps.h"
#include "core/folders.h"
#include "core/process.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::capture {
namespace {

namespace fs = std::filesystem;

constexpr int kSmallWidth = 480;  // px, of the frames whose sharpness is compared
constexpr uint64_t kMostPixels = uint64_t(1) << 24;

/// Arguments with which ffmpeg and ffprobe read the video. A name that begins with a dash, or has a colon, is a file all the same.
/// A playlist would lead to other files, and is refused whatever its name.
std::vector<std::string> input_words(const fs::path& video) {
    return {"-v",
            "error",
            "-protocol_whitelist",
            "file",
            "-format_whitelist",
            "mov,matroska,avi,mpegts,mpeg",
            "-i",
            "file:" + video.string()};
}

std::vector<std::string> ffmpeg(const fs::path& video) {
    std::vector<std::string> words{"ffmpeg", "-nostdin", "-hide_banner"};
    for (std::string& word : input_words(video)) words.push_back(std::move(word));
    words.insert(words.end(), {"-map", "0:v:0"});
    return words;
}

/// The pattern of the frames' names. A percent sign of the folder is doubled, since ffmpeg counts by the others.
std::string frame_pattern(const fs::path& folder) {
    std::string text = "file:";
    for (const char c : folder.string()) text.append(c == '%' ? 2 : 1, c);
    return text + "/frame_%05d.jpg";
}

/// Throws Error, with `what`, if ffmpeg has failed.
template <class Error>
void check(core::Ended ended, const fs::path& video, const char* what, const fs::path& log) {
    if (ended == core::Ended::stopped) throw Stopped();
    if (ended == core::Ended::failed)
        throw Error(core::one_line(video.string()) + ": " + what + "; " + core::one_line(log.string()) +
                    " has its reason");
}

/// What ffprobe says of the video; empty if it says nothing.
std::string probe(const fs::path& video, const char* entries, const fs::path& log) {
    if (core::find_program("ffprobe").empty()) return {};
    std::vector<std::string> words{"ffprobe"};
    for (std::string& word : input_words(video)) words.push_back(std::move(word));
    words.insert(words.end(), {"-select_streams", "v:0", "-show_entries", entries, "-of", "csv=p=0"});
    std::string text;
    const core::Program program{.command = std::move(words), .environment = {}, .log = log};
    const core::Ended ended = core::run_program(program, [&](std::string_view piece) {
        text += piece;
        return true;
    });
    return ended == core::Ended::done ? std::string(core::trim(text)) : std::string();
}

/// The number of frames that the video's header states; 0 if it states none.
int stated_frames(const fs::path& video, const fs::path& log) {
    return core::parse_integer<int>(probe(video, "stream=nb_frames", log)).value_or(0);
}

std::vector<double> measure(const fs::path& video, const fs::path& log, const ProgressFunction& progress) {
    const int total = stated_frames(video, log);
    std::vector<double> result;
    PgmStream stream([&](const std::uint8_t* pixels, int width, int height) {
        result.push_back(sharpness(pixels, width, height));
    });
    std::vector<std::string> command = ffmpeg(video);
    for (const char* word : {"-vf", "scale=480:-2", "-vsync", "0", "-f", "image2pipe", "-c:v", "pgm", "-"})
        command.emplace_back(word);
    static_assert(kSmallWidth == 480);
    check<InputError>(
        core::run_program(
            {.command = std::move(command), .environment = {}, .log = log},
            [&](std::string_view piece) {
                stream.add(piece);
                const int done = int(result.size());
                return progress(
                    {CapturePhase::frames, "looked at", "frames", done, std::max(total, done), {}});
            }),
        video, "ffmpeg cannot read the video", log);
    return result;
}

}  // namespace

double sharpness(const std::uint8_t* pixels, int width, int height) {
    if (width < 3 || height < 3) return 0;
    double sum = 0, squares = 0;
    for (int y = 1; y + 1 < height; ++y)
        for (int x = 1; x + 1 < width; ++x) {
            const std::uint8_t* p = pixels + ptrdiff_t(y) * width + x;
            const int laplacian = p[-1] + p[1] + p[-width] + p[width] - 4 * p[0];
            sum += laplacian;
            squares += double(laplacian) * laplacian;
        }
    const double count = double(width - 2) * (height - 2), mean = sum / count;
    return squares / count - mean * mean;
}

std::vector<int> sharpest(const std::vector<double>& sharpness, int parts) {
    const size_t count = sharpness.size(), used = std::min(count, size_t(parts));
    std::vector<int> result;
    for (size_t part = 0; part < used; ++part) {
        const auto begin = sharpness.begin() + ptrdiff_t(part * count / used),
                   end = sharpness.begin() + ptrdiff_t((part + 1) * count / used);
        result.push_back(int(std::max_element(begin, end) - sharpness.begin()));
    }
    return result;
}

void PgmStream::add(std::string_view bytes) {
    rest_ += bytes;
    while (take_one()) {
    }
}

bool PgmStream::take_one() {
    // P5, width, height and the largest value, with single white space between them.
    uint64_t numbers[3];
    size_t at = 2;
    if (rest_.size() < 2) return false;
    bool good = rest_.starts_with("P5");
    for (uint64_t& number : numbers) {
        while (at < rest_.size() && std::string_view(" \t\n\r").find(rest_[at]) != std::string_view::npos)
            ++at;
        const size_t end = rest_.find_first_of(" \t\n\r", at);
        if (end == std::string::npos) {
            if (good && rest_.size() < 64) return false;
            throw RunError("ffmpeg's output is not PGM");
        }
        const auto parsed = core::parse_integer<uint64_t>(std::string_view(rest_).substr(at, end - at));
        good = good && parsed.has_value();
        number = parsed.value_or(0);
        at = end;
    }
    const uint64_t width = numbers[0], height = numbers[1];
    if (!good || width == 0 || height == 0 || numbers[2] != 255 || width > kMostPixels ||
        height > kMostPixels / width)
        throw RunError("ffmpeg's output is not PGM");
    const size_t first = at + 1, size = size_t(width * height);
    if (rest_.size() < first + size) return false;
    image_(reinterpret_cast<const std::uint8_t*>(rest_.data() + first), int(width), int(height));
    rest_.erase(0, first + size);
    return true;
}

void require_ffmpeg() {
    if (core::find_program("ffmpeg").empty())
        throw RunError("a video needs ffmpeg, which is not installed (Debian: apt install ffmpeg)");
}

ImageSize video_size(const fs::path& video) {
    const std::string text = probe(video, "stream=width,height", "/dev/null");
    const size_t comma = text.find(',');
    if (comma == std::string::npos) return {};
    const auto width = core::parse_integer<int>(text.substr(0, comma)),
               height = core::parse_integer<int>(text.substr(comma + 1));
    return width && height ? ImageSize{*width, *height} : ImageSize();
}

void extract_frames(const fs::path& video, const fs::path& images, int frames, const fs::path& log,
                    const ProgressFunction& progress) {
    const std::vector<int> chosen = sharpest(measure(video, log, progress), frames);
    if (chosen.empty()) throw InputError(core::one_line(video.string()) + ": the video has no frames");
    std::string filter = "select='";
    for (size_t i = 0; i < chosen.size(); ++i) {
        filter += i > 0 ? "+eq(n," : "eq(n,";
        filter += std::to_string(chosen[i]);
        filter += ")";
    }
    fs::path partial = images;
    partial += ".partial";
    fs::remove_all(partial);
    core::make_folder(partial);
    std::vector<std::string> command = ffmpeg(video);
    for (const std::string& word : {std::string("-vf"), filter + "'", std::string("-vsync"), std::string("0"),
                                    std::string("-q:v"), std::string("2"), frame_pattern(partial)})
        command.push_back(word);
    const int total = int(chosen.size());
    check<RunError>(
        core::run_program(
            {.command = std::move(command), .environment = {}, .log = log},
            [&](std::string_view) {
                const auto files = std::distance(fs::directory_iterator(partial), {});
                return progress(
                    {CapturePhase::frames, "extracted", "frames", std::min(int(files), total), total, {}});
            }),
        video, "ffmpeg cannot write the frames", log);
    fs::rename(partial, images);
}

}  // namespace ewa::capture
