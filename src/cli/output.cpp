// SPDX-License-Identifier: Apache-2.0
#include "cli/output.h"

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include <cstdio>
#include <utility>

#include "core/text.h"
#include "ewa/error.h"
#include "folders/run.h"
#include "folders/run_folder.h"
#include "options/command_options.h"

namespace ewa::cli {

namespace {

namespace fs = std::filesystem;

/// Adds the files of each run that is read, or whose splats are.
void add_run_files(std::vector<NamedFile>& read) {
    for (size_t i = 0, count = read.size(); i < count; ++i) {
        fs::path folder = read[i].path;
        if (const auto run = folders::run_of_splats(folder)) folder = run->folder;
        if (!folders::find_run(folder)) continue;
        for (const char* name : folders::kRunFiles) read.push_back({"a file of the run", folder / name});
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

void check_typed_outputs(const CLI::App& app, std::vector<NamedFile> written, std::vector<NamedFile> read) {
    options::TypedFiles typed = options::typed_files(app);
    // Some options name a file or take a word, such as a colour.
    std::erase_if(typed.read, [](const NamedFile& file) { return !fs::exists(file.path); });
    written.insert(written.end(), typed.written.begin(), typed.written.end());
    typed.read.insert(typed.read.end(), read.begin(), read.end());
    check_command_outputs(written, std::move(typed.read));
}

void print_json(const report::Json& json) {
    fmt::print("{}\n", json.dump(2, ' ', false, report::Json::error_handler_t::replace));
}

void print_how_to_continue() {
    std::puts(kHowToContinue);
}

}  // namespace ewa::cli
