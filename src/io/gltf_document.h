// SPDX-License-Identifier: Apache-2.0
// A glTF file's structure (through tinygltf) and the numbers its accessors hold, whatever buffer they stand
// in.
#pragma once
#include <tiny_gltf.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace ewa::io {

/// Only what a splat scene needs is parsed: scenes, nodes, meshes, accessors, buffer views. Images, materials
/// and "extras" are left out, and a file nested or branched beyond any splat scene is refused before memory
/// is taken.
class GltfDocument {
  public:
    /// Throws InputError that names the file and the byte or the property.
    explicit GltfDocument(const std::filesystem::path& path);

    const std::string& name() const { return name_; }
    const tinygltf::Model& model() const { return model_; }
    bool binary() const { return binary_; }
    uint64_t bytes() const;  // of the file and the buffers outside it

    /// Throws InputError "name: text".
    [[noreturn]] void fail(const std::string& text) const;

    /// The accessor, after checking that its buffer holds every element. `what` names it in the error.
    const tinygltf::Accessor& accessor(int index, const std::string& what) const;

    /// Its elements in order: element(index, values), integers that are normalised as 0..1 or -1..1.
    void read(const tinygltf::Accessor& accessor, const std::string& what,
              const std::function<void(size_t, const double*)>& element) const;

  private:
    struct Buffer {
        std::filesystem::path file;  // empty: in data
        uint64_t begin = 0, size = 0;
        std::vector<unsigned char> data;
    };
    void add_buffers(const std::filesystem::path& folder, const void* json_buffers, uint64_t chunk_begin,
                     uint64_t chunk_size);
    Buffer open_uri(const std::filesystem::path& folder, const std::string& uri, size_t index) const;

    std::string name_;
    std::filesystem::path path_;
    uint64_t file_bytes_ = 0;
    bool binary_ = false;
    tinygltf::Model model_;
    std::vector<Buffer> buffers_;
};

}  // namespace ewa::io
