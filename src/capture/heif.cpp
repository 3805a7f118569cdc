// SPDX-License-Identifier: Apache-2.0
// Photos of HEIF's family (HEIC, AVIF) become JPEG, by whatever program or library reads them here. It keeps EXIF, and turns the
// pixels.
#include <algorithm>
#include <array>

#include "capture/steps.h"
#include "core/folders.h"
#include "core/process.h"
#include "core/text.h"
#include "ewa/error.h"
#include "image/image_files.h"

namespace ewa::capture {
namespace {

namespace fs = std::filesystem;

struct Converter {
    const char* program;
    bool of_imagemagick;  // which takes its options after the input, and may lack HEIC
};
constexpr std::array kConverters{Converter{"heif-dec", false}, Converter{"heif-convert", false},
                                 Converter{"magick", true}, Converter{"convert", true}};

bool is_here(const Converter& converter) {
    if (core::find_program(converter.program).empty()) return false;
    if (!converter.of_imagemagick) return true;
    const core::Answer formats = core::ask_program(
        {.command = {converter.program, "-list", "format"}, .environment = {}, .log = platform::kNullFile});
    return formats.text.find("HEIC") != std::string::npos;
}

/// One that the folder does not have.
void give_file(const fs::path& from, const fs::path& to) {
    std::error_code error;
    fs::create_hard_link(fs::canonical(from), to, error);
    if (error) fs::copy_file(from, to);
}

/// Programs take some characters of a name as their own, so they get plain names.
bool convert(const fs::path& photo, const fs::path& plain, const fs::path& jpeg, const fs::path& log) {
    const std::string in = plain.string() + core::lower(photo.extension().string()),
                      out = plain.string() + ".jpg";
    give_file(photo, in);
    for (const Converter& converter : kConverters) {
        if (core::find_program(converter.program).empty()) continue;
        const char* quality = converter.of_imagemagick ? "-quality" : "-q";
        std::vector<std::string> words{converter.program, quality, "95"};
        words.insert(converter.of_imagemagick ? words.begin() + 1 : words.end(), in);
        words.push_back(out);
        const core::Answer answer =
            core::ask_program({.command = std::move(words), .environment = {}, .log = log});
        // The first of several pictures in the file is the photo.
        for (const std::string& made : {out, plain.string() + "-1.jpg"})
            if (answer.ended == core::Ended::done && core::is_file(made) &&
                image::image_fault(made).empty()) {
                fs::rename(made, jpeg);
                return true;
            }
    }
    if (!image::write_jpeg_of_heif(in, out)) return false;
    fs::rename(out, jpeg);
    return true;
}

}  // namespace

bool is_heif(const fs::path& file) {
    constexpr std::array kExtensions{".heic", ".heif", ".hif", ".avif"};
    return std::ranges::find(kExtensions, core::lower(file.extension().string())) != kExtensions.end();
}

bool converts_heif() {
    return std::ranges::any_of(kConverters, is_here) || image::reads_heif();
}

fs::path converted_name(const fs::path& name) {
    return is_heif(name) ? fs::path(name).replace_extension(".jpg") : name;
}

void convert_photos(const fs::path& photos, const std::vector<fs::path>& names, const fs::path& folder,
                    const fs::path& log, const ProgressFunction& progress) {
    fs::path partial = folder, plain = folder;
    partial += ".partial";
    plain += ".converted";
    for (const fs::path& each : {partial, plain}) {
        fs::remove_all(each);
        core::make_folder(each);
    }
    for (const fs::path& name : names) core::make_folder((partial / name).parent_path());
    on_all_cores({CapturePhase::photos, "converted", "photos", 0, int(names.size()), {}}, progress,
                 [&](size_t i) {
                     const fs::path to = partial / converted_name(names[i]);
                     if (is_heif(names[i]))
                         convert(photos / names[i], fs::absolute(plain) / std::to_string(i), to, log);
                     else
                         give_file(photos / names[i], to);
                 });
    fs::remove_all(plain);
    fs::rename(partial, folder);
}

}  // namespace ewa::capture
