// SPDX-License-Identifier: Apache-2.0
#include "image/film_file.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <string_view>

#include "core/atomic_file.h"
#include "core/packages.h"
#include "core/process.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::image {
namespace {

namespace fs = std::filesystem;

/// The last line that is not empty: ffmpeg's own reason.
std::string last_line_of(const fs::path& log) {
    std::ifstream file(log);
    std::string last;
    for (std::string line; std::getline(file, line);)
        if (!core::trim(line).empty()) last = line;
    return core::one_line(last);
}

/// A frame has the colours of a screen, and players expect those of television (BT.709), with every second value
/// of the two colour differences in each direction.
constexpr const char* kFilter =
    "crop=trunc(iw/2)*2:trunc(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv,format=yuv420p";

/// Encoders of each codec, the best of those that need no special hardware first, with what makes them usable.
struct Encoder {
    std::string_view codec, name;
    std::vector<std::string> options = {};
};
const std::vector<Encoder>& encoders() {
    static const std::vector<Encoder> list = {
        {"h264", "libx264"},
        {"h264", "libopenh264"},
        {"hevc",
         "libx265",
         {"-tag:v", "hvc1", "-x265-params", "log-level=error"}},  // the tag: for Apple's players
        {"av1", "libsvtav1", {"-preset", "8", "-crf", "30"}},
        {"av1", "libaom-av1", {"-cpu-used", "6", "-row-mt", "1", "-crf", "30"}},
        {"av1", "librav1e", {"-speed", "8", "-qp", "80"}},
        {"vp9", "libvpx-vp9", {"-row-mt", "1", "-crf", "31", "-b:v", "0"}}};
    return list;
}

std::vector<std::string> arguments_of(const fs::path& program, const std::string& encoder,
                                      const fs::path& made, int width, int height, double rate) {
    std::vector<std::string> arguments = {program.string(),
                                          "-hide_banner",
                                          "-loglevel",
                                          "error",
                                          "-y",
                                          "-f",
                                          "rawvideo",
                                          "-pixel_format",
                                          "rgba",
                                          "-video_size",
                                          fmt::format("{}x{}", width, height),
                                          "-framerate",
                                          fmt::format("{:.6g}", rate),
                                          "-i",
                                          "pipe:0",
                                          "-an",
                                          "-vf",
                                          kFilter,
                                          "-colorspace",
                                          "bt709",
                                          "-color_primaries",
                                          "bt709",
                                          "-color_trc",
                                          "bt709",
                                          "-color_range",
                                          "tv"};
    if (const auto known = std::ranges::find(encoders(), encoder, &Encoder::name);
        known != encoders().end()) {
        arguments.insert(arguments.end(), {"-c:v", encoder});
        arguments.insert(arguments.end(), known->options.begin(), known->options.end());
    }
    arguments.push_back(made.string());
    return arguments;
}

}  // namespace

bool is_film_name(const fs::path& path) {
    const std::string extension = core::lower(path.extension().string());
    return extension == ".mp4" || extension == ".mov" || extension == ".mkv" || extension == ".webm";
}

fs::path find_ffmpeg() {
    fs::path program = core::find_program("ffmpeg");
    if (!program.empty()) return program;
    throw RunError("a film needs the program ffmpeg, which is not installed (" +
                   core::how_to_install(core::Thing::ffmpeg) +
                   "); with a folder as -o, its frames are written as PNG files");
}

std::string find_encoder(const std::string& codec, const fs::path& file) {
    if (codec.empty()) return {};
    // What ffmpeg's muxers take; .mp4 and .mkv take all four.
    const std::string extension = core::lower(file.extension().string());
    const bool modern = codec == "av1" || codec == "vp9";
    if ((extension == ".webm" && !modern) || (extension == ".mov" && modern))
        throw InputError("--codec " + codec + ": a " + extension + " has none of it, but " +
                         (modern ? "h264 or hevc" : "av1 or vp9") + "; an .mp4 and an .mkv have all");
    const std::string listed = core::ask_program({.command = {find_ffmpeg().string(), "-hide_banner",
                                                              "-loglevel", "error", "-encoders"},
                                                  .environment = {},
                                                  .log = {}})
                                   .text;
    std::string wanted;
    for (const Encoder& encoder : encoders()) {
        if (encoder.codec != codec) continue;
        if (listed.find(std::string(" ").append(encoder.name).append(" ")) != std::string::npos)
            return std::string(encoder.name);
        wanted.append(wanted.empty() ? "" : ", ").append(encoder.name);
    }
    throw RunError("--codec " + codec + ": this ffmpeg has no encoder for it, such as " + wanted);
}

FilmFile::FilmFile(const fs::path& file, int width, int height, const std::string& encoder, double rate)
    : file_(file), folder_("ewa-film-"), made_(folder_.path() / ("film" + file.extension().string())) {
    if (width < 2 || height < 2) throw InputError("a film needs at least 2x2 pixels");
    const fs::path program = find_ffmpeg();
    if (const auto error = input_.open()) throw RunError("cannot connect to ffmpeg: " + error.message());
    platform::File log;
    log.open(folder_.path() / "log", platform::Open::create_owned);
    process_ = core::start_program(arguments_of(program, encoder, made_, width, height, rate), {},
                                   {.input = input_.from.handle(), .errors = log.handle()});
    input_.from.close();
}

FilmFile::~FilmFile() {
    if (!process_.is_open()) return;
    process_.kill();
    process_.wait();
}

void FilmFile::fail(const platform::ProcessEnd& ended) {
    std::string reason = last_line_of(folder_.path() / "log");
    if (reason.empty())
        reason = ended.signal ? fmt::format("it ended by signal {}", ended.signal)
                              : fmt::format("exit status {}, no film", ended.status);
    throw RunError(core::one_line(file_.string()) + ": ffmpeg failed: " + reason);
}

platform::ProcessEnd FilmFile::end() {
    input_.to.close();
    return process_.wait();
}

void FilmFile::add(const std::vector<uint8_t>& rgba) {
    if (input_.write(rgba.data(), rgba.size())) fail(end());
}

void FilmFile::finish() {
    const platform::ProcessEnd ended = end();
    std::error_code error;
    if (ended.code() != 0 || fs::file_size(made_, error) == 0 || error) fail(ended);
    std::ifstream made(made_, std::ios::binary);
    core::AtomicFile kept(file_);
    std::vector<char> part(1u << 20);
    while (made.read(part.data(), std::streamsize(part.size())) || made.gcount() > 0)
        kept.write(part.data(), size_t(made.gcount()));
    kept.commit();
}

}  // namespace ewa::image
