// SPDX-License-Identifier: Apache-2.0
#include "io/datasets/dataset_folders.h"

#include <algorithm>
#include <array>
#include <set>
#include <string_view>

#include "core/folders.h"
#include "core/text.h"
#include "ewa/error.h"
#include "io/datasets/image_records.h"
#include "io/datasets/importers/importer.h"
#include "io/datasets/transforms_files.h"

namespace ewa::io {
namespace {

namespace fs = std::filesystem;

/// Without links and ".", as far as the path exists.
fs::path real_path(const fs::path& path) {
    std::error_code error;
    fs::path real = fs::weakly_canonical(fs::absolute(path, error), error);
    if (error) real = fs::absolute(path, error).lexically_normal();
    return real.has_filename() ? real : real.parent_path();
}

/// Whether the path is the folder, or below it. Both are real paths.
bool lies_in(const fs::path& path, const fs::path& folder) {
    return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first == folder.end();
}

[[noreturn]] void refuse_output(const std::string& option, const fs::path& folder, const std::string& what) {
    throw InputError(core::one_line(option + " " + folder.string() + " " + what +
                                    ", where no outputs belong; name another folder"));
}

/// A dataset's own folder, as images, images_2, masks and sparse are.
bool is_part_of_dataset(const fs::path& real) {
    const std::string name = real.filename().string();
    constexpr std::array<std::string_view, 6> kParts{"masks", "mask", "sparse", "depth", "depths", "input"};
    const bool part = name == "images" || name.starts_with("images_") || std::ranges::count(kParts, name) > 0;
    return part && is_dataset_folder(real.parent_path(), false);
}

std::set<fs::path> image_folders(const Dataset& dataset) {
    std::set<fs::path> named, real;
    for (const Frame& frame : dataset.frames)
        for (const fs::path& file : {frame.image_path, frame.mask_path})
            if (!file.empty()) named.insert(file.parent_path());
    for (const fs::path& folder : named) real.insert(real_path(folder));
    return real;
}

}  // namespace

bool is_dataset_folder(const fs::path& folder, bool below) {
    return !transforms_files(folder).empty() || !colmap_models(folder).empty() ||
           find_importer(folder).has_value() || !colmap_workspaces(folder).empty() ||
           (below && (!transforms_files_below(folder).empty() || !colmap_models_below(folder).empty()));
}

void check_not_inside_dataset(const std::string& option, const fs::path& folder) {
    if (is_part_of_dataset(real_path(folder))) refuse_output(option, folder, "is a folder of a dataset");
}

void check_output_folder(const std::string& option, const fs::path& folder) {
    if (is_dataset_folder(real_path(folder), false)) refuse_output(option, folder, "is a dataset");
    check_not_inside_dataset(option, folder);
}

void check_output_folder(const std::string& option, const fs::path& folder, const Dataset& dataset) {
    check_output_folder(option, folder);
    const fs::path there = real_path(folder), root = real_path(dataset.root);
    for (const fs::path& images : image_folders(dataset)) {
        const bool among =
            there == images || (images != root && lies_in(images, root) && lies_in(there, images));
        const bool above = lies_in(there, root) && lies_in(images, there);
        if (among || above) refuse_output(option, folder, "holds images of " + dataset.root.string());
    }
}

}  // namespace ewa::io
