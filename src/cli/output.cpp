// SPDX-License-Identifier: Apache-2.0
#include "cli/output.h"

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include <cstdio>

#include "core/text.h"
#include "ewa/error.h"
#include "folders/run.h"
#include "folders/run_folder.h"

namespace ewa::cli {

namespace {

/// Adds the files of each run whose splats are read.
void add_run_files(std::vector<NamedFile>& read) {
    for (size_t i = 0, count = read.size(); i < count; ++i) {
        const auto run = folders::run_of_splats(read[i].path);
        if (!run) continue;
        for (const char* name : folders::kRunFiles) read.push_back({"a file of the run", run->folder / name});
    }
}

}  // namespace

void check_command_outputs(const std::vector<NamedFile>& written, std::vector<NamedFile> read) {
    for (const NamedFile& file : written)
        if (const auto run = folders::run_of_file(file.path))
            throw InputError(core::one_line(file.name + " " + file.path.string() +
                                            " is a file of the training run in " + run->string() +
                                            "; it would be overwritten; name another file"));
    add_run_files(read);
    core::check_outputs(written, read);
}

void print_json(const report::Json& json) {
    fmt::print("{}\n", json.dump(2, ' ', false, report::Json::error_handler_t::replace));
}

void print_how_to_continue() {
    std::puts(kHowToContinue);
}

}  // namespace ewa::cli
