// SPDX-License-Identifier: Apache-2.0
#include "golden/golden.h"

#include <png.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "core/atomic_file.h"
#include "report/chart.h"
#include "report/page.h"
#include "report/pictures.h"

namespace ewa::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHowToAccept = "scripts/golden-accept writes new references";

/// RGB; a picture of one channel three times.
Image as_rgb(const Image& image) {
    if (image.channels == 3) return image;
    Image out(image.width, image.height, 3);
    for (size_t i = 0; i < out.pixels.size(); ++i) out.pixels[i] = image.pixels[i / 3];
    return out;
}

/// libpng ends an error with longjmp, so no object with a destructor is made here.
bool write_png16(std::FILE* file, int width, int height, int channels, const uint16_t* words) {
    constexpr int kTypes[] = {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                              PNG_COLOR_TYPE_RGB_ALPHA};
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png ? png_create_info_struct(png) : nullptr;
    if (!info || setjmp(png_jmpbuf(png))) {
        png_destroy_write_struct(&png, &info);
        return false;
    }
    png_init_io(png, file);
    png_set_compression_level(png, 9);
    png_set_compression_strategy(png, 0);  // zlib's default
    png_set_filter(png, 0, PNG_NO_FILTERS);
    png_set_IHDR(png, info, png_uint_32(width), png_uint_32(height), 16, kTypes[channels - 1],
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_oFFs(png, info, 0, 0, PNG_OFFSET_PIXEL);
    png_write_info(png, info);
    if (std::endian::native == std::endian::little) png_set_swap(png);
    for (int y = 0; y < height; ++y)
        png_write_row(png, reinterpret_cast<png_const_bytep>(words + size_t(y) * size_t(width * channels)));
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    return true;
}

void write_png16(const fs::path& path, const Image& image) {
    std::vector<uint16_t> words(image.pixels.size());
    std::transform(image.pixels.begin(), image.pixels.end(), words.begin(),
                   [](float v) { return uint16_t(std::lround(65535 * std::clamp(double(v), 0.0, 1.0))); });
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.string().c_str(), "wb"),
                                                               std::fclose);
    if (!file || !write_png16(file.get(), image.width, image.height, image.channels, words.data()) ||
        std::fflush(file.get()) != 0)
        throw std::runtime_error(path.string() + ": cannot be written");
}

bool in_range(const Image& image) {
    return std::all_of(image.pixels.begin(), image.pixels.end(), [](float v) { return v >= 0 && v <= 1; });
}

std::string file_name(std::string text) {
    for (char& c : text)
        if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
    return text;
}

/// The page of all that failed and has not passed since.
void write_page(const fs::path& folder) {
    std::vector<fs::path> cases;
    for (const auto& entry : fs::directory_iterator(folder))
        if (fs::exists(entry.path() / "told.txt")) cases.push_back(entry.path().filename());
    std::sort(cases.begin(), cases.end());
    std::string html = "<style>.trio img { image-rendering: pixelated; }</style><h1>Golden images</h1>\n";
    html += cases.empty() ? "<p>All pass.</p>\n" : fmt::format("<p class=\"soft\">{}</p>\n", kHowToAccept);
    for (const fs::path& name : cases) {
        std::ifstream file(folder / name / "told.txt");
        std::ostringstream told;
        told << file.rdbuf();
        html += fmt::format(
            "<figure class=\"view\"><figcaption><b>{}</b> <span class=\"soft\">{}</span></figcaption>"
            "<div class=\"trio\">\n",
            report::escape_html(name.string()), report::escape_html(told.str()));
        for (const char* picture : {"reference", "candidate", "difference"})
            html +=
                fmt::format("<div><img alt=\"{0}\" src=\"{1}/{0}.png\">{0}</div>\n", picture, name.string());
        html += "</div></figure>\n";
    }
    core::write_text_file(folder / "index.html", report::html_page("Golden images", html));
}

void leave_pictures(const fs::path& folder, const Image& candidate, const Image* reference, double scale,
                    const std::string& told) {
    fs::create_directories(folder);
    save_image(folder / "candidate.png", candidate);
    if (reference) {
        save_image(folder / "reference.png", *reference);
        if (reference->width == candidate.width && reference->height == candidate.height)
            save_image(folder / "difference.png", report::error_map(candidate, *reference, scale));
    }
    core::write_text_file(folder / "told.txt", told);
    write_page(folder.parent_path());
}

}  // namespace

fs::path source_folder() {
    const char* elsewhere = std::getenv("EWA_TEST_SOURCE");
    return elsewhere ? elsewhere : EWA_SOURCE_DIR;
}

GoldenFolders::GoldenFolders()
    : references(source_folder() / "tests/golden/references"),
      failures((std::getenv("EWA_TEST_SOURCE") ? source_folder() / "build" : fs::path(EWA_BINARY_DIR)) /
               "golden") {}

testing::AssertionResult matches_golden(const std::string& name, const Image& candidate,
                                        const Tolerance& tolerance, const std::string& maker,
                                        const GoldenFolders& folders) {
    const fs::path reference_path = folders.references / (name + ".png");
    const fs::path left = folders.failures / (name + "@" + file_name(maker));
    const Image picture = as_rgb(candidate);
    const auto fail = [&](const Image* reference, double scale, const std::string& told) {
        leave_pictures(left, picture, reference, scale, told);
        return testing::AssertionFailure()
               << name << " on " << maker << ": " << told << "; see "
               << (folders.failures / "index.html").string() << "; " << kHowToAccept;
    };
    if (!fs::exists(reference_path)) return fail(nullptr, 1, "there is no reference");
    const Image reference = load_image(reference_path);
    if (picture.width != reference.width || picture.height != reference.height)
        return fail(&reference, 1,
                    fmt::format("{} x {} px, the reference has {} x {}", picture.width, picture.height,
                                reference.width, reference.height));
    const ImageDifference d = compare_images(picture, reference, tolerance.typical);
    const std::string told = fmt::format(
        "max error {:.3g} (allowed {:.3g}) at {},{}; {} px over {:.3g} (allowed {}); PSNR {:.1f} dB",
        d.max_error, tolerance.max_error, d.max_x, d.max_y, d.over, tolerance.typical, tolerance.over,
        d.psnr);
    if (std::getenv("EWA_GOLDEN_TELL")) fmt::print("    {}: {}\n", name, told);
    if (d.max_error <= tolerance.max_error && d.over <= tolerance.over) {
        if (fs::remove_all(left) > 0) write_page(folders.failures);
        return testing::AssertionSuccess();
    }
    return fail(&reference, std::max(4 * tolerance.max_error, 1e-3), told);
}

testing::AssertionResult is_reference(const std::string& name, const Image& truth,
                                      const GoldenFolders& folders) {
    if (!in_range(truth))
        return testing::AssertionFailure() << name << ": values outside 0..1 cannot be kept";
    const fs::path path = folders.references / (name + ".png");
    if (std::getenv("EWA_GOLDEN_ACCEPT")) {
        fs::create_directories(folders.references);
        write_png16(path, truth);
    }
    // A unit in the last place: another compiler's exp may round the other way.
    return matches_golden(name, truth, {2.1 / 65535, 2.1 / 65535, 0}, "float64 CPU reference", folders);
}

}  // namespace ewa::test
