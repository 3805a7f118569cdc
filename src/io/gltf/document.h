// SPDX-License-Identifier: Apache-2.0
// The structure of a glTF file (through tinygltf), the numbers of its accessors, and the tree of its nodes.
#pragma once
#include <tiny_gltf.h>

#include <array>
#include <filesystem>
#include <functional>
#include <glm/mat4x4.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace ewa::core {
class JsonField;
}

namespace ewa::io {

/// The numbers of a .glb: its beginning, and the types of its chunks.
constexpr uint32_t kGlbMagic = 0x46546c67, kGlbJson = 0x4e4f534a, kGlbBin = 0x004e4942;
inline const std::string kSplatExtension = "KHR_gaussian_splatting";
/// Names of the extension that stores a primitive's splats as an SPZ in a buffer view: that of the draft of 2026, then earlier
/// ones. The extension is nested in kSplatExtension, or beside it.
inline const std::array<std::string, 4> kSpzExtensions = {
    kSplatExtension + "_compression_spz_2", kSplatExtension + "_compression_spz",
    "KHR_spz_gaussian_splats_compression", "KHR_spz_compression"};

/// The sections of the file that a reader needs.
enum class GltfContent {
    splats,  // scenes, nodes, meshes, accessors, buffer views; neither materials nor "extras"
    meshes   // also materials, textures, samplers, cameras, lights, "extras"; images stay encoded
};

/// Whether the reader of this content does what the extension says, or may leave it out: how surfaces look does not matter to
/// splats.
bool reads_extension(std::string_view name, GltfContent content);

/// Parses only the sections that the content needs. A file that is nested or branched beyond any real scene
/// is refused before memory is allocated.
class GltfDocument {
  public:
    /// Throws InputError that names the file and the byte or the property, or an extension that the file requires and that is
    /// not read.
    explicit GltfDocument(const std::filesystem::path& path, GltfContent content = GltfContent::splats);

    const std::string& name() const { return name_; }
    const tinygltf::Model& model() const { return model_; }
    bool binary() const { return binary_; }
    bool animated() const { return animated_; }
    uint64_t bytes() const;                                     // of the file and of its external buffers
    std::vector<std::filesystem::path> external_files() const;  // of its buffers, each once

    /// Throws InputError "name: text".
    [[noreturn]] void fail(const std::string& text) const;

    /// The accessor, after a check that its buffer holds every element. `what` names it in the error.
    /// `indices` allows 32-bit integers, which no attribute has.
    const tinygltf::Accessor& accessor(int index, const std::string& what, bool indices = false) const;

    /// The accessor of a primitive's attribute, which has one of the types and, unless it is POSITION,
    /// `count` elements. Null if the primitive lacks the attribute. `where` names the primitive in errors.
    const tinygltf::Accessor* attribute(const tinygltf::Primitive& primitive, const std::string& name,
                                        std::initializer_list<int> types, size_t count,
                                        const std::string& where) const;

    /// A node's mesh. `node` names the node in errors.
    const tinygltf::Mesh& mesh(int index, const std::string& node) const;

    /// Calls element(index, values) for the elements in order. Normalised integers become 0..1 or -1..1.
    void read(const tinygltf::Accessor& accessor, const std::string& what,
              const std::function<void(size_t, const double*)>& element) const;

    /// The bytes of a buffer view. what: begins the errors.
    std::vector<std::byte> view_bytes(int index, const std::string& what) const;

    /// With GltfContent::meshes: the number of images, and the encoded bytes of one, from its file, buffer or
    /// data URI. Throws InputError, also for more than 64 MiB.
    size_t images() const { return images_.size(); }
    std::vector<unsigned char> image_bytes(size_t index) const;

  private:
    struct Buffer {
        std::filesystem::path file;  // empty: the bytes are in data
        uint64_t begin = 0, size = 0;
        std::vector<unsigned char> data;
    };
    struct ImageSource {
        std::string uri;  // empty: the image is in the buffer view
        int view = -1;
    };
    void add_buffers(const core::JsonField& top, uint64_t chunk_begin, uint64_t chunk_size);
    void add_images(const core::JsonField& top);
    Buffer open_uri(const std::string& uri, const std::string& what) const;
    /// The buffer view, after a check that it is in its buffer.
    const tinygltf::BufferView& buffer_view(int index, const std::string& what) const;
    Buffer open_view(int index, const std::string& what) const;

    std::string name_;
    std::filesystem::path path_;
    uint64_t file_bytes_ = 0;
    bool binary_ = false, animated_ = false;
    tinygltf::Model model_;
    std::vector<Buffer> buffers_;
    std::vector<ImageSource> images_;
};

/// Calls visit(index, matrix) for every node of the default scene, or of the first one if there is no
/// default. `matrix` maps the node's frame to the world, and `world` is applied last. Parents come before
/// children, siblings in order. Throws InputError that names the node and its property. Causes include a
/// missing scene and a node that is reached twice.
void visit_nodes(const GltfDocument& document, const glm::dmat4& world,
                 const std::function<void(int, const glm::dmat4&)>& visit);

}  // namespace ewa::io
