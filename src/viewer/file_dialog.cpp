// SPDX-License-Identifier: Apache-2.0
#include "viewer/file_dialog.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "core/packages.h"
#include "core/process.h"
#include "ewa/error.h"
#include "platform/desktop.h"

namespace ewa::viewer {
namespace {

namespace fs = std::filesystem;

/// The command of the dialog; empty if neither program is installed.
std::vector<std::string> dialog_command(Wanted wanted, const fs::path& proposed) {
    const bool folder = wanted == Wanted::folder, save = wanted == Wanted::save;
    if (!core::find_program("zenity").empty()) {
        std::vector<std::string> command{"zenity", "--file-selection",
                                         save ? "--title=Save" : "--title=Open"};
        if (folder) command.emplace_back("--directory");
        if (save) command.insert(command.end(), {"--save", "--filename=" + proposed.string()});
        return command;
    }
    if (core::find_program("kdialog").empty()) return {};
    if (save) return {"kdialog", "--getsavefilename", proposed.empty() ? "." : proposed.string()};
    return {"kdialog", folder ? "--getexistingdirectory" : "--getopenfilename", "."};
}

fs::path ask_program(Wanted wanted, const fs::path& proposed, const std::atomic<bool>& stop) {
    std::vector<std::string> command = dialog_command(wanted, proposed);
    if (command.empty())
        throw RunError("there is no file dialog here: " + core::how_to_install(core::Thing::file_dialog) +
                       ", or " + (wanted == Wanted::save ? "type the path" : "drop the file on the window"));
    std::string text;
    // The toolkits' warnings do not concern the user.
    const core::Program program{.command = std::move(command), .environment = {}, .log = platform::kNullFile};
    const core::Ended ended = core::run_program(program, [&](std::string_view piece) {
        text += piece;
        return !stop;
    });
    if (ended != core::Ended::done) return {};  // cancelled
    if (text.ends_with('\n')) text.pop_back();
    return text;
}

}  // namespace

void FileDialog::ask(Wanted wanted, const fs::path& proposed) {
    if (open()) return;
    wanted_ = wanted;
    std::error_code unknown;  // dialogs know no current folder
    fs::path begin = proposed.empty() ? fs::path() : fs::absolute(proposed, unknown);
    answer_.start(wake_, [this, wanted, begin = std::move(begin)] {
        fs::path chosen;
        const auto choice = wanted == Wanted::folder ? platform::Choice::folder
                            : wanted == Wanted::save ? platform::Choice::save
                                                     : platform::Choice::file;
        if (platform::choose(choice, begin, stop_, chosen)) return chosen;
        return ask_portal(wanted, begin, stop_, chosen) ? chosen : ask_program(wanted, begin, stop_);
    });
}

std::optional<fs::path> FileDialog::take() {
    if (!answer_.ready()) return std::nullopt;
    fs::path chosen = answer_.take();
    if (chosen.empty()) return std::nullopt;
    return chosen;
}

fs::path path_of_uri(std::string_view uri) {
    constexpr std::string_view kScheme = "file://";
    if (!uri.starts_with(kScheme)) return {};
    uri.remove_prefix(std::min(uri.find('/', kScheme.size()), uri.size()));  // and a host
    const auto digit = [](char c) {
        return c >= '0' && c <= '9'   ? c - '0'
               : c >= 'a' && c <= 'f' ? c - 'a' + 10
               : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                      : -1;
    };
    std::string path;
    for (size_t i = 0; i < uri.size(); ++i) {
        const bool escape =
            uri[i] == '%' && i + 2 < uri.size() && digit(uri[i + 1]) >= 0 && digit(uri[i + 2]) >= 0;
        path += escape ? char(16 * digit(uri[i + 1]) + digit(uri[i + 2])) : uri[i];
        if (escape) i += 2;
    }
    return path;
}

}  // namespace ewa::viewer
