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

/// What a reader wants of the file.
enum class GltfContent {
    splats,  // scenes, nodes, meshes, accessors, buffer views; neither materials nor "extras"
    meshes   // also materials, textures, samplers, cameras, lights, "extras"; images stay as they are encoded
};

/// Only what the content needs is parsed, and a file nested or branched beyond any such scene is refused
/// before memory is taken.
class GltfDocument {
  public:
    /// Throws InputError that names the file and the byte or the property.
    explicit GltfDocument(const std::filesystem::path& path, GltfContent content = GltfContent::splats);

    const std::string& name() const { return name_; }
    const tinygltf::Model& model() const { return model_; }
    bool binary() const { return binary_; }
    bool animated() const { return animated_; }
    uint64_t bytes() const;                                   // of the file and the buffers outside it
    bool refers_to(const std::filesystem::path& file) const;  // as one of its buffers

    /// Throws InputError "name: text".
    [[noreturn]] void fail(const std::string& text) const;

    /// The accessor, after checking that its buffer holds every element. `what` names it in the error.
    /// indices: 32-bit integers are allowed, which no attribute has.
    const tinygltf::Accessor& accessor(int index, const std::string& what, bool indices = false) const;

    /// Of a document of meshes: how many images there are, and the bytes of one as the file, a buffer or a
    /// data URI has them. Throws InputError, also for more than 64 MiB.
    size_t images() const { return images_.size(); }
    std::vector<unsigned char> image_bytes(size_t index) const;

    /// Its elements in order: element(index, values), integers that are normalised as 0..1 or -1..1.
    void read(const tinygltf::Accessor& accessor, const std::string& what,
              const std::function<void(size_t, const double*)>& element) const;

  private:
    struct Buffer {
        std::filesystem::path file;  // empty: in data
        uint64_t begin = 0, size = 0;
        std::vector<unsigned char> data;
    };
    struct ImageSource {
        std::string uri;  // empty: in the buffer view
        int view = -1;
    };
    void add_buffers(const std::filesystem::path& folder, const void* json_buffers, uint64_t chunk_begin,
                     uint64_t chunk_size);
    void add_images(const void* json_images);
    Buffer open_uri(const std::filesystem::path& folder, const std::string& uri,
                    const std::string& what) const;
    Buffer open_view(int index, const std::string& what) const;

    std::string name_;
    std::filesystem::path path_;
    uint64_t file_bytes_ = 0;
    bool binary_ = false, animated_ = false;
    tinygltf::Model model_;
    std::vector<Buffer> buffers_;
    std::vector<ImageSource> images_;
};

}  // namespace ewa::io
