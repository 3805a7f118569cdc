// SPDX-License-Identifier: Apache-2.0
#include "capture/film.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <nlohmann/json.hpp>
#include <regex>

#include "capture/steps.h"
#include "core/json.h"
#include "core/json_field.h"
#include "core/parallel.h"
#include "core/process.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "scene/color.h"

namespace ewa::capture {
namespace {

namespace fs = std::filesystem;
using core::text_in;
using Json = nlohmann::json;

/// "30000/1001", "25" or "0/0".
double ratio(const std::string& text) {
    const size_t slash = text.find('/');
    const double above = core::parse_number(text.substr(0, slash)).value_or(0);
    const double below =
        slash == std::string::npos ? 1 : core::parse_number(text.substr(slash + 1)).value_or(0);
    return above > 0 && below > 0 ? above / below : 0;
}

/// Seconds, or hours, minutes and seconds.
double seconds_of(const std::string& text) {
    double seconds = 0;
    for (size_t at = 0; at <= text.size(); at = std::min(text.find(':', at), text.size()) + 1)
        seconds = 60 * seconds + core::parse_number(text.substr(at, text.find(':', at) - at)).value_or(0);
    return std::isfinite(seconds) ? seconds : 0;
}

int whole_of(const Json& object, const char* key) {
    return int(std::clamp(core::number_in(object, key).value_or(0), 0.0, double(INT32_MAX)));
}

int count_of(double rate, double seconds) {
    constexpr double kMost = 1e8;
    return int(std::clamp(rate * seconds, 0.0, kMost) + 0.5);
}

/// The answer of a program that says something of the film.
std::string said(std::vector<std::string> words, const fs::path& film, const std::vector<std::string>& more,
                 const std::function<bool()>& go_on) {
    for (std::string& word : film_input(film)) words.push_back(std::move(word));
    words.insert(words.end(), more.begin(), more.end());
    const bool errors = words[0] == "ffmpeg";
    const core::Answer answer = core::ask_program(
        {.command = std::move(words), .environment = {}, .log = platform::kNullFile, .joined = errors},
        go_on);
    if (answer.ended == core::Ended::stopped) throw Stopped();
    return answer.ended == core::Ended::done || errors ? answer.text : std::string();
}

/// What ffprobe says with this option. Its "streams" is a list of objects.
Json probed(const fs::path& film, const char* option, const std::function<bool()>& go_on) try {
    const std::string text = said(
        {"ffprobe", "-v", "error", option}, film,
        {"-of", "json", "-show_entries",
         "stream=index,codec_type,width,height,color_space,color_transfer,avg_frame_rate,nb_frames,"
         "nb_read_packets,duration:stream_disposition=attached_pic:stream_tags=DURATION:format=duration"},
        go_on);
    Json root = core::parse_json<Json>(text, "ffprobe");
    const auto is_object = [](const Json& stream) { return stream.is_object(); };
    if (root.is_object() && root.contains("streams") && std::ranges::all_of(root["streams"], is_object))
        return root;
    return {{"streams", Json::array()}};
} catch (const InputError&) {
    return {{"streams", Json::array()}};
}

struct Streams {
    FilmInfo info;
    bool other_streams = false;  // of sound, say
};

void keep_largest(Streams& found, const FilmInfo& stream) {
    FilmInfo& best = found.info;
    const int streams = best.streams + 1;
    if (best.stream < 0 || int64_t(stream.width) * stream.height > int64_t(best.width) * best.height)
        best = stream;
    best.streams = streams;
}

Streams by_ffprobe(const fs::path& film, const std::function<bool()>& go_on) {
    Streams found;
    const auto integer = [](const std::string& text) { return core::parse_integer<int>(text).value_or(0); };
    const Json root = probed(film, "-hide_banner", go_on);
    const Json format = root.value("format", Json::object());
    for (const Json& stream : root["streams"]) {
        found.other_streams = true;
        const Json disposition = stream.value("disposition", Json::object());
        if (text_in(stream, "codec_type") != "video" || whole_of(disposition, "attached_pic") != 0) continue;
        FilmInfo info{.stream = whole_of(stream, "index"),
                      .width = whole_of(stream, "width"),
                      .height = whole_of(stream, "height"),
                      .frames = integer(text_in(stream, "nb_frames")),
                      .stated = integer(text_in(stream, "nb_frames")),
                      .rate = ratio(text_in(stream, "avg_frame_rate")),
                      .matrix = text_in(stream, "color_space"),
                      .transfer = text_in(stream, "color_transfer")};
        const Json tags = stream.value("tags", Json::object());
        for (const std::string& duration :
             {text_in(stream, "duration"), text_in(tags, "DURATION"), text_in(format, "duration")})
            if (info.frames < 1) info.frames = count_of(info.rate, seconds_of(duration));
        keep_largest(found, info);
    }
    FilmInfo& best = found.info;
    const auto ask_again = [&](const char* option, const std::function<void(const Json&)>& take) {
        const Json again = probed(film, option, go_on);
        for (const Json& stream : again["streams"])
            if (whole_of(stream, "index") == best.stream) take(stream);
    };
    if (best.stream >= 0 && best.frames < 1)
        ask_again("-count_packets",
                  [&](const Json& stream) { best.frames = integer(text_in(stream, "nb_read_packets")); });
    // The frames of ProRes may name no colours where the container does.
    if (best.stream >= 0 && best.matrix.empty())
        ask_again("-nofind_stream_info", [&](const Json& stream) {
            best.matrix = text_in(stream, "color_space");
            best.transfer = text_in(stream, "color_transfer");
        });
    return found;
}

/// Such as "Stream #0:1[0x2](und): Video: hevc (Main 10), yuv420p10le(tv, bt2020nc/bt2020/arib-std-b67), 64x48, 30 fps".
Streams by_ffmpeg(const fs::path& film, const std::function<bool()>& go_on) {
    static const std::regex duration(R"(Duration: ([0-9:.]+))"), stream(R"(Stream #0:(\d+).*?: (\w+): (.*))"),
        size(R"(, (\d+)x(\d+))"), rate(R"(([0-9.]+) fps)"),
        colours(R"(\((?:[^()]*, )?([a-z0-9-]+)/([a-z0-9-]+)/([a-z0-9-]+)[,)])"), one(R"(\b(bt709)\b)");
    Streams found;
    double seconds = 0;
    std::smatch match;
    const std::string text = said({"ffmpeg", "-nostdin", "-hide_banner"}, film, {}, go_on);
    for (size_t at = 0; at < text.size();) {
        const std::string line = text.substr(at, text.find('\n', at) - at);
        at += line.size() + 1;
        if (std::regex_search(line, match, duration)) seconds = seconds_of(match[1]);
        if (!std::regex_search(line, match, stream)) continue;
        found.other_streams = true;
        const std::string rest = match[3];
        if (match[2] != "Video" || rest.ends_with("(attached pic)")) continue;
        FilmInfo info;
        info.stream = core::parse_integer<int>(match[1].str()).value_or(-1);
        if (std::regex_search(rest, match, size)) {
            info.width = core::parse_integer<int>(match[1].str()).value_or(0);
            info.height = core::parse_integer<int>(match[2].str()).value_or(0);
        }
        if (std::regex_search(rest, match, rate)) info.rate = ratio(match[1]);
        info.frames = count_of(info.rate, seconds);
        if (std::regex_search(rest, match, colours)) {
            info.matrix = match[1];
            info.transfer = match[3];
        } else if (std::regex_search(rest, match, one)) {
            info.matrix = match[1];
        }
        keep_largest(found, info);
    }
    return found;
}

/// Cameras of two fisheyes have extensions of their own, also for films of one lens.
void refuse_fisheyes(const fs::path& film, const FilmInfo& info) {
    struct Maker {
        const char *extension, *program;
    };
    constexpr std::array kMakers{Maker{".insv", "Insta360 Studio"}, Maker{".360", "GoPro Player"}};
    for (const Maker& maker : kMakers)
        if (core::lower(film.extension().string()) == maker.extension &&
            (info.streams > 1 || info.width == info.height || info.width == 2 * info.height))
            throw InputError(core::one_line(film.string()) +
                             ": its pictures are fisheyes that are not yet one picture; export it with " +
                             maker.program + " as a 360° MP4");
}

constexpr size_t kCodes = 65536;
constexpr double kWhite = 203;                               // cd/m² (BT.2408)
constexpr double kHlgPeak = 1000, kHlgGamma = 1.2;           // of BT.2100's reference display
constexpr std::array kLuminance{0.2627f, 0.6780f, 0.0593f};  // BT.2020

/// The light of the scene, 0 to 1 (BT.2100, table 5).
double linear_of_hlg(double code) {
    constexpr double a = 0.17883277, b = 1 - 4 * a, c = 0.55991072952956202;
    return code <= 0.5 ? code * code / 3 : (std::exp((code - c) / a) + b) / 12;
}

/// cd/m² (BT.2100, table 4).
double luminance_of_pq(double code) {
    constexpr double m1 = 2610.0 / 16384, m2 = 2523.0 / 32, c1 = 3424.0 / 4096, c2 = 2413.0 / 128,
                     c3 = 2392.0 / 128;
    const double root = std::pow(code, 1 / m2);
    return 10000 * std::pow(std::max(0.0, root - c1) / (c2 - c3 * root), 1 / m1);
}

/// From BT.2020's primaries to those of sRGB (BT.2087).
constexpr float kToSrgb[3][3] = {{1.660491f, -0.587641f, -0.072850f},
                                 {-0.124551f, 1.132900f, -0.008349f},
                                 {-0.018151f, -0.100579f, 1.118730f}};

}  // namespace

FilmInfo film_info(const fs::path& film, const std::function<bool()>& go_on) {
    const Streams found =
        core::find_program("ffprobe").empty() ? by_ffmpeg(film, go_on) : by_ffprobe(film, go_on);
    if (found.info.stream < 0 && found.other_streams)
        throw InputError(core::one_line(film.string()) + ": has no pictures");
    refuse_fisheyes(film, found.info);
    return found.info;
}

std::string matrix_word(const FilmInfo& info) {
    struct Word {
        const char *name, *word;
    };
    constexpr std::array kWords{Word{"bt709", "bt709"},    Word{"bt2020nc", "bt2020"},
                                Word{"bt2020c", "bt2020"}, Word{"smpte240m", "smpte240m"},
                                Word{"fcc", "fcc"},        Word{"smpte170m", "bt601"},
                                Word{"bt470bg", "bt601"}};
    for (const Word& word : kWords)
        if (info.matrix == word.name) return word.word;
    if (hdr_transfer(info) != HdrTransfer::none) return "bt2020";
    constexpr int kHdWidth = 1280, kHdHeight = 720;
    return std::max(info.width, info.height) >= kHdWidth && std::min(info.width, info.height) >= kHdHeight
               ? "bt709"
               : "bt601";
}

bool is_film(const fs::path& file) {
    constexpr std::array kExtensions{".mp4", ".mov", ".m4v", ".mkv", ".webm", ".avi",  ".mts", ".m2ts",
                                     ".ts",  ".3gp", ".3g2", ".wmv", ".asf",  ".ogv",  ".gif", ".mpg",
                                     ".flv", ".mxf", ".lrv", ".lrf", ".mpeg", ".insv", ".360", ".vob",
                                     ".m2v", ".mod", ".f4v", ".qt",  ".divx"};
    return std::ranges::find(kExtensions, core::lower(file.extension().string())) != kExtensions.end();
}

std::vector<fs::path> take_proxies(std::vector<fs::path>& films) {
    const auto is_proxy = [](const fs::path& film) {
        // GoPro's and DJI's, Insta360's, Sony's, and those of editors.
        const std::string extension = core::lower(film.extension().string()),
                          stem = core::lower(film.stem().string());
        const auto is_folder_of = [](const fs::path& part) {
            const std::string name = core::lower(part.string());
            return name == "proxy" || name == "proxies";
        };
        static const std::regex sony(".*[0-9]s0[0-9]"), editors("(.*[_. -])?proxy([_. -].*)?");
        return extension == ".lrv" || extension == ".lrf" || stem.starts_with("lrv_") ||
               std::regex_match(stem, sony) || std::regex_match(stem, editors) ||
               std::ranges::any_of(film.parent_path(), is_folder_of);
    };
    std::vector<fs::path> proxies;
    std::ranges::copy_if(films, std::back_inserter(proxies), is_proxy);
    if (proxies.size() == films.size()) return {};
    std::erase_if(films, is_proxy);
    return proxies;
}

HdrTransfer hdr_transfer(const FilmInfo& info) {
    return info.transfer == "arib-std-b67" ? HdrTransfer::hlg
           : info.transfer == "smpte2084"  ? HdrTransfer::pq
                                           : HdrTransfer::none;
}

HdrMap::HdrMap(HdrTransfer transfer) : transfer_(transfer), linear_(kCodes), coded_(kCodes) {
    for (size_t i = 0; i < kCodes; ++i) {
        const double value = double(i) / (kCodes - 1);
        linear_[i] =
            float(transfer == HdrTransfer::hlg ? linear_of_hlg(value) : luminance_of_pq(value) / kWhite);
        coded_[i] = float(scene::srgb_of_linear(value));
    }
}

Image HdrMap::map(const std::uint8_t* rgb, int width, int height) const {
    Image image(width, height, 3);
    core::on_all_cores(size_t(height), [&](size_t y) {
        const size_t row = y * size_t(width) * 3;
        for (size_t at = row; at < row + size_t(width) * 3; at += 3) {
            std::array<float, 3> light;
            for (size_t c = 0; c < 3; ++c)
                light[c] = linear_[size_t(rgb[2 * (at + c)]) << 8 | rgb[2 * (at + c) + 1]];
            float gain = 1;
            if (transfer_ == HdrTransfer::hlg) {
                const float luminance =
                    kLuminance[0] * light[0] + kLuminance[1] * light[1] + kLuminance[2] * light[2];
                gain = float(kHlgPeak / kWhite) * std::pow(luminance, float(kHlgGamma - 1));
            }
            for (size_t c = 0; c < 3; ++c) {
                const float* m = kToSrgb[c];
                const float value = gain * (m[0] * light[0] + m[1] * light[1] + m[2] * light[2]);
                image.pixels[at + c] = coded_[size_t(std::clamp(value, 0.0f, 1.0f) * (kCodes - 1) + 0.5f)];
            }
        }
    });
    return image;
}

}  // namespace ewa::capture
