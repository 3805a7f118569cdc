// SPDX-License-Identifier: Apache-2.0
#include "cli/convert_output.h"

#include "cli/run_inputs.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::cli {

void show_run(const folders::Run& run, Dataset& cameras, PageOptions& page,
              std::vector<std::string>& remarks) {
    page.background = core::parse_colour(run.text("background")).value_or(page.background);
    try {
        cameras = cameras_of_run(run);
        page.cameras = &cameras;
    } catch (const InputError& error) {
        remarks.push_back("the page has no views of photos: " + core::one_line(error.what()));
    }
}

}  // namespace ewa::cli
