// SPDX-License-Identifier: Apache-2.0
// Splats and datasets as arguments: objects, or the paths of files, archives and runs' folders.
#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/variant.h>

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "bindings.h"
#include "ewa/dataset.h"

namespace ewa::python {

using SharedDataset = std::shared_ptr<const Dataset>;

/// ewa.Dataset, which never changes once it is made.
struct LoadedDataset {
    SharedDataset dataset;
    /// Absolute. It and the options below load the dataset again in another process.
    std::filesystem::path path;
    DatasetOptions options;
    int test_every = 0;                 // every which frame is held out
    bool archived = false;              // `dataset` then keeps what was unpacked
    std::array<float, 3> background{};  // of the run that `path` is; else black
};

/// What of DatasetOptions is given. The rest is that of a run, or as usual.
struct AskedDataset {
    std::optional<int> downscale = {}, max_width = {};
    std::optional<MaskUse> masks = {};
    std::optional<LensUse> lens = {};
    bool need_images = true;
};

/// Reads a dataset, that of a run's folder, or one in an archive. Throws InputError.
LoadedDataset open_dataset(const std::filesystem::path& path, const AskedDataset& asked);
inline LoadedDataset open_dataset(const std::filesystem::path& path) {
    return open_dataset(path, {});
}

/// Reads splats, or those of a run's folder. What is skipped becomes Python's warnings. Throws InputError.
Splats open_splats(const std::filesystem::path& path);

/// An object, or one that its path names.
template <class Object>
using ObjectOrPath = std::variant<const Object*, std::filesystem::path>;
#define EWA_SPLATS_TYPE "Splats | str | os.PathLike[str]"
#define EWA_DATASET_TYPE "Dataset | str | os.PathLike[str]"

template <class Object>
class Opened {
  public:
    Opened(const ObjectOrPath<Object>& given, Object (*open)(const std::filesystem::path&))
        : read_(given.index() == 1 ? std::optional<Object>(open(std::get<1>(given))) : std::nullopt),
          object_(read_ ? &*read_ : std::get<0>(given)) {}
    Opened(const Opened&) = delete;
    Opened& operator=(const Opened&) = delete;
    const Object& operator*() const { return *object_; }
    const Object* operator->() const { return object_; }

  private:
    std::optional<Object> read_;
    const Object* object_;
};

/// Indices of frames from Python. Throws IndexError that names the argument.
std::vector<int> frames_of(nanobind::handle value, const Dataset& dataset, const char* name);

}  // namespace ewa::python
