// SPDX-License-Identifier: Apache-2.0
#include "cli/picture_pairs.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>

#include "ewa/error.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

fs::path without_extension(fs::path path) {
    return path.replace_extension();
}

/// Takes out of both what has the same key in both; where several of a folder share a key, none of them is
/// taken.
template <class Key>
void match(std::set<fs::path>& a, std::set<fs::path>& b, const Key& key,
           std::vector<std::pair<fs::path, fs::path>>& matched) {
    std::map<fs::path, std::vector<fs::path>> keyed_a, keyed_b;
    for (const fs::path& path : a) keyed_a[key(path)].push_back(path);
    for (const fs::path& path : b) keyed_b[key(path)].push_back(path);
    for (const auto& [name, paths] : keyed_a) {
        const auto other = keyed_b.find(name);
        if (paths.size() != 1 || other == keyed_b.end() || other->second.size() != 1) continue;
        matched.emplace_back(paths[0], other->second[0]);
        a.erase(paths[0]);
        b.erase(other->second[0]);
    }
}

std::set<fs::path> all_names(const SideNames& side) {
    std::set<fs::path> names(side.asked.begin(), side.asked.end());
    names.insert(side.other.begin(), side.other.end());
    return names;
}

bool is_asked(const SideNames& side, const fs::path& name) {
    return std::find(side.other.begin(), side.other.end(), name) == side.other.end();
}

/// With how many there are, and one of them.
std::string described(const SideNames& side) {
    const size_t count = side.asked.size();
    return side.side + " (" + std::to_string(count) + (count == 1 ? " picture" : " pictures") +
           (count == 0 ? "" : ", " + without_extension(side.asked[0]).string()) + ")";
}

PicturePairs pair_one(const SideNames& a, const SideNames& b) {
    if (a.one_picture && b.one_picture) return {{{"", {}, {}}}, {}, {}};
    const SideNames &one = a.one_picture ? a : b, &several = a.one_picture ? b : a;
    if (!several.is_scene || several.asked.size() != 1)
        throw InputError(one.side + " is one picture and " + several.side + " has " +
                         std::to_string(several.asked.size()) +
                         (several.is_scene ? "; --frames says which of them"
                                           : " in a folder; compare takes two pictures or two folders"));
    const fs::path& name = several.asked[0];
    return {{{"", a.one_picture ? fs::path() : name, a.one_picture ? name : fs::path()}}, {}, {}};
}

}  // namespace

PicturePairs pair_pictures(const SideNames& a, const SideNames& b) {
    if (a.one_picture || b.one_picture) return pair_one(a, b);
    std::set<fs::path> left_a = all_names(a), left_b = all_names(b);
    std::vector<std::pair<fs::path, fs::path>> matched;
    match(
        left_a, left_b, [](const fs::path& path) { return path; }, matched);
    match(left_a, left_b, without_extension, matched);
    std::erase_if(matched,
                  [&](const auto& pair) { return !is_asked(a, pair.first) || !is_asked(b, pair.second); });
    std::sort(matched.begin(), matched.end());

    PicturePairs out;
    std::map<fs::path, int> uses;
    for (const auto& pair : matched) ++uses[without_extension(pair.first)];
    for (const auto& [in_a, in_b] : matched) {
        const fs::path stem = without_extension(in_a);
        out.pairs.push_back({(uses[stem] > 1 ? in_a : stem).string(), in_a, in_b});
    }
    std::copy_if(left_a.begin(), left_a.end(), std::back_inserter(out.only_a),
                 [&](const fs::path& name) { return is_asked(a, name); });
    std::copy_if(left_b.begin(), left_b.end(), std::back_inserter(out.only_b),
                 [&](const fs::path& name) { return is_asked(b, name); });
    if (out.pairs.empty())
        throw InputError("no picture of " + described(a) + " has the name of one of " + described(b));
    return out;
}

}  // namespace ewa::cli
