// SPDX-License-Identifier: Apache-2.0
// Outputs of a command: files that the user named, JSON, and the progress of long work.
#pragma once
#include <vector>

#include "core/folders.h"
#include "core/json.h"
#include "core/outputs.h"
#include "core/progress.h"
#include "report/summary.h"

namespace CLI {
class App;
}

namespace ewa::cli {

using core::make_folder;
using core::NamedFile;
using core::Progress;
using core::write_json;

/// core::check_outputs for every command but `ewa train`. It also refuses outputs that are files of a training run.
void check_command_outputs(const std::vector<NamedFile>& written, std::vector<NamedFile> read);

/// Calls check_command_outputs() with the files that the command line's options name, and with `written` and `read`.
void check_typed_outputs(const CLI::App& app, std::vector<NamedFile> written = {},
                         std::vector<NamedFile> read = {});

/// Prints the value with indentation. Bytes that are not UTF-8 become U+FFFD: text from a file may hold some.
void print_json(const report::Json& json);

/// The line that tells the user how to continue interrupted work.
inline constexpr const char* kHowToContinue = "interrupted; to continue, repeat the command";
void print_how_to_continue();

}  // namespace ewa::cli
