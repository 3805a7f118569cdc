// SPDX-License-Identifier: Apache-2.0
// Which photos a search for cameras gets, and which of their views count when they have changed since.
#include <map>
#include <nlohmann/json.hpp>

#include "capture/steps.h"
#include "core/hash.h"
#include "core/json_field.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"

namespace ewa::capture {
namespace {

namespace fs = std::filesystem;

/// By name, what distinguishes the contents.
std::map<std::string, std::string> contents_in(const Json& lines) {
    std::map<std::string, std::string> contents;
    for (const Json& value : lines) {
        const std::string line = value.is_string() ? value.get<std::string>() : "";
        const size_t space = line.find(' ');
        if (space != std::string::npos) contents[line.substr(space + 1)] = line.substr(0, space);
    }
    return contents;
}

void add_remark(std::vector<std::string>& remarks, const std::vector<std::string>& names, const char* one,
                const char* many) {
    if (names.empty()) return;
    remarks.push_back(core::counted(names.size(), "photo") + (names.size() == 1 ? one : many) +
                      names_text(names));
}

}  // namespace

std::string line_of(const fs::path& folder, const fs::path& name) {
    core::Hash hash;
    std::string digits = "unreadable";
    try {
        core::add_file(hash, folder / name);
        digits = core::digits_of(hash);
    } catch (const InputError&) {
        // It has no content to tell from another one.
    }
    return digits + " " + core::one_line(name.string());
}

Chosen first_choice(const fs::path& folder, const std::vector<fs::path>& found, Json& record,
                    const ProgressFunction& progress) {
    const std::vector<Skipped> skipped = faults_in(folder, found, progress);
    Chosen chosen;
    chosen.names = found;
    record["files"] = Json::array();
    record["skipped"] = Json::array();
    for (const Skipped& photo : skipped) {
        std::erase(chosen.names, photo.name);
        record["skipped"].push_back({{"file", line_of(folder, photo.name)}, {"reason", photo.reason}});
    }
    require_photos(folder, chosen.names.size(), skipped);
    for (const fs::path& name : chosen.names) record["files"].push_back(line_of(folder, name));
    if (!skipped.empty()) chosen.remarks.push_back(skipped_text(skipped));
    return chosen;
}

Chosen later_choice(const fs::path& folder, const std::vector<fs::path>& found, const Json& before) {
    auto searched = contents_in(before["files"]);
    std::map<std::string, std::string> reasons;  // by line
    for (const Json& photo : before.value("skipped", Json::array()))
        reasons[core::text_in(photo, "file")] = core::text_in(photo, "reason");
    Chosen chosen;
    std::vector<Skipped> skipped;
    std::vector<std::string> changed, added, missing;
    for (const fs::path& name : found) {
        const std::string line = line_of(folder, name), shown = core::one_line(name.string());
        const auto known = searched.find(shown);
        if (known != searched.end() && line.starts_with(known->second + " ")) {
            chosen.names.push_back(name);
        } else if (known != searched.end()) {
            changed.push_back(shown);
            chosen.gone.insert(name.string());
        } else if (reasons.contains(line)) {
            skipped.push_back({name, core::one_line(reasons[line])});
        } else {
            added.push_back(shown);
        }
        if (known != searched.end()) searched.erase(known);
    }
    for (const auto& [name, content] : searched) missing.push_back(core::one_line(name));
    if (!skipped.empty()) chosen.remarks.push_back(skipped_text(skipped));
    add_remark(chosen.remarks, missing,
               " is missing, and its view is not used: ", " are missing, and their views are not used: ");
    add_remark(chosen.remarks, changed,
               " has changed since the search for its camera, and its view is not used: ",
               " have changed since the search for their cameras, and their views are not used: ");
    add_remark(chosen.remarks, added, " is new, and is not used; another -o DIR searches its camera, too: ",
               " are new, and are not used; another -o DIR searches their cameras, too: ");
    return chosen;
}

}  // namespace ewa::capture
