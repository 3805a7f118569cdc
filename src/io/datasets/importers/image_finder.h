// SPDX-License-Identifier: Apache-2.0
// Finds the images that a file of cameras names. The file may name them as on another machine: by a path that no longer exists, by
// file name, with another extension or in another case, or by a label without an extension.
#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace ewa::io {

struct ImageRecord;

class ImageFinder {
  public:
    /// A folder that may hold the images.
    struct Place {
        std::filesystem::path folder;
        bool own = false;   // the dataset's own folder, which also holds other files and folders
        bool below = true;  // also search the folders below it
        bool last = false;  // search it only if no other place has any of the images
    };

    /// The places, the likeliest first. All images are in one of them.
    explicit ImageFinder(std::vector<Place> places);
    /// Searches these folders of the dataset, if they exist, then the dataset's own folder. If that has no images, also
    /// undistorted/ and dense/.
    ImageFinder(const std::filesystem::path& dataset, const std::vector<std::string>& folders);

    /// Chooses the place by all names in the file of cameras. Without this call, the first image found decides. After it, only
    /// names whose path does not exist are searched in other folders of the place.
    void settle(const std::vector<std::string>& names) const;

    /// Adds folders of the dataset that usually have the images of a workspace. They are searched last.
    void add_last(const std::filesystem::path& dataset);

    /// Sets the record's path and its name relative to the place. A missing image has a path without a file. Among several images
    /// with the name, the one with most of the path in common is taken. Throws InputError that begins with `where`: several such
    /// images, no name of a file, a link out of the dataset, or more than 200,000 images.
    void find(const std::string& name, const std::string& where, ImageRecord& record) const;

    /// All images of the place, relative to it and sorted. Without one that is chosen, those of the likeliest place.
    const std::vector<std::filesystem::path>& names() const { return listing(place_.value_or(0)).names; }
    /// The folder of the images. It is the dataset's images/ if they lie in the dataset's own folder.
    std::filesystem::path folder() const;

  private:
    struct Found {
        std::filesystem::path path;
        std::string name;
    };
    struct Listing {
        std::vector<std::filesystem::path> names;                     // relative to the place, sorted
        std::map<std::string, std::vector<size_t>> by_name, by_stem;  // by their keys
    };
    const Place& settled() const { return places_[place_.value_or(0)]; }
    const Listing& listing(size_t place) const;
    /// Those of a place's images by name or stem whose key is this, and whose path has most in common with the name.
    std::vector<std::filesystem::path> listed(const std::map<std::string, std::vector<size_t>>& map,
                                              size_t place, const std::filesystem::path& key,
                                              const std::filesystem::path& name, bool strict) const;
    /// The images of a place with exactly this name; upper and lower case are the same.
    std::vector<std::filesystem::path> named(size_t place, const std::filesystem::path& name,
                                             bool strict) const;
    /// The images of the place that names of settle() refer to.
    const std::set<std::filesystem::path>& claimed(size_t place, bool strict) const;
    /// The images of a place that the name may mean.
    std::vector<std::filesystem::path> matches(size_t place, const std::filesystem::path& name,
                                               bool strict) const;
    std::optional<Found> find_in(size_t place, const std::filesystem::path& name,
                                 const std::string& where) const;

    std::vector<Place> places_;
    mutable std::map<size_t, Listing> listings_;  // by index of the place
    mutable std::optional<size_t> place_;
    mutable std::vector<std::filesystem::path> names_;                   // of settle()
    mutable std::map<size_t, std::set<std::filesystem::path>> claimed_;  // by index of the place
    mutable bool strict_ = false;  // the place has images at the paths that the file names
};

/// The entry of the folder with this name; else one whose name differs in case alone (ASCII). folder / name if there is none.
std::filesystem::path entry_in(const std::filesystem::path& folder, const std::string& name);

/// Whether files beside the folder may belong to it. False if ewa made the folder, or it is an unpacked archive.
bool has_outside(const std::filesystem::path& folder);

/// Whether the folder has a subfolder for photos: images/ or input/.
bool has_photos_folder(const std::filesystem::path& folder);

/// Calls `visit` for the folders below `root`, three levels deep, level by level, in the order of names. Skips folders of images,
/// links, and results of ewa. Enters a folder only if `visit` returns true. Visits nothing if `root` is a result of ewa.
void visit_folders_below(const std::filesystem::path& root,
                         const std::function<bool(const std::filesystem::path&)>& visit);

/// Whether the file's name is that of an image that ewa reads.
bool is_named_as_image(const std::filesystem::path& file);

/// The images in the folder, and in those below it but for folders of other pictures (masks, depth maps, smaller copies) and results
/// of ewa. Relative to it, in the order of names. named: which files count. Throws InputError if there are more than 200,000.
std::vector<std::filesystem::path> list_images(
    const std::filesystem::path& folder, bool below,
    bool (*named)(const std::filesystem::path&) = is_named_as_image);

/// The name as it is compared: equal for names that differ in case (ASCII), or in how letters with marks are written.
std::string name_key(const std::filesystem::path& name);

/// The path that a file names, also one of Windows or of another machine, as a path below some folder. Empty if it names no file.
std::filesystem::path named_path(const std::string& name);

}  // namespace ewa::io
