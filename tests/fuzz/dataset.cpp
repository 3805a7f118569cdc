// SPDX-License-Identifier: Apache-2.0
// Any bytes as the files of a dataset, which "@@@" and a line feed part: cameras that can be used and names
// that stay in the folder, or an InputError of one line. There are no images.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <string_view>

#include "ewa/dataset.h"
#include "ewa/error.h"
#include "input.h"
#include "io/datasets/image_records.h"
#include "io/datasets/importers/image_finder.h"
#include "io/datasets/importers/importer.h"

namespace {

using namespace ewa;
namespace fs = std::filesystem;

#ifdef EWA_COLMAP
constexpr const char* kFiles[] = {"cameras" EWA_COLMAP, "images" EWA_COLMAP, "points3D" EWA_COLMAP};

io::ImageRecords read_model(const fs::path& folder) {
    const io::ColmapModel model{.folder = folder, .dataset = folder, .extension = EWA_COLMAP};
    const io::ImageFinder finder = io::image_finder(model);
    return io::read_colmap(model, &finder);
}
#elif defined(EWA_IMPORTED)
constexpr const char* kFiles[] = {EWA_IMPORTED, "points.ply"};

io::ImageRecords read_model(const fs::path& folder) {
    auto importer = io::find_importer(folder);
    if (!importer)
        importer = io::find_importer(folder / kFiles[0]);  // a file that only counts where it is named
    return importer ? importer->importer->read(importer->source) : io::ImageRecords();
}
#else
constexpr const char* kFiles[] = {"transforms.json", "points.ply"};

io::ImageRecords read_model(const fs::path& folder) {
    constexpr bool kWithPoints = true;
    return io::read_transforms(folder / kFiles[0], 0, kWithPoints);
}
#endif
constexpr std::string_view kBetween = "@@@\n";

/// With the folders of the files, and with an image for a target that needs its size.
fs::path make_dataset_folder() {
    const fs::path folder = fuzz::make_folder();
    for (const char* name : kFiles) fs::create_directories((folder / name).parent_path());
#ifdef EWA_IMAGE
    fs::create_directories((folder / EWA_IMAGE).parent_path());
    save_image(folder / EWA_IMAGE, Image(24, 18, 3));
#endif
    return folder;
}

void write_files(const fs::path& folder, std::string_view bytes) {
    for (const char* name : kFiles) {
        const bool last = name == kFiles[std::size(kFiles) - 1];
        const size_t end = last ? bytes.size() : std::min(bytes.find(kBetween), bytes.size());
        std::ofstream(folder / name, std::ios::binary) << bytes.substr(0, end);
        bytes.remove_prefix(std::min(bytes.size(), end + kBetween.size()));
    }
}

void check_inside(const fs::path& folder, const fs::path& path) {
    const std::string text = path.string();
    EWA_REQUIRE(path.lexically_normal().string().starts_with(folder.string() + "/"));
    EWA_REQUIRE(text.find('\0') == std::string::npos);
}

void check(const fs::path& folder, const io::ImageRecords& read) {
    const std::string text = std::to_string(read.images.size()) + " images";
    EWA_REQUIRE(read.points.positions.size() == read.points.colors.size());
    for (const io::ImageRecord& image : read.images) {
        if (!image.path.empty()) check_inside(folder, image.path);
        if (!image.mask.empty()) check_inside(folder, image.mask);
    }
}

void check(const fs::path& folder, const Dataset& dataset) {
    const std::string text = std::to_string(dataset.frames.size()) + " frames";
    EWA_REQUIRE(!dataset.frames.empty());
    for (const Frame& frame : dataset.frames) {
        check_inside(folder, frame.image_path);
        EWA_REQUIRE(frame.camera.width > 0 && frame.camera.height > 0);
        EWA_REQUIRE(frame.camera.fx > 0 && frame.camera.fy > 0);
        for (int i = 0; i < 3; ++i) EWA_REQUIRE(std::isfinite(frame.camera.rotation[i][i]));
    }
}

template <class Read>
void read_or_refuse(const Read& read) {
    try {
        read();
    } catch (const InputError& error) {
        const std::string text = error.what();
        EWA_REQUIRE(!text.empty() && text.find('\n') == std::string::npos && text.size() < 10000);
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const fs::path folder = make_dataset_folder();
    write_files(folder, {reinterpret_cast<const char*>(data), size});
    // Most of the time is that of the lenses, some ten milliseconds each under the sanitizers.
    fuzz::read_within(size, 10, [&] {
        read_or_refuse([&] { check(folder, read_model(folder)); });
        DatasetOptions options;
        options.need_images = false;
        read_or_refuse([&] { check(folder, load_dataset(folder, options)); });
    });
    return 0;
}
