// SPDX-License-Identifier: Apache-2.0
#include "cli/picture_pairs.h"

#include <algorithm>
#include <map>
#include <set>

#include "ewa/error.h"
#include "image/pictures_below.h"

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

PicturePairs pair_folders(const fs::path& a, const fs::path& b) {
    const std::vector<fs::path> listed_a = image::pictures_below(a), listed_b = image::pictures_below(b);
    std::set<fs::path> left_a(listed_a.begin(), listed_a.end()), left_b(listed_b.begin(), listed_b.end());
    std::vector<std::pair<fs::path, fs::path>> matched;
    match(
        left_a, left_b, [](const fs::path& path) { return path; }, matched);
    match(left_a, left_b, without_extension, matched);
    std::sort(matched.begin(), matched.end());

    PicturePairs out;
    std::map<fs::path, int> uses;
    for (const auto& pair : matched) ++uses[without_extension(pair.first)];
    for (const auto& [in_a, in_b] : matched) {
        const fs::path stem = without_extension(in_a);
        out.pairs.push_back({(uses[stem] > 1 ? in_a : stem).string(), a / in_a, b / in_b});
    }
    for (const fs::path& path : left_a) out.unpaired.push_back(a / path);
    for (const fs::path& path : left_b) out.unpaired.push_back(b / path);
    if (out.pairs.empty())
        throw InputError("no picture in " + a.string() + " (" + std::to_string(listed_a.size()) +
                         " pictures) has the name of one in " + b.string() + " (" +
                         std::to_string(listed_b.size()) + ")");
    return out;
}

}  // namespace

PicturePairs pair_pictures(const fs::path& a, const fs::path& b) {
    std::error_code ignored;
    const bool folder_a = fs::is_directory(a, ignored), folder_b = fs::is_directory(b, ignored);
    if (folder_a && folder_b) return pair_folders(a, b);
    if (folder_a || folder_b) {
        const fs::path& file = folder_a ? b : a;
        throw InputError((folder_a ? a : b).string() + " is a folder and " + file.string() +
                         (fs::exists(file, ignored) ? " is a file" : " is not there") +
                         "; compare takes two pictures or two folders");
    }
    return {{{"", a, b}}, {}};
}

}  // namespace ewa::cli
