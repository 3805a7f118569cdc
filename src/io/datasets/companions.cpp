// SPDX-License-Identifier: Apache-2.0
#include "io/datasets/companions.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <span>
#include <string_view>
#include <tuple>

#include "core/folders.h"
#include "core/sandboxed_path.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "ewa/image.h"
#include "io/datasets/importers/image_finder.h"

namespace ewa::io {

namespace {

namespace fs = std::filesystem;

// Ranks of folders. The first usual folder has kUsual, the next ones more.
constexpr int kSmaller = 0, kUsual = 1, kElsewhere = 8, kBeside = 9;

constexpr std::string_view kBetween = "_-. ";  // a name and a word
constexpr std::array<std::string_view, 2> kMaskFolders{"masks", "mask"}, kDepthFolders{"depth", "depths"};
constexpr std::array<std::string_view, 5> kMaskWords{"mask", "masks", "alpha", "matte", "segmentation"};
constexpr std::array<std::string_view, 2> kDepthWords{"depth", "depths"};

struct Names {
    std::string what;
    std::span<const std::string_view> folders, words;
    std::string_view preferred;  // extension
};

const Names& names_of(Companions::Kind kind) {
    static const Names masks{"mask", kMaskFolders, kMaskWords, ".png"},
        maps{"depth map", kDepthFolders, kDepthWords, ".exr"};
    return kind == Companions::Kind::masks ? masks : maps;
}

bool is_listed(const fs::path& file) {
    return is_named_as_image(file) || core::lower(file.extension().string()) == ".npy";
}

/// The key without a word before or behind it: "a" of a_mask, a.mask and mask-a. Empty if it has none.
std::string without_word(const std::string& key, std::span<const std::string_view> words) {
    const auto parted = [&](size_t at) { return kBetween.find(key[at]) != std::string_view::npos; };
    for (const std::string_view word : words) {
        if (key.size() < word.size() + 2) continue;
        if (key.ends_with(word) && parted(key.size() - word.size() - 1))
            return key.substr(0, key.size() - word.size() - 1);
        if (key.starts_with(word) && parted(word.size())) return key.substr(word.size() + 1);
    }
    return {};
}

/// The first of the folders that the path is below, and the path relative to it. Its own folder if it is below none.
std::pair<fs::path, fs::path> split_below(const fs::path& path, std::initializer_list<fs::path> folders) {
    for (const fs::path& folder : folders)
        if (fs::path inside = path.lexically_relative(folder); !inside.empty() && *inside.begin() != "..")
            return {folder, std::move(inside)};
    return {path.parent_path(), path.filename()};
}

/// How the file's name differs from the image's: less is better.
auto difference(const fs::path& file, const fs::path& image, std::string_view preferred) {
    const std::string stem = file.stem().string();
    const bool added = stem == image.filename().string(), replaced = stem == image.stem().string();
    return std::tuple(!(added || replaced), core::lower(file.extension().string()) != preferred, !added);
}

}  // namespace

Companions::Companions(Kind kind, const ImageRecords& images, const fs::path& dataset, int downscale)
    : kind_(kind),
      dataset_(dataset),
      folder_(images.folder),
      root_(images.folder.parent_path()),
      downscale_(downscale) {
    const Names& names = names_of(kind);
    for (const ImageRecord& image : images.images) ++images_[name_key(image.path.stem())];
    if (downscale > 1)
        list(entry_in(root_, names.folders[0].data() + ("_" + std::to_string(downscale))), kSmaller);
    int rank = kUsual;
    for (const fs::path& root : {root_, folder_})
        for (const std::string_view name : names.folders) list(entry_in(root, std::string(name)), rank++);
    std::error_code error;
    for (fs::directory_iterator at(root_.empty() ? "." : root_, error), end; !error && at != end;
         at.increment(error)) {
        const std::string key = name_key(at->path().filename());
        const bool smaller = key.starts_with(std::string(names.folders[0]) + "_") &&
                             key != "masks_" + std::to_string(downscale);
        if (smaller && kind == Kind::masks) list(root_ / at->path().filename(), kElsewhere);
        if (core::is_file(at->path()) && is_listed(at->path()) &&
            std::ranges::count(names.folders, name_key(at->path().stem())) > 0)
            files_.push_back({root_, at->path().filename(), rank});
    }
    if (kind == Kind::masks) list_beside(images.images);
    std::ranges::stable_sort(files_, {},
                             [](const File& file) { return std::tuple(file.rank, file.folder, file.name); });
    for (File& file : files_) {
        const std::string key = name_key(file.name.stem());
        if (file.rank != kBeside) by_name_[key].push_back(&file);
        const std::string shorter = is_named_as_image(key) ? fs::path(key).stem().string() : key;
        for (const std::string& name : {key, shorter})
            if (const std::string rest = without_word(name, names.words); !rest.empty())
                by_word_[rest].push_back(&file);
        if (kind == Kind::depth_maps) file.readable = has_readable_depths(file);
    }
}

void Companions::list(const fs::path& folder, int rank) {
    if (!core::is_folder(folder)) return;
    for (const fs::path& name : list_images(folder, true, is_listed)) files_.push_back({folder, name, rank});
}

/// Masks among the photos have a word in their names, as RealityScan's a.jpg.mask.png has.
void Companions::list_beside(const std::vector<ImageRecord>& images) {
    std::set<fs::path> folders, photos;
    for (const ImageRecord& image : images) {
        folders.insert(image.path.parent_path());
        photos.insert(image.path);
    }
    for (const fs::path& folder : folders)
        for (const fs::path& name : list_images(folder, false)) {
            const std::string rest = without_word(name_key(name.stem()), std::span(kMaskWords).first(1));
            const bool known = images_.contains(rest) || images_.contains(fs::path(rest).stem().string());
            if (!rest.empty() && known && !photos.contains(folder / name)) {
                const auto [place, inside] = split_below(folder / name, {folder_, root_});
                files_.push_back({place, inside, kBeside});
            }
        }
}

/// Maps under names that only other programs give may be pictures to look at.
bool Companions::has_readable_depths(const File& file) const try {
    const std::string type = core::lower(file.name.extension().string());
    if (type != ".exr" && type != ".png") return false;
    const bool usual = without_word(name_key(file.name.stem()), kDepthWords).empty();
    return usual || type == ".exr" || !read_image_size(file.folder / file.name).eight_bit;
} catch (const InputError&) {
    return false;
}

const Companions::File* Companions::look(const fs::path& image, int from, int to) const {
    const fs::path inside = split_below(image, {folder_, root_}).second;
    const std::string full = name_key(inside.filename()), stem = name_key(inside.stem()),
                      above = name_key(inside.parent_path());
    const auto images = images_.find(stem);
    const bool alone = images == images_.end() || images->second == 1;
    for (const auto* map : {&by_name_, &by_word_}) {
        std::vector<const File*> same, elsewhere;
        for (const std::string& key : {full, stem})
            if (const auto found = map->find(key); found != map->end())
                for (const File* file : found->second)
                    if (file->readable && file->rank >= from && file->rank <= to)
                        (name_key(file->name.parent_path()) == above ? same : elsewhere).push_back(file);
        const auto folder_of = [](const File* file) { return file->folder / file->name.parent_path(); };
        const bool one_folder = std::ranges::all_of(
            elsewhere, [&](const File* file) { return folder_of(file) == folder_of(elsewhere[0]); });
        std::vector<const File*>& found = same.empty() && alone && one_folder ? elsewhere : same;
        if (!found.empty())
            return *std::ranges::min_element(found, {}, [&](const File* file) {
                return std::pair(file->rank, difference(file->name, inside, names_of(kind_).preferred));
            });
    }
    return nullptr;
}

fs::path Companions::take(const File& file) {
    const fs::path path = file.folder / file.name;
    if (!core::links_stay_with_images(file.folder.parent_path(), file.folder.filename() / file.name))
        throw InputError(core::one_line(path.string()) + ": is a link out of the dataset's folder; " +
                         core::kLinkAdvice);
    used_.insert(path);
    return path;
}

fs::path Companions::find(const ImageRecord& image) {
    if (downscale_ > 1)
        if (const File* small = look(image.path, kSmaller, kSmaller)) return take(*small);
    const fs::path& named = kind_ == Kind::masks ? image.mask : image.depth;
    if (!named.empty() && core::is_file(named)) {
        used_.insert(named);
        return named;
    }
    if (!named.empty())
        if (const File* file = look(named, kUsual, kElsewhere)) return take(*file);
    if (const File* file = look(image.path, kUsual, kBeside)) return take(*file);
    // Folders of a rig's cameras may each have one mask.
    const fs::path above = split_below(image.path, {folder_, root_}).second.parent_path();
    if (!above.empty() && kind_ == Kind::masks)
        if (const File* file = look(above, kUsual, kElsewhere)) return take(*file);
    if (!named.empty()) missing_.insert(named);
    return kind_ == Kind::masks ? fs::path() : named;
}

fs::path Companions::of_all() {
    if (!used_.empty() || !missing_.empty() || files_.size() != 1 || kind_ != Kind::masks) return {};
    const std::string key = name_key(files_[0].name.stem()), rest = without_word(key, kMaskWords);
    std::set<std::string> others;
    for (const fs::path& name : list_images(folder_, true)) others.insert(name_key(name.stem()));
    for (const std::string& name : {key, rest})
        if (images_.contains(name) || others.contains(name)) return {};
    for_all_ = true;
    return take(files_[0]);
}

std::string Companions::shown(const fs::path& path) const {
    const fs::path inside = path.lexically_relative(root_);
    return core::one_line((inside.empty() || *inside.begin() == ".." ? path : inside).string());
}

UsedOf Companions::used(const std::vector<std::string>& bare) const {
    const Names& names = names_of(kind_);
    UsedOf result{.what = names.what, .used = used_.size()};
    std::set<fs::path> found = used_;
    found.insert(missing_.begin(), missing_.end());
    std::set<int> ranks;
    for (const File& file : files_)
        if (used_.contains(file.folder / file.name)) ranks.insert(file.rank);
    if (ranks.empty() && !files_.empty()) ranks.insert(files_[0].rank);
    const File* other = nullptr;
    for (const File& file : files_)
        if (ranks.contains(file.rank) && file.rank != kBeside &&
            found.insert(file.folder / file.name).second && !other)
            other = &file;
    result.found = found.size();
    if (!missing_.empty())
        result.why = shown(*missing_.begin()) + " is missing";
    else if (other)
        result.why = shown(other->folder / other->name) +
                     (other->readable ? " matches no photo" : " is no .exr or .png of 16 bits");
    else if (for_all_)
        result.why = "for all photos";
    else if (result.used > 0 && !bare.empty())
        result.why = core::counted(bare.size(), "photo") + (bare.size() == 1 ? " has" : " have") +
                     " none: " + core::one_line(bare[0]) + (bare.size() > 1 ? " and others" : "");
    if (!found.empty()) return result;
    // No folder is passed over in silence.
    for (const fs::path& base : {root_, dataset_}) {
        std::error_code error;
        for (fs::directory_iterator at(base.empty() ? "." : base, error), end;
             !error && at != end && result.found == 0; at.increment(error)) {
            const fs::path name = at->path().filename();
            if (name_key(name).find(names.words[0]) == std::string::npos || !core::is_folder(at->path()))
                continue;
            result.found = list_images(at->path(), true, is_listed).size();
            result.why = core::one_line(name.string()) + "/ is " +
                         (base == root_ ? "none of " + std::string(names.folders[0]) + "/ and " +
                                              std::string(names.folders[1]) + "/"
                                        : "not beside the photos");
        }
    }
    return result;
}

namespace {

/// Whether the picture belongs to a photo, such as a mask or normals beside it.
bool belongs_to(const std::string& key, const std::set<std::string>& photos) {
    constexpr std::string_view kOthers[] = {"mask", "depth", "normal", "alpha", "albedo", "disp"};
    for (size_t at = key.find_first_of(kBetween); at != key.npos; at = key.find_first_of(kBetween, at + 1)) {
        const std::string before = key.substr(0, at), after = key.substr(at + 1);
        const bool known = photos.contains(before) ||
                           (is_named_as_image(before) && photos.contains(fs::path(before).stem()));
        if (known &&
            std::ranges::any_of(kOthers, [&](std::string_view word) { return after.starts_with(word); }))
            return true;
    }
    return false;
}

}  // namespace

UsedOf used_photos(const ImageRecords& model, const Dataset& dataset) {
    UsedOf result{.what = "photo"};
    const auto shown = [&](const fs::path& path) {
        const fs::path inside = path.lexically_relative(dataset.root);
        return core::one_line(
            (inside.empty() || *inside.begin() == ".." ? path.filename() : inside).string());
    };
    std::set<fs::path> known, folders;
    std::set<std::string> stems, used;
    std::string missing, unplaced;
    for (const Frame& frame : dataset.frames)
        if (frame.image_exists) used.insert(frame.name);
    for (const ImageRecord& image : model.images) {
        known.insert(image.path);
        stems.insert(name_key(image.path.stem()));
        if (core::is_file(image.path))
            folders.insert(image.path.parent_path());
        else if (missing.empty() && !used.contains(image.name))
            missing = shown(image.path) + " is missing";
    }
    for (const Frame& frame : dataset.frames) {
        if (!frame.image_exists) continue;
        if (result.used++ > 0) continue;
        const std::string path = frame.image_path.string();
        if (!path.ends_with("/" + frame.name)) continue;
        const fs::path place =
            fs::path(path.substr(0, path.size() - frame.name.size() - 1)).lexically_relative(dataset.root);
        if (place != "." && place != "images" && !place.empty() && *place.begin() != "..")
            result.where = core::one_line(place.string());
    }
    result.found = model.images.size();
    std::set<fs::path> files;
    const bool whole = std::ranges::any_of(folders, [&](const fs::path& folder) {
        const fs::path inside = folder.lexically_relative(model.folder);
        return !inside.empty() && *inside.begin() != "..";
    });
    if (whole) folders.insert(model.folder);
    for (const fs::path& folder : folders)
        for (const fs::path& name : list_images(folder, folder == model.folder)) files.insert(folder / name);
    for (const fs::path& file : files)
        if (!known.contains(file) && !belongs_to(name_key(file.stem()), stems)) {
            ++result.found;
            if (unplaced.empty()) unplaced = shown(file) + " has no camera";
        }
    for (const std::string& text :
         {missing, dataset.unreadable.empty() ? std::string() : dataset.unreadable[0], unplaced})
        if (!text.empty()) result.why += (result.why.empty() ? "" : "; ") + text;
    return result;
}

}  // namespace ewa::io
