// SPDX-License-Identifier: Apache-2.0
#include "run/run_outputs.h"

#include <vector>

#include "core/folders.h"
#include "core/outputs.h"
#include "folders/run_folder.h"
#include "io/datasets/dataset_folders.h"
#include "run/final_evaluation.h"
#include "run/scout.h"
#include "scene/dataset_files.h"

namespace ewa::train {

const std::filesystem::path& checked_folder(const RunInput& input) {
    const std::filesystem::path& folder = input.options.output;
    if (!input.options.resume || !core::is_file(folder / folders::kCheckpointFile))
        io::check_output_folder("-o", folder, input.dataset);
    std::vector<core::NamedFile> written, read = scene::files_of(input.dataset, "DATASET");
    for (const char* name : folders::kRunFiles) written.push_back({"the run's file", folder / name});
    for (const char* name : folders::kCameraModelFiles) written.push_back({"the run's file", folder / name});
    for (const auto& [frame, file] : saved_renders(input)) written.push_back({"the run's render", file});
    if (input.options.robust)
        for (const std::filesystem::path& file : mask_files(input))
            written.push_back({"the run's mask", file});
    if (!starts_by_word(input.options.init))
        read.push_back({"--init", input.options.init_folder / input.options.init});
    read.push_back({"DATASET", input.options.scene});
    core::check_outputs(written, read);
    return folder;
}

}  // namespace ewa::train
