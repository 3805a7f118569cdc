// SPDX-License-Identifier: Apache-2.0
// The images of a dataset whose cameras' file names them as they were on another machine: by path, by file name, or by a label
// without an extension.
#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace ewa::io {

class ImageFinder {
  public:
    /// Lists the images in and below the first of these folders of the dataset that exists; without one, those in the dataset's
    /// own folder. Throws InputError if there are more than 200,000.
    ImageFinder(const std::filesystem::path& dataset, const std::vector<std::string>& folders);

    struct Found {
        std::filesystem::path path;
        std::string name;  // relative to folder()
    };
    /// A missing image is a path at which no file is. The extension may differ. Among several images with the name, the one
    /// counts whose path has most in common. Throws InputError that begins with `where` if that is not one image, if the name is no file's,
    /// or if the image is a link out of the dataset.
    Found find(const std::string& name, const std::string& where) const;

    /// The folder of the images. It is the dataset's images/ if they lie in the dataset's own folder.
    const std::filesystem::path& folder() const { return folder_; }
    /// All images, relative to place(), in the order of names.
    const std::vector<std::filesystem::path>& names() const { return names_; }
    /// The folder that was listed.
    const std::filesystem::path& place() const { return place_; }

  private:
    std::vector<size_t> named(const std::filesystem::path& name) const;

    std::filesystem::path place_, folder_;
    bool own_folder_ = true;  // whether the images lie in the dataset's own folder
    std::vector<std::filesystem::path> names_;
    std::map<std::string, std::vector<size_t>> by_name_, by_stem_;  // in lower case
};

/// Whether the file's name is that of an image that ewa reads.
bool is_named_as_image(const std::filesystem::path& file);

}  // namespace ewa::io
