// SPDX-License-Identifier: Apache-2.0
#include "bench/cases.h"

#include <fnmatch.h>

#include <sstream>

#include "ewa/error.h"

namespace ewa::bench {
namespace {

std::string count_text(uint32_t count) {
    if (count % 1000000 == 0) return std::to_string(count / 1000000) + "m";
    if (count % 1000 == 0) return std::to_string(count / 1000) + "k";
    return std::to_string(count);
}

const char* name_of(Kind kind) {
    const char* names[] = {"forward", "train", "sort", "update", "first_step"};
    return names[int(kind)];
}

const char* name_of(Layout layout) {
    const char* names[] = {"capture", "cloud", "sparse", "dense"};
    return names[int(layout)];
}

Case frame_case(Kind kind, Layout layout, uint32_t splats, int width, int height, int sh_degree, bool large) {
    const std::string name = std::string(name_of(layout)) + "_" + count_text(splats) + "_" +
                             std::to_string(width) + "x" + std::to_string(height) + "_sh" +
                             std::to_string(sh_degree) + "_" + name_of(kind);
    return {name, kind, layout, splats, width, height, sh_degree, large};
}

bool matches(const std::string& name, const std::string& pattern) {
    if (pattern.find_first_of("*?") == std::string::npos) return name.find(pattern) != std::string::npos;
    return fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
}

}  // namespace

std::vector<Case> all_cases() {
    std::vector<Case> cases;
    const auto add = [&](Layout layout, uint32_t splats, int width, int height, int sh_degree, bool train,
                         bool large = false) {
        cases.push_back(frame_case(Kind::forward, layout, splats, width, height, sh_degree, large));
        if (train) cases.push_back(frame_case(Kind::train, layout, splats, width, height, sh_degree, large));
    };
    add(Layout::capture, 2000, 64, 48, 1, true);  // for tests: fast on any device
    add(Layout::capture, 14000, 270, 480, 3, true);
    add(Layout::capture, 70000, 270, 480, 3, true);
    for (const auto& [width, height] : {std::pair{960, 540}, {1920, 1080}}) {
        for (const uint32_t splats : {10000u, 30000u, 100000u, 300000u, 1000000u})
            add(Layout::cloud, splats, width, height, 3, splats <= 100000u);
        add(Layout::cloud, 2000000, width, height, 3, false, true);
    }
    add(Layout::cloud, 100000, 960, 540, 0, true);
    add(Layout::cloud, 1000000, 1920, 1080, 0, false);
    add(Layout::sparse, 100000, 960, 540, 0, true);
    add(Layout::dense, 100000, 960, 540, 0, true);
    add(Layout::cloud, 100000, 3840, 2160, 3, false);
    cases.push_back(frame_case(Kind::train, Layout::cloud, 100000, 3840, 2160, 3, true));
    cases.push_back(frame_case(Kind::train, Layout::cloud, 1000000, 1920, 1080, 3, true));
    cases.push_back({"sort_1m", Kind::sort, {}, 1000000, 0, 0, 0, false});
    cases.push_back(frame_case(Kind::update, Layout::cloud, 100000, 960, 540, 3, false));
    cases.push_back(frame_case(Kind::update, Layout::cloud, 100000, 960, 540, 0, false));
    cases.push_back({"first_step", Kind::first_step, Layout::capture, 14000, 270, 480, 3, false});
    return cases;
}

bool name_matches(const std::string& name, const std::string& patterns) {
    std::istringstream words(patterns);
    for (std::string word; std::getline(words, word, ',');)
        if (!word.empty() && matches(name, word)) return true;
    return false;
}

std::vector<Case> select_cases(const std::string& patterns, bool large) {
    const bool all = patterns.find_first_not_of(',') == std::string::npos;
    std::vector<Case> selected;
    for (const Case& one : all_cases())
        if (all ? large || !one.large : name_matches(one.name, patterns)) selected.push_back(one);
    if (selected.empty()) throw InputError("no case matches '" + patterns + "'; --list names them all");
    return selected;
}

}  // namespace ewa::bench
