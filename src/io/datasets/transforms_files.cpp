// SPDX-License-Identifier: Apache-2.0
#include "io/datasets/transforms_files.h"

#include <algorithm>
#include <array>

#include "core/folders.h"
#include "io/datasets/importers/image_finder.h"
#include "io/datasets/importers/importer.h"
#include "platform/file_facts.h"

namespace ewa::io {

namespace fs = std::filesystem;

std::vector<fs::path> transforms_files(const fs::path& folder) {
    constexpr std::array kUsual{"transforms.json", "transforms_train.json", "transforms_test.json",
                                "transforms_val.json"};
    std::vector<fs::path> files;
    for (const char* name : kUsual)
        if (fs::path file = entry_in(folder, name); core::is_file(file)) files.push_back(std::move(file));
    for (const fs::path& file : files_of_folder(folder))
        if (is_named_transforms(file) &&
            std::ranges::find(files, platform::folded(file), platform::folded) == files.end() &&
            core::is_file(file) && begins_as_transforms(head_of(file)))
            files.push_back(file);
    return files;
}

std::vector<fs::path> transforms_files_below(const fs::path& root) {
    std::vector<fs::path> found;
    size_t datasets = 0;
    visit_folders_below(root, [&](const fs::path& folder) {
        std::vector<fs::path> files = transforms_files(folder);
        if (files.empty()) return true;
        datasets += has_photos_folder(folder) || core::is_folder(folder / "train");
        found.insert(found.end(), files.begin(), files.end());
        return false;
    });
    if (datasets > 1) return {};
    std::erase_if(found, [&](const fs::path& file) { return file.parent_path() != found[0].parent_path(); });
    return found;
}

}  // namespace ewa::io
