// SPDX-License-Identifier: Apache-2.0
#include "io/datasets/importers/image_finder.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "core/composed.h"
#include "core/folders.h"
#include "core/sandboxed_path.h"
#include "core/text.h"
#include "ewa/error.h"
#include "folders/run_folder.h"
#include "io/datasets/image_records.h"
#include "platform/file_facts.h"

namespace ewa::io {

namespace {

namespace fs = std::filesystem;

constexpr size_t kMostImages = 200000, kMostFiles = 10 * kMostImages;
constexpr size_t kShownName = 200;

/// Folders beside the images that hold pictures of another kind, smaller copies, or the undistorted images of a workspace.
bool is_of_others(const fs::path& folder) {
    constexpr std::string_view kOthers[] = {"mask", "depth", "confidence", "."}, kCopies = "images_";
    const std::string name = core::lower(folder.filename().string());
    if (name.starts_with(kCopies) && core::parse_integer<int>(std::string_view(name).substr(kCopies.size())))
        return true;
    return std::ranges::any_of(kOthers, [&](std::string_view other) { return name.starts_with(other); }) ||
           name == "dense" || name == "undistorted" || folders::is_made_by_ewa(folder);
}

std::vector<std::string> keys_of(const fs::path& folders) {
    std::vector<std::string> keys;
    for (const fs::path& part : folders) keys.push_back(name_key(part));
    return keys;
}

/// How many parts of the folders' paths are the same, from the end.
size_t common_parts(const fs::path& a, const fs::path& b) {
    const std::vector<std::string> x = keys_of(a), y = keys_of(b);
    return size_t(std::mismatch(x.rbegin(), x.rend(), y.rbegin(), y.rend()).first - x.rbegin());
}

/// The file at the path, which may lack its extension.
std::optional<fs::path> exact(const fs::path& folder, const fs::path& name) {
    for (const char* extension : {"", ".png", ".jpg", ".jpeg"})
        if (fs::path longer = name.string() + extension; core::is_file(folder / longer)) return longer;
    return std::nullopt;
}

bool is_below_images(const fs::path& name) {
    const std::string first = core::lower(name.begin()->string());
    return first == "images" || first == "input";
}

}  // namespace

fs::path entry_in(const fs::path& folder, const std::string& name) {
    std::error_code error;
    std::string found = name;
    if (fs::exists(folder / name, error)) return folder / name;
    for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
        if (const std::string entry = at->path().filename().string();
            core::lower(entry) == core::lower(name) && (found == name || entry < found))
            found = entry;
    return folder / found;
}

bool has_outside(const fs::path& folder) {
    std::error_code error;
    return !folders::is_made_by_ewa(folder) &&
           !fs::equivalent(folder.parent_path(), fs::temp_directory_path(error), error);
}

bool has_photos_folder(const fs::path& folder) {
    return core::is_folder(entry_in(folder, "images")) || core::is_folder(entry_in(folder, "input"));
}

void visit_folders_below(const fs::path& root, const std::function<bool(const fs::path&)>& visit) {
    constexpr size_t kMostFolders = 2000, kMostEntries = 100000;
    constexpr int kLevels = 3;
    constexpr std::string_view kPictures[] = {"images", "input", "mask", "depth", "."};
    const auto is_searched = [&](const fs::directory_entry& entry) {
        const std::string name = core::lower(entry.path().filename().string());
        std::error_code error;
        return entry.is_directory(error) && !entry.is_symlink(error) &&
               !folders::is_made_by_ewa(entry.path()) &&
               std::ranges::none_of(kPictures, [&](std::string_view word) { return name.starts_with(word); });
    };
    if (folders::is_made_by_ewa(root)) return;
    std::vector<fs::path> level{root};
    size_t folders = 0, entries = 0;
    for (int depth = 0; depth < kLevels; ++depth) {
        std::vector<fs::path> below;
        for (const fs::path& folder : level) {
            std::error_code error;
            for (fs::directory_iterator at(folder, error), end;
                 !error && at != end && folders < kMostFolders && ++entries < kMostEntries;
                 at.increment(error))
                if (is_searched(*at)) {
                    ++folders;
                    below.push_back(at->path());
                }
        }
        std::ranges::sort(below);
        std::erase_if(below, [&](const fs::path& folder) { return !visit(folder); });
        level = std::move(below);
    }
}

bool is_named_as_image(const fs::path& file) {
    static constexpr std::array kExtensions{".jpg",  ".jpeg", ".png", ".tif", ".tiff",
                                            ".webp", ".bmp",  ".exr", ".ppm", ".pgm"};
    const std::string extension = core::lower(file.extension().string());
    return std::ranges::find(kExtensions, extension) != kExtensions.end();
}

std::string name_key(const fs::path& name) {
    return core::lower(core::composed(name.generic_string()));
}

fs::path named_path(const std::string& name) {
    if (name.find('\0') != std::string::npos) return {};
    std::string text = name;
    std::replace(text.begin(), text.end(), '\\', '/');
    if (text.size() > 1 && text[1] == ':') text.erase(0, 2);
    fs::path path;
    for (const fs::path& part : fs::path(text).lexically_normal())
        if (!part.has_root_path() && part != ".." && part != ".") path /= part;
    return path.has_filename() ? fs::path(path.generic_string()) : fs::path();
}

std::vector<fs::path> list_images(const fs::path& folder, bool below, bool (*named)(const fs::path&)) {
    std::vector<fs::path> names;
    size_t files = 0;
    std::error_code error;
    constexpr auto kOptions = fs::directory_options::skip_permission_denied;
    for (fs::recursive_directory_iterator at(folder, kOptions, error), end; at != end; at.increment(error)) {
        if (error) break;
        if (++files > kMostFiles || names.size() > kMostImages)
            throw InputError(core::one_line(folder.string()) + ": holds more than 200000 images");
        if (at->is_directory(error) && (!below || is_of_others(at->path()))) at.disable_recursion_pending();
        if (fs::path name = core::inside(at->path(), folder);
            named(name) && !core::is_of_desktop(name) && core::is_file(at->path()))
            names.push_back(std::move(name));
    }
    std::sort(names.begin(), names.end());
    return names;
}

ImageFinder::ImageFinder(std::vector<Place> places) : places_(std::move(places)) {}

ImageFinder::ImageFinder(const fs::path& dataset, const std::vector<std::string>& folders) {
    for (const std::string& name : folders)
        if (const fs::path folder = entry_in(dataset, name); core::is_folder(folder))
            places_.push_back({folder});
    places_.push_back({dataset, true});
    if (listing(places_.size() - 1).names.empty()) add_last(dataset);
}

void ImageFinder::add_last(const fs::path& dataset) {
    for (const char* name : {"undistorted", "dense"})
        if (fs::path folder = entry_in(dataset, name); core::is_folder(folder))
            places_.push_back({std::move(folder), false, true, true});
}

fs::path ImageFinder::folder() const {
    return settled().own ? settled().folder / "images" : settled().folder;
}

const ImageFinder::Listing& ImageFinder::listing(size_t place) const {
    const auto [at, is_new] = listings_.try_emplace(place);
    Listing& list = at->second;
    if (!is_new) return list;
    list.names = list_images(places_[place].folder, places_[place].below);
    for (size_t i = 0; i < list.names.size(); ++i) {
        list.by_name[name_key(list.names[i].filename())].push_back(i);
        list.by_stem[name_key(list.names[i].stem())].push_back(i);
    }
    return list;
}

std::vector<fs::path> ImageFinder::listed(const std::map<std::string, std::vector<size_t>>& map, size_t place,
                                          const fs::path& key, const fs::path& name, bool strict) const {
    const fs::path above = name.parent_path();
    // An image that was removed from its folder is not replaced by one of the same name from elsewhere.
    const bool there = strict || (!above.empty() && core::is_folder(places_[place].folder / above));
    std::vector<fs::path> found;
    const auto at = map.find(name_key(key));
    if (at == map.end()) return found;
    size_t most = 0;
    for (const size_t i : at->second) found.push_back(listing(place).names[i]);
    for (const fs::path& each : found) most = std::max(most, common_parts(each.parent_path(), above));
    std::erase_if(found, [&](const fs::path& each) {
        const fs::path parent = each.parent_path();
        return there ? name_key(parent) != name_key(above) : common_parts(parent, above) < most;
    });
    if (found.size() > 1 && std::ranges::any_of(found, is_below_images))
        std::erase_if(found, [](const fs::path& each) { return !is_below_images(each); });
    return found;
}

std::vector<fs::path> ImageFinder::named(size_t place, const fs::path& name, bool strict) const {
    if (core::is_file(places_[place].folder / name)) return {name};
    return listed(listing(place).by_name, place, name.filename(), name, strict);
}

const std::set<fs::path>& ImageFinder::claimed(size_t place, bool strict) const {
    const auto [at, is_new] = claimed_.try_emplace(place);
    if (is_new)
        for (const fs::path& name : names_)
            for (const fs::path& image : named(place, name, strict))
                at->second.insert(platform::folded(image));
    return at->second;
}

std::vector<fs::path> ImageFinder::matches(size_t place, const fs::path& name, bool strict) const {
    const fs::path& folder = places_[place].folder;
    if (core::is_file(folder / name)) return {name};
    const auto is_claimed = [&](const fs::path& image) {
        return claimed(place, strict).contains(platform::folded(image));
    };
    if (const auto there = exact(folder, name); there && !is_claimed(*there)) return {*there};
    std::vector<fs::path> found = named(place, name, strict);
    for (const fs::path& key : {name.filename(), name.stem()}) {
        if (!found.empty()) break;
        found = listed(listing(place).by_stem, place, key, name, strict);
        // What another name is the name of is that one's image.
        if (!found.empty()) std::erase_if(found, is_claimed);
    }
    return found;
}

void ImageFinder::settle(const std::vector<std::string>& names) const {
    std::vector<fs::path> paths;
    for (const std::string& name : names)
        if (fs::path path = named_path(name); !path.empty()) paths.push_back(std::move(path));
    names_ = paths;
    size_t most = 0;
    for (size_t place = 0; place < places_.size(); ++place) {
        const fs::path& folder = places_[place].folder;
        if (places_[place].last && most > 0) return;
        const auto at_path = std::ranges::count_if(
            paths, [&](const fs::path& path) { return exact(folder, path).has_value(); });
        const auto found = 2 * size_t(at_path) >= paths.size()
                               ? paths.size()
                               : size_t(std::ranges::count_if(paths, [&](const fs::path& path) {
                                     return matches(place, path, at_path > 0).size() == 1;
                                 }));
        if (found <= most) continue;
        most = found;
        place_ = place;
        strict_ = at_path > 0;
        if (most == paths.size()) return;
    }
}

std::optional<ImageFinder::Found> ImageFinder::find_in(size_t place, const fs::path& name,
                                                       const std::string& where) const {
    const auto& [folder, own, below, last] = places_[place];
    const std::vector<fs::path> found = matches(place, name, strict_);
    if (found.size() > 1)
        throw InputError(where + "is one of " + std::to_string(found.size()) + " images in " +
                         core::one_line(folder.string()) + ", such as " + core::one_line(found[0].string()) +
                         " and " + core::one_line(found[1].string()) + "; give the images different names");
    const fs::path& chosen = found.empty() ? name : found[0];
    const bool inside = own ? core::links_stay_with_images(folder, chosen)
                            : core::links_stay_with_images(folder.parent_path(), folder.filename() / chosen);
    if (!inside) throw InputError(where + "is a link out of the dataset's folder; " + core::kLinkAdvice);
    if (found.empty()) return std::nullopt;
    return Found{folder / chosen, chosen.string()};
}

void ImageFinder::find(const std::string& text, const std::string& where, ImageRecord& record) const {
    const std::string shown = where + ": the image \"" + core::one_line(text.substr(0, kShownName)) + "\" ";
    const fs::path name = named_path(text);
    if (name.empty()) throw InputError(shown + "has no file's name");
    for (size_t place = place_.value_or(0); place < (place_ ? *place_ + 1 : places_.size()); ++place)
        if (auto found = find_in(place, name, shown)) {
            place_ = place;
            record.path = std::move(found->path);
            record.name = std::move(found->name);
            return;
        }
    const fs::path inside = core::name_inside(text).value_or(name.filename());
    record.path = settled().folder / inside;
    record.name = inside.string();
}

}  // namespace ewa::io
