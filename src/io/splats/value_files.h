// SPDX-License-Identifier: Apache-2.0
// Formats whose values are in files beside the file that names them: a .gltf, and the meta.json of a SOG. New values get
// names that no file has, so that the rename of the naming file replaces everything at once, and no file of others is
// touched.
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace ewa::core {
class AtomicFile;
}

namespace ewa::io {

using Paths = std::vector<std::filesystem::path>;

/// The files that writing a naming file writes and removes beside it.
struct ValueFiles {
    Paths usual;
    Paths written;
    Paths removed;  // older values, once the naming file is in its place
};

/// usual: the names of the values. If a file has one of these names, all values get -2, -3 and so on. named_by: returns the
/// values that an existing naming file names. If ewa wrote the existing `naming`, its values with such names are removed,
/// unless another naming file in the folder names them too.
ValueFiles value_files(const std::filesystem::path& naming, const Paths& usual,
                       Paths (*named_by)(const std::filesystem::path&));

/// A naming file and its values, replaced at once.
class NewValues {
  public:
    /// beside: the ValueFiles of the naming file.
    NewValues(const std::filesystem::path& naming, ValueFiles (*beside)(const std::filesystem::path&));
    /// Removes the new files unless replace() was called.
    ~NewValues();
    NewValues(const NewValues&) = delete;
    NewValues& operator=(const NewValues&) = delete;

    /// Opens the next value file, which the caller writes.
    core::AtomicFile& add();
    /// Chooses and returns the names of the values: the usual ones, or those with the first number that no file has. Names that
    /// other processes have reserved count as existing files.
    Paths claim();
    /// Puts all in place, the naming file last, and removes the older values.
    void replace(std::string_view text);

  private:
    std::filesystem::path naming_;
    ValueFiles (*beside_)(const std::filesystem::path&);
    ValueFiles before_;
    std::vector<std::unique_ptr<core::AtomicFile>> files_;
};

/// a.bin, a-2.bin, a-3.bin and so on.
std::filesystem::path numbered(const std::filesystem::path& usual, int number);

/// The inverse of numbered(): the file's name without -2, -3 and so on.
std::string without_number(const std::filesystem::path& file);

/// Whether ewa wrote the file, by the asset.generator at the beginning of a JSON or .glb.
bool written_by_ewa(const std::filesystem::path& file);

}  // namespace ewa::io
