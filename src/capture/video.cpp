// SPDX-License-Identifier: Apache-2.0
// Frames of a video by ffmpeg. A first pass reads all frames at a small size and measures their sharpness. A second pass
// writes those that were chosen.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <optional>
#include <set>

#include "capture/film.h"
#include "capture/steps.h"
#include "core/atomic_file.h"
#include "core/folders.h"
#include "core/packages.h"
#include "core/process.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "image/image_files.h"

namespace ewa::capture {
namespace {

namespace fs = std::filesystem;

constexpr int kSmallWidth = 480;   // px, of the frames whose sharpness is compared
constexpr int kQuality = 97;       // of a JPEG whose flat colours are exact
constexpr double kUsualRate = 25;  // frames a second, of a film that names none
// Frames keep their number where ffmpeg neither repeats nor drops any: they are counted at 25 Hz. Releases of ffmpeg have no other
// way in common, since -vsync ends before 9, and -fps_mode begins with 5.1.
constexpr const char* kCounted = "settb=1/25,setpts=N";
constexpr const char* kExact = ":flags=bicubic+accurate_rnd+full_chroma_int+full_chroma_inp";

struct Film {
    fs::path path;
    FilmInfo info;
    std::vector<double> sharpness;  // of each frame
};

std::vector<std::string> ffmpeg(const Film& film, const std::vector<std::string>& more) {
    // ffmpeg 4.2 repeats the first frames of a GIF unless its own times are passed over too.
    std::vector<std::string> words{"ffmpeg", "-nostdin", "-hide_banner", "-v", "error", "-r", "25"};
    for (std::string& word : film_input(film.path)) words.push_back(std::move(word));
    // V: pictures that are no cover of a record.
    const int stream = film.info.stream;
    words.insert(words.end(), {"-map", "0:" + (stream < 0 ? "V:0" : std::to_string(stream))});
    words.insert(words.end(), more.begin(), more.end());
    return words;
}

/// The pattern of the frames' names. A percent sign of the folder is doubled, since ffmpeg counts by the others.
std::string frame_pattern(const fs::path& folder) {
    std::string text = "file:";
    for (const char c : folder.string()) text.append(c == '%' ? 2 : 1, c);
    return text + "/frame_%05d.jpg";
}

std::string frame_name(int number) {
    const std::string digits = std::to_string(number);
    return "frame_" + std::string(size_t(std::max(0, 5 - int(digits.size()))), '0') + digits + ".jpg";
}

/// Runs ffmpeg on a film. Returns whether it has read the film to its end. Throws Error, with `what`, if there is nothing to keep.
template <class Error>
bool run(const Film& film, const std::vector<std::string>& more, const fs::path& log, const char* what,
         const std::function<bool(std::string_view)>& output, const std::function<bool()>& has_some) {
    const core::Ended ended =
        core::run_program({.command = ffmpeg(film, more), .environment = {}, .log = log}, output);
    if (ended == core::Ended::stopped) throw Stopped();
    if (ended == core::Ended::failed && !has_some())
        throw Error(core::one_line(film.path.string()) + ": " + what + "; " + core::one_line(log.string()) +
                    " has its reason");
    return ended == core::Ended::done;
}

/// Measures the frames of all films.
class Measuring {
  public:
    Measuring(const fs::path& log, const ProgressFunction& progress) : log_(log), progress_(progress) {}

    void look_at(Film& film) {
        film.info = film_info(film.path, [&] { return say(0); });
        expected_ += film.info.frames;
    }
    /// Returns a remark; usually empty.
    std::string measure(Film& film) {
        PgmStream stream([&](const std::uint8_t* pixels, int width, int height) {
            film.sharpness.push_back(sharpness(pixels, width, height));
        });
        static_assert(kSmallWidth == 480);
        const bool whole = run<InputError>(
            film,
            {"-vf", std::string("scale=480:-2,format=gray,") + kCounted, "-r", "25", "-f", "image2pipe",
             "-c:v", "pgm", "-"},
            log_, "ffmpeg cannot read the video",
            [&](std::string_view piece) {
                stream.add(piece);
                return say(film.sharpness.size());
            },
            [&] { return !film.sharpness.empty(); });
        done_ += film.sharpness.size();
        const std::string name = core::one_line(film.path.string());
        if (film.sharpness.empty()) throw InputError(name + ": the video has no frames");
        const size_t read = film.sharpness.size(), stated = size_t(std::max(0, film.info.stated));
        if (whole && 10 * read >= 9 * stated) return {};
        return name + " is damaged: ffmpeg has read " +
               (stated > read ? std::to_string(read) + " of its " + core::counted(stated, "frame")
                              : core::counted(read, "frame") + " of it");
    }
    void end() {
        expected_ = int(done_);
        if (!say(0)) throw Stopped();
    }

  private:
    /// A film may have more frames than it states, or state none. The total then stays ahead, since a line is printed where it is reached.
    bool say(size_t more) {
        constexpr int kAhead = 2, kLeast = 100;
        const int done = int(done_ + more);
        if (done > expected_) expected_ = std::max(kLeast, kAhead * done);
        return progress_({CapturePhase::frames, "looked at", "frames", done, expected_, {}});
    }

    fs::path log_;
    const ProgressFunction& progress_;
    size_t done_ = 0;
    int expected_ = 0;
};

/// The parts of each film, of which one frame is taken: about as many a second of each film, together `frames`.
std::vector<int> parts_of(const std::vector<Film>& films, int frames) {
    std::vector<double> seconds;
    for (const Film& film : films)
        seconds.push_back(double(film.sharpness.size()) / (film.info.rate > 0 ? film.info.rate : kUsualRate));
    const double all = std::accumulate(seconds.begin(), seconds.end(), 0.0);
    std::vector<int> parts;
    for (const double each : seconds) parts.push_back(std::max(1, int(std::lround(frames * each / all))));
    return parts;
}

/// Names of folders for the films: their own names as far as these differ and fit a line of COLMAP's lists.
std::vector<std::string> folder_names(const std::vector<Film>& films) {
    std::set<std::string> taken;
    std::vector<std::string> names;
    for (const Film& film : films) {
        std::string name = film.path.stem().string();
        for (char& c : name)
            if (static_cast<unsigned char>(c) <= ' ' || c == 0x7f) c = '_';
        const std::string usual = name;
        for (int i = 2; !taken.insert(name).second; ++i) name = usual + "-" + std::to_string(i);
        names.push_back(name);
    }
    return names;
}

/// Writes these frames of a film. done(count): called now and then; false ends the work.
void write_frames(const Film& film, const std::vector<int>& chosen, const fs::path& folder,
                  const fs::path& log, const std::function<bool(int)>& done) {
    core::make_folder(folder);
    std::string filter = "select='";
    for (size_t i = 0; i < chosen.size(); ++i) {
        filter += i > 0 ? "+eq(n," : "eq(n,";
        filter += std::to_string(chosen[i]);
        filter += ")";
    }
    filter += std::string("',") + kCounted + ",scale=in_color_matrix=" + matrix_word(film.info) + kExact;
    std::vector<std::string> words{"-vf", filter, "-r", "25", "-frames:v", std::to_string(chosen.size())};
    const HdrTransfer transfer = hdr_transfer(film.info);
    int written = 0;
    const HdrMap map(transfer);
    PgmStream deep(
        [&](const std::uint8_t* pixels, int width, int height) {
            const std::vector<unsigned char> jpeg =
                image::encode_jpeg(map.map(pixels, width, height), kQuality);
            core::AtomicFile file(folder / frame_name(++written));
            file.write(jpeg.data(), jpeg.size());
            file.commit();
        },
        PgmStream::kDeepColour);
    if (transfer == HdrTransfer::none) {
        // A JPEG has the matrix and range of JFIF, which ffmpeg does not convert to by itself.
        words[1] += std::string(",format=gbrp,scale=out_color_matrix=bt601:out_range=full") + kExact;
        words.insert(words.end(), {"-q:v", "2", frame_pattern(folder)});
    } else {
        words[1] += ",format=rgb48be";
        words.insert(words.end(), {"-f", "image2pipe", "-c:v", "ppm", "-"});
    }
    const auto count = [&] {
        return transfer == HdrTransfer::none ? int(std::distance(fs::directory_iterator(folder), {}))
                                             : written;
    };
    run<RunError>(
        film, words, log, "ffmpeg cannot write the frames",
        [&](std::string_view piece) {
            if (transfer != HdrTransfer::none) deep.add(piece);
            return done(count());
        },
        [&] { return count() > 0; });
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
    // P5 or P6, width, height and the largest value, with single white space between them.
    uint64_t numbers[3];
    size_t at = 2;
    if (rest_.size() < 2) return false;
    bool good = rest_.starts_with(kind_.magic);
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
    if (!good || width == 0 || height == 0 || numbers[2] != kind_.largest || width > kind_.most_pixels ||
        height > kind_.most_pixels / width)
        throw RunError("ffmpeg's output is not PGM");
    const size_t first = at + 1, size = size_t(width * height) * kind_.pixel_bytes;
    if (rest_.size() < first + size) return false;
    image_(reinterpret_cast<const std::uint8_t*>(rest_.data() + first), int(width), int(height));
    rest_.erase(0, first + size);
    return true;
}

void require_ffmpeg() {
    if (core::find_program("ffmpeg").empty())
        throw RunError("a video needs ffmpeg, which is not installed (" +
                       core::how_to_install(core::Thing::ffmpeg) + ")");
}

std::vector<std::string> film_input(const fs::path& video) {
    return {"-protocol_whitelist",
            "file",
            "-format_whitelist",
            "mov,matroska,avi,mpegts,mpeg,mpegvideo,asf,ogg,gif,flv,mxf",
            "-i",
            "file:" + video.string()};
}

ImageSize video_size(const fs::path& video) {
    const FilmInfo info = film_info(video, [] { return true; });
    return {info.width, info.height};
}

std::vector<std::string> extract_frames(const std::vector<fs::path>& paths, const fs::path& images,
                                        int frames, const fs::path& log, const ProgressFunction& progress) {
    std::vector<Film> films;
    std::vector<std::string> remarks;
    std::optional<InputError> fault;
    Measuring measuring(log, progress);
    const auto each = [&](const std::function<std::string(Film&)>& work) {
        std::erase_if(films, [&](Film& film) {
            try {
                if (const std::string remark = work(film); !remark.empty()) remarks.push_back(remark);
                return false;
            } catch (const InputError& error) {
                fault = error;
                remarks.push_back(std::string(error.what()) + "; it is not used");
                return true;
            }
        });
    };
    for (const fs::path& path : paths) films.push_back({path, {}, {}});
    each([&](Film& film) {
        measuring.look_at(film);
        return std::string();
    });
    each([&](Film& film) { return measuring.measure(film); });
    if (films.empty()) throw *fault;
    measuring.end();
    const std::vector<int> parts = parts_of(films, frames);
    std::vector<std::vector<int>> chosen;
    int total = 0, before = 0;
    for (size_t i = 0; i < films.size(); ++i) {
        chosen.push_back(sharpest(films[i].sharpness, paths.size() == 1 ? frames : parts[i]));
        total += int(chosen[i].size());
    }
    fs::path partial = images;
    partial += ".partial";
    fs::remove_all(partial);
    core::make_folder(partial);
    const std::vector<std::string> names = folder_names(films);
    for (size_t i = 0; i < films.size(); ++i) {
        write_frames(
            films[i], chosen[i], paths.size() == 1 ? partial : partial / names[i], log, [&](int done) {
                return progress(
                    {CapturePhase::frames, "extracted", "frames", std::min(before + done, total), total, {}});
            });
        before += int(chosen[i].size());
    }
    fs::rename(partial, images);
    return remarks;
}

}  // namespace ewa::capture
