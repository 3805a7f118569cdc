// SPDX-License-Identifier: Apache-2.0
#include "capture/found_colmap.h"

#include "core/folders.h"
#include "core/packages.h"
#include "core/process.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::capture {

extern const char* const kColmapCommands;  // the text of colmap_commands.py

namespace {

namespace fs = std::filesystem;

std::optional<FoundColmap> pycolmap_of(const fs::path& python) {
    std::vector<std::string> words{python.string(), "-c", kColmapCommands}, version = words;
    version.emplace_back("version");
    try {
        const core::Answer answer =
            core::ask_program({.command = version, .environment = {}, .log = platform::kNullFile});
        if (answer.ended != core::Ended::done) return {};
        const std::string release(core::trim(answer.text));
        return FoundColmap{std::move(words), core::one_line(release + " of " + python.string())};
    } catch (const RunError&) {
        return {};  // it is no program
    }
}

}  // namespace

std::optional<FoundColmap> find_colmap(const fs::path& python) {
    if (const fs::path colmap = core::find_program("colmap"); !colmap.empty())
        return FoundColmap{{colmap.string()}, core::one_line(colmap.string())};
    std::vector<fs::path> pythons = platform::find_pythons();
    pythons.insert(pythons.begin(), python);
    for (const fs::path& each : pythons)
        if (core::is_file(each))
            if (const auto found = pycolmap_of(each)) return found;
    return {};
}

FoundColmap require_colmap(const fs::path& python) {
    if (const auto found = find_colmap(python)) return *found;
    throw RunError("photos without cameras need COLMAP, which is not installed (" +
                   core::how_to_install(core::Thing::colmap) + ")");
}

}  // namespace ewa::capture
