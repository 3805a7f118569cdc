// SPDX-License-Identifier: Apache-2.0
// Finds masks and depth maps, which belong to images by their names. Counts which of a dataset's files are used.
#pragma once
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "io/datasets/image_records.h"

namespace ewa::io {

/// The masks or the depth maps of a dataset, or of photos whose cameras are not known yet.
class Companions {
  public:
    enum class Kind { masks, depth_maps };

    /// Lists the files. dataset: its folder. downscale: as DatasetOptions::downscale.
    Companions(Kind kind, const ImageRecords& images, const std::filesystem::path& dataset, int downscale);

    /// The mask or depth map of an image, by the image's name or as the model states. Empty if the image has none. Throws
    /// InputError for a link out of the dataset.
    std::filesystem::path find(const ImageRecord& image);

    /// The mask or depth map for all images: the only file found, if its name is that of no image. Empty if there is no such file.
    std::filesystem::path of_all();

    /// The numbers of files that were found and that are used. bare: names of images without a file.
    UsedOf used(const std::vector<std::string>& bare) const;

  private:
    struct File {
        std::filesystem::path folder, name;  // name: relative to the folder
        int rank = 0;                        // of the folder: the lowest has precedence
        std::string above = {};              // the key of the folder of its image, if it has that one
        std::string fault = {};              // why it cannot be used, after its name
    };
    /// images: the folder that the folder belongs to, relative to folder_.
    void list(const std::filesystem::path& folder, int rank, const std::filesystem::path& images = {});
    void list_folders(int downscale);
    void list_loose(int rank);
    void list_beside(const std::vector<ImageRecord>& images);
    /// Finds files that cannot be used.
    void examine();
    std::string why_unused(const File& file) const;
    /// Names a folder that is not searched.
    void note_folder(UsedOf& result) const;
    /// The file of an image in a folder of rank `from` to `to`.
    const File* look(const std::filesystem::path& image, int from, int to) const;
    std::filesystem::path take(const File& file);
    std::string shown(const std::filesystem::path& path) const;

    Kind kind_;
    std::filesystem::path dataset_, folder_, root_;  // root_: that the images' folder is in
    int downscale_;
    bool apart_;  // root_ is outside the dataset, which is the images' folder
    std::vector<File> files_;
    std::set<std::filesystem::path> of_photos_, listed_;  // folders; of_photos: down to theirs
    std::map<std::string, std::vector<const File*>> by_name_, by_word_;
    std::map<std::string, int> images_;               // the keys of their stems, and how many have each
    std::set<std::filesystem::path> used_, missing_;  // missing: what the model names
    bool for_all_ = false;
};

/// Counts the image files of a dataset, and those that have a camera. dataset: must have its frames.
UsedOf used_photos(const ImageRecords& model, const Dataset& dataset);

}  // namespace ewa::io
