// SPDX-License-Identifier: Apache-2.0
// Files that belong to images by their names: masks and depth maps. Also what of a dataset's files is used.
#pragma once
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "io/datasets/image_records.h"

namespace ewa::io {

/// The masks or the depth maps of a dataset.
class Companions {
  public:
    enum class Kind { masks, depth_maps };

    /// Lists the files. dataset: its folder. downscale: as DatasetOptions::downscale.
    Companions(Kind kind, const ImageRecords& images, const std::filesystem::path& dataset, int downscale);

    /// The file of an image, which the model may name; empty if there is none. Throws InputError for a link out of the dataset.
    std::filesystem::path find(const ImageRecord& image);

    /// A file that is alone there, and of none of the images: it is for all of them. Empty if there is none.
    std::filesystem::path of_all();

    /// What was found, and is used. bare: names of images without a file.
    UsedOf used(const std::vector<std::string>& bare) const;

  private:
    struct File {
        std::filesystem::path folder, name;  // name: relative to the folder
        int rank = 0;                        // of the folder: the least counts
        bool readable = true;
    };
    void list(const std::filesystem::path& folder, int rank);
    void list_beside(const std::vector<ImageRecord>& images);
    bool has_readable_depths(const File& file) const;
    /// The file of an image in a folder of rank `from` to `to`.
    const File* look(const std::filesystem::path& image, int from, int to) const;
    std::filesystem::path take(const File& file);
    std::string shown(const std::filesystem::path& path) const;

    Kind kind_;
    std::filesystem::path dataset_, folder_, root_;  // root_: that the images' folder is in
    int downscale_;
    std::vector<File> files_;
    std::map<std::string, std::vector<const File*>> by_name_, by_word_;
    std::map<std::string, int> images_;               // the keys of their stems, and how many have each
    std::set<std::filesystem::path> used_, missing_;  // missing: what the model names
    bool for_all_ = false;
};

/// What the photos are of which there is a file, or a camera. dataset: with its frames.
UsedOf used_photos(const ImageRecords& model, const Dataset& dataset);

}  // namespace ewa::io
