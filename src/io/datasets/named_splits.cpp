// SPDX-License-Identifier: Apache-2.0
#include "io/datasets/named_splits.h"

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <utility>

#include "core/json_field.h"
#include "core/text.h"
#include "core/typing.h"
#include "io/datasets/importers/image_finder.h"

namespace ewa::io {

namespace {

namespace fs = std::filesystem;

constexpr size_t kShownEntry = 200;

/// The parts of a name without an image's extension, from the last one to the first.
std::vector<std::string> parts_of(std::string name) {
    std::replace(name.begin(), name.end(), '\\', '/');
    fs::path path = fs::path(name).lexically_normal();
    if (is_named_as_image(path)) path.replace_extension();
    std::vector<std::string> parts;
    for (const fs::path& part : path) parts.insert(parts.begin(), part.string());
    return parts;
}

/// The images by names that other programs may have written: absolute, in another folder or with another extension.
class NamedImages {
  public:
    explicit NamedImages(const std::vector<ImageRecord>& images) {
        for (size_t i = 0; i < images.size(); ++i) {
            const std::vector<std::string> parts = parts_of(images[i].name);
            if (!parts.empty()) by_stem_[parts.front()].emplace_back(i, parts);
        }
    }

    /// Those whose path has most in common with the name. Empty if none has its file name.
    std::vector<size_t> find(const std::string& name) const {
        const std::vector<std::string> parts = parts_of(name);
        const auto same = parts.empty() ? by_stem_.end() : by_stem_.find(parts.front());
        std::vector<size_t> found;
        size_t most = 0;
        if (same == by_stem_.end()) return found;
        for (const auto& [image, its] : same->second) {
            const auto common = size_t(std::ranges::mismatch(its, parts).in1 - its.begin());
            if (common > most) found.clear();
            most = std::max(most, common);
            if (common == most) found.push_back(image);
        }
        return found;
    }

  private:
    std::map<std::string, std::vector<std::pair<size_t, std::vector<std::string>>>> by_stem_;
};

struct NameList {
    const char* key;
    int split;
};
constexpr std::array kLists{NameList{"train_filenames", 1}, NameList{"val_filenames", 2},
                            NameList{"test_filenames", 2}};
constexpr size_t kNoList = kLists.size();

/// Sets of[i] to the list that names image i. The last one wins: what is held out does not train, unless that leaves nothing. Then
/// `both` counts what trains. Returns the names of no image.
std::vector<std::string> read_name_lists(const core::JsonField& top, const std::vector<ImageRecord>& images,
                                         std::vector<size_t>& of, size_t& both) {
    const NamedImages named(images);
    std::set<size_t> trained;
    std::vector<std::string> unknown;
    for (size_t list = 0; list < kLists.size(); ++list) {
        const char* const key = kLists[list].key;
        if (!top.has(key)) continue;
        for (const nlohmann::json& entry : top.list(key)) {
            if (!entry.is_string())
                top.fail(std::string("\"") + key + "\" holds an entry that is not a string");
            const auto& name = entry.get_ref<const std::string&>();
            const std::vector<size_t> found = named.find(name);
            if (found.empty()) unknown.push_back(name.substr(0, kShownEntry));
            for (const size_t i : found) {
                if (list == 0) trained.insert(i);
                if (images[i].name != images[found[0]].name)
                    top.fail(std::string("\"") + key + "\": \"" + name.substr(0, kShownEntry) +
                             "\" is one of " + std::to_string(found.size()) + " frames");
                of[i] = list;
            }
        }
    }
    // Who evaluates what was trained names the same images twice, and means to train.
    if (!trained.empty() && std::ranges::count(of, size_t(0)) == 0)
        for (const size_t i : trained) {
            of[i] = 0;
            ++both;
        }
    return unknown;
}

}  // namespace

void split_by_names(const nlohmann::json& top, const std::string& where, ImageRecords& records) {
    const core::JsonField field(top, where);
    std::vector<ImageRecord>& images = records.images;
    std::vector<size_t> of(images.size(), kNoList);
    size_t both = 0;
    const std::vector<std::string> unknown = read_name_lists(field, images, of, both);
    const auto count = [&](size_t list) { return size_t(std::ranges::count(of, list)); };
    if (count(kNoList) == images.size()) {
        if (!unknown.empty())
            field.fail(
                "\"train_filenames\", \"val_filenames\" and \"test_filenames\" name none of the frames; \"" +
                unknown[0] + "\" is the first name");
        return;
    }
    const bool listed = field.has(kLists[1].key) || field.has(kLists[2].key);
    const int rest = !field.has(kLists[0].key) ? 1 : listed ? 0 : 2;
    for (size_t i = 0; i < images.size(); ++i)
        images[i].split = of[i] == kNoList ? rest : kLists[of[i]].split;
    std::string note =
        "split by names: " + core::counted(count(0) + (rest == 1 ? count(kNoList) : 0), "image") +
        " to train, " + std::to_string(count(1)) + " of val_filenames and " + std::to_string(count(2)) +
        " of test_filenames held out";
    if (rest == 2) note += ", and " + std::to_string(count(kNoList)) + " of no list";
    records.notes.push_back(note);
    if (both > 0)
        records.notes.push_back(core::counted(both, "image") + " of train_filenames " +
                                std::string(core::is_or_are(both)) +
                                " held out by another list, too, which leaves none to train; they train");
    if (rest == 0 && count(kNoList) > 0) {
        records.notes.push_back(core::counted(count(kNoList), "image") + " of no list of the split " +
                                std::string(core::is_or_are(count(kNoList))) + " skipped");
        std::erase_if(images, [](const ImageRecord& image) { return image.split == 0; });
    }
    if (!unknown.empty())
        records.notes.push_back(core::one_line(core::counted(unknown.size(), "name") + " of the split " +
                                               std::string(core::is_or_are(unknown.size())) +
                                               " of no frame, the first being " + unknown[0]));
}

}  // namespace ewa::io
