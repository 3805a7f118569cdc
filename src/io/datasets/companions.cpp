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
#include "platform/file_facts.h"
#include "scene/mask.h"

namespace ewa::io {

namespace {

namespace fs = std::filesystem;

// Ranks of folders. The first usual folder has kUsual, the next ones more.
constexpr int kSmaller = 0, kUsual = 1, kOfFolder = 6, kOtherName = 7, kElsewhere = 8, kBeside = 9,
              kBesideOther = 10;

constexpr std::string_view kBetween = "_-. ";  // a name and a word
constexpr std::array<std::string_view, 2> kMaskFolders{"masks", "mask"}, kDepthFolders{"depth", "depths"};
constexpr std::array<std::string_view, 7> kMaskWords{"mask",   "masks",        "alpha", "matte",
                                                     "mattes", "segmentation", "seg"};
/// Folders of masks, if their pictures can be some.
constexpr std::array<std::string_view, 6> kOtherFolders{"matte",        "mattes",        "alpha",
                                                        "segmentation", "segmentations", "seg"};
constexpr std::array<std::string_view, 2> kDepthWords{"depth", "depths"};
/// Masks for all photos, as in static_mask.png.
constexpr std::array<std::string_view, 12> kOfAll{"all",    "global", "static", "common", "shared", "vehicle",
                                                  "camera", "car",    "ego",    "rig",    "lens",   "body"};

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
    const std::string extension = core::lower(file.extension().string());
    return is_named_as_image(file) || extension == ".npy" || extension == ".gif";
}

/// The key of "a.jpg" without the extension.
std::string without_extension(const std::string& key) {
    const std::string extension = fs::path(key).extension().string();
    const bool heif = extension == ".heic" || extension == ".heif" || extension == ".avif";
    return heif || is_named_as_image(key) ? fs::path(key).stem().string() : key;
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
        if (fs::path inside = core::inside(path, folder); !inside.empty() && *inside.begin() != "..")
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
      downscale_(downscale),
      apart_(dataset == images.folder) {
    const Names& names = names_of(kind);
    for (const ImageRecord& image : images.images) ++images_[name_key(image.path.stem())];
    for (const ImageRecord& image : images.images)
        for (fs::path folder = image.path.parent_path();
             of_photos_.insert(folder).second && folder != folder_; folder = folder.parent_path())
            if (const fs::path inside = core::inside(folder, folder_);
                inside.empty() || *inside.begin() == "..") {
                of_photos_.erase(folder);
                break;
            }
    list_folders(downscale);
    if (kind == Kind::masks) list_beside(images.images);
    std::ranges::stable_sort(files_, {},
                             [](const File& file) { return std::tuple(file.rank, file.folder, file.name); });
    examine();
    for (const File& file : files_) {
        const std::string key = name_key(file.name.stem()), shorter = without_extension(key);
        if (file.rank < kBeside) by_name_[key].push_back(&file);
        // As a.webp.png of a.png.
        if (const auto one = images_.find(shorter);
            shorter != key && one != images_.end() && one->second == 1)
            by_word_[shorter].push_back(&file);
        for (const std::string& name : {key, shorter})
            if (const std::string rest = without_word(name, names.words); !rest.empty())
                by_word_[rest].push_back(&file);
    }
}

void Companions::list(const fs::path& folder, int rank, const fs::path& images) {
    if (!core::is_folder(folder) || of_photos_.contains(folder) || !listed_.insert(folder).second) return;
    for (const fs::path& name : list_images(folder, true, is_listed))
        files_.push_back({folder, name, rank, name_key((images / name).parent_path())});
}

void Companions::list_folders(int downscale) {
    const Names& names = names_of(kind_);
    if (downscale > 1)
        list(entry_in(root_, names.folders[0].data() + ("_" + std::to_string(downscale))), kSmaller);
    int rank = kUsual;
    for (const fs::path& root : {root_, folder_})
        for (const std::string_view name : names.folders) list(entry_in(root, std::string(name)), rank++);
    list_loose(rank);
    // As cam0/masks of cam0 or of cam0/images.
    for (const fs::path& folder : of_photos_)
        for (const std::string_view name : names.folders)
            list(entry_in(folder, std::string(name)), kOfFolder, core::inside(folder, folder_));
    if (kind_ != Kind::masks) return;
    for (const fs::path& root : {root_, folder_})
        for (const std::string_view name : kOtherFolders)
            if (root == folder_ || !apart_) list(entry_in(root, std::string(name)), kOtherName);
    std::error_code error;
    for (fs::directory_iterator at(root_.empty() ? "." : root_, error), end; !error && at != end;
         at.increment(error)) {
        const std::string key = name_key(at->path().filename());
        if (!apart_ && key.starts_with("masks_") && key != "masks_" + std::to_string(downscale))
            list(root_ / at->path().filename(), kElsewhere);
    }
}

/// Single files, as mask.png or static_mask.png.
void Companions::list_loose(int rank) {
    const Names& names = names_of(kind_);
    for (const fs::path& folder : {root_, folder_}) {
        std::error_code error;
        for (fs::directory_iterator at(folder.empty() ? "." : folder, error), end; !error && at != end;
             at.increment(error)) {
            const std::string key = name_key(at->path().stem());
            const std::string rest = without_word(key, names.folders);
            const bool other = folder == root_ && !apart_ && kind_ == Kind::masks && !rest.empty() &&
                               !images_.contains(rest);
            if (core::is_file(at->path()) && is_listed(at->path()) && !images_.contains(key) &&
                (other || std::ranges::count(names.folders, key) > 0))
                files_.push_back({folder, at->path().filename(), rank});
        }
    }
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
            const std::string key = name_key(name.stem()), rest = without_word(key, kMaskWords);
            const bool usual = !without_word(key, std::span(kMaskWords).first(1)).empty();
            const bool known = images_.contains(rest) || images_.contains(fs::path(rest).stem().string());
            if (!rest.empty() && known && !photos.contains(folder / name)) {
                const auto [place, inside] = split_below(folder / name, {folder_, root_});
                files_.push_back(
                    {place, inside, usual ? kBeside : kBesideOther, name_key(inside.parent_path())});
            }
        }
}

void Companions::examine() {
    std::map<std::pair<int, fs::path>, std::string> of_folders;
    for (File& file : files_) try {
            const fs::path path = file.folder / file.name;
            const std::string type = core::lower(file.name.extension().string());
            const bool depths = kind_ == Kind::depth_maps;
            if (depths ? type != ".exr" && (type != ".png" || read_image_size(path).eight_bit)
                       : !is_named_as_image(path))
                file.fault =
                    depths ? " is no .exr or .png of 16 bits" : " is of a format that ewa does not read";
            if (depths || (file.rank != kOtherName && file.rank != kBesideOther)) continue;
            // The first one shows whether they are masks.
            const auto [at, is_new] = of_folders.try_emplace({file.rank, path.parent_path()});
            if (is_new) try {
                    scene::load_mask(path);
                } catch (const InputError&) {
                    at->second = " seems to be no mask";
                }
            file.fault = at->second;
        } catch (const InputError&) {
            continue;  // who reads it names it
        }
}

const Companions::File* Companions::look(const fs::path& image, int from, int to) const {
    const fs::path inside = split_below(image, {folder_, root_}).second;
    const std::string full = name_key(inside.filename()), stem = name_key(inside.stem()),
                      above = name_key(inside.parent_path()),
                      shorter = inside.parent_path().filename() == "images"
                                    ? name_key(inside.parent_path().parent_path())
                                    : above;
    const auto images = images_.find(stem);
    const bool alone = images == images_.end() || images->second == 1;
    for (const auto* map : {&by_name_, &by_word_}) {
        std::vector<const File*> same, elsewhere;
        for (const std::string& key : {full, stem})
            if (const auto found = map->find(key); found != map->end())
                for (const File* file : found->second)
                    if (file->fault.empty() && file->rank >= from && file->rank <= to)
                        (file->above == above || (file->rank == kOfFolder && file->above == shorter)
                             ? same
                             : elsewhere)
                            .push_back(file);
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
    if (const File* file = look(image.path, kUsual, kBesideOther)) return take(*file);
    // Folders of a rig's cameras may each have one mask.
    const fs::path above = split_below(image.path, {folder_, root_}).second.parent_path();
    if (!above.empty() && kind_ == Kind::masks)
        if (const File* file = look(above, kUsual, kElsewhere)) return take(*file);
    if (!named.empty()) missing_.insert(named);
    return kind_ == Kind::masks ? fs::path() : named;
}

fs::path Companions::of_all() {
    if (!used_.empty() || !missing_.empty() || files_.size() != 1 || kind_ != Kind::masks ||
        !files_[0].fault.empty())
        return {};
    const std::string key = name_key(files_[0].name.stem()), rest = without_word(key, kMaskWords);
    // A file beside the photos' folder must say so.
    if (files_[0].folder == root_ && !rest.empty() && std::ranges::count(kOfAll, rest) == 0) return {};
    std::set<std::string> others;
    for (const fs::path& name : list_images(folder_, true))
        if (folder_ / name != files_[0].folder / files_[0].name) others.insert(name_key(name.stem()));
    for (const std::string& name : {key, rest})
        if (images_.contains(name) || others.contains(name)) return {};
    for_all_ = true;
    return take(files_[0]);
}

std::string Companions::shown(const fs::path& path) const {
    const fs::path inside = core::inside(path, root_);
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
        if (ranks.contains(file.rank) && file.rank < kBeside &&
            found.insert(file.folder / file.name).second && !other)
            other = &file;
    result.found = found.size();
    if (!missing_.empty())
        result.why = shown(*missing_.begin()) + " is missing";
    else if (other)
        result.why = shown(other->folder / other->name) + why_unused(*other);
    else if (for_all_)
        result.why = "for all photos";
    else if (result.used > 0 && !bare.empty())
        result.why = core::counted(bare.size(), "photo") + (bare.size() == 1 ? " has" : " have") +
                     " none: " + core::one_line(bare[0]) + (bare.size() > 1 ? " and others" : "");
    if (found.empty()) note_folder(result);
    return result;
}

std::string Companions::why_unused(const File& file) const {
    if (!file.fault.empty()) return file.fault;
    const auto named = by_name_.find(name_key(file.name.stem()));
    const fs::path folder = (file.folder / file.name).parent_path();
    if (named != by_name_.end())
        for (const File* other : named->second)
            if (const fs::path path = other->folder / other->name;
                other->rank == file.rank && path.parent_path() != folder && !used_.contains(path))
                return " and " + shown(path) + " have one name, and neither folder is that of a photo";
    return " matches no photo";
}

void Companions::note_folder(UsedOf& result) const {
    constexpr std::array<std::string_view, 5> kMaskParts{"mask", "matte", "alpha", "segment", "label"};
    const Names& names = names_of(kind_);
    const std::span<const std::string_view> parts =
        kind_ == Kind::masks ? std::span<const std::string_view>(kMaskParts) : names.words.first(1);
    for (const fs::path& base : {root_, dataset_}) {
        if (base == root_ && apart_) continue;
        std::error_code error;
        for (fs::directory_iterator at(base.empty() ? "." : base, error), end;
             !error && at != end && result.found == 0; at.increment(error)) {
            const fs::path name = at->path().filename();
            const std::string key = name_key(name);
            if (std::ranges::none_of(parts,
                                     [&](std::string_view part) { return key.find(part) != key.npos; }) ||
                !core::is_folder(at->path()) || of_photos_.contains(at->path()))
                continue;
            result.found = list_images(at->path(), true, is_listed).size();
            result.why = core::one_line(name.string()) + "/ is " +
                         (base == root_ ? "none of " + std::string(names.folders[0]) + "/ and " +
                                              std::string(names.folders[1]) + "/"
                                        : "not beside the photos");
        }
    }
}

namespace {

/// Whether the picture belongs to a photo, such as a mask or normals beside it.
bool belongs_to(const std::string& key, const std::set<std::string>& photos) {
    constexpr std::string_view kOthers[] = {"mask",   "depth", "normal", "alpha",
                                            "albedo", "disp",  "matte",  "seg"};
    for (size_t at = key.find_first_of(kBetween); at != key.npos; at = key.find_first_of(kBetween, at + 1)) {
        const std::string before = key.substr(0, at), after = key.substr(at + 1);
        const bool known = photos.contains(before) ||
                           (is_named_as_image(before) && photos.contains(fs::path(before).stem().string()));
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
        const fs::path inside = core::inside(path, dataset.root);
        return core::one_line(
            (inside.empty() || *inside.begin() == ".." ? path.filename() : inside).string());
    };
    std::set<fs::path> known, folders;
    std::set<std::string> stems, used;
    std::string missing, unplaced;
    for (const Frame& frame : dataset.frames)
        if (frame.image_exists) used.insert(frame.name);
    for (const ImageRecord& image : model.images) {
        known.insert(platform::folded(image.path));
        stems.insert(name_key(image.path.stem()));
        if (core::is_file(image.path))
            folders.insert(image.path.parent_path());
        else if (missing.empty() && !used.contains(image.name))
            missing = shown(image.path) + " is missing";
    }
    for (const Frame& frame : dataset.frames) {
        if (!frame.image_exists) continue;
        known.insert({platform::folded(frame.mask_path), platform::folded(frame.depth_path)});
        if (result.used++ > 0) continue;
        const std::string path = frame.image_path.generic_string();
        if (!path.ends_with("/" + frame.name)) continue;
        const fs::path place =
            fs::path(path.substr(0, path.size() - frame.name.size() - 1)).lexically_relative(dataset.root);
        if (place != "." && place != "images" && !place.empty() && *place.begin() != "..")
            result.where = core::one_line(place.generic_string());
    }
    result.found = model.images.size();
    std::set<fs::path> files;
    const bool whole = std::ranges::any_of(folders, [&](const fs::path& folder) {
        const fs::path inside = core::inside(folder, model.folder);
        return !inside.empty() && *inside.begin() != "..";
    });
    if (whole) folders.insert(model.folder);
    for (const fs::path& folder : folders)
        for (const fs::path& name : list_images(folder, folder == model.folder)) files.insert(folder / name);
    for (const fs::path& file : files)
        if (!known.contains(platform::folded(file)) && !belongs_to(name_key(file.stem()), stems)) {
            ++result.found;
            if (unplaced.empty()) unplaced = shown(file) + " has no camera";
        }
    for (const std::string& text :
         {missing, dataset.unreadable.empty() ? std::string() : dataset.unreadable[0], unplaced})
        if (!text.empty()) result.why += (result.why.empty() ? "" : "; ") + text;
    return result;
}

}  // namespace ewa::io
