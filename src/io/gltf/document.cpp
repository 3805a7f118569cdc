// SPDX-License-Identifier: Apache-2.0
#include "io/gltf/document.h"

#include <algorithm>
#include <glm/gtc/quaternion.hpp>
#include <nlohmann/json.hpp>

#include "core/file_reader.h"
#include "core/json.h"
#include "core/json_field.h"
#include "core/sandboxed_path.h"
#include "core/typing.h"
#include "ewa/error.h"

namespace ewa::io {

namespace {

using nlohmann::json;

constexpr size_t kLongestReason = 300;  // limits a library's error, which may quote the file at any length
constexpr size_t kMostObjects = 1 << 15, kMostValues = 1 << 17;  // for splats; meshes have more nodes
constexpr size_t kMeshFactor = 2;
constexpr uint64_t kMostImageBytes = uint64_t(64) << 20;

struct Chunks {
    std::string json;
    uint64_t json_begin = 0;               // offset of the text in the file
    uint64_t bin_begin = 0, bin_size = 0;  // of a .glb
    bool binary = false;
};

Chunks read_chunks(core::FileReader& reader) {
    Chunks chunks;
    uint64_t size = reader.size();
    if (size >= 4) {
        uint32_t magic = 0;
        std::memcpy(&magic, reader.take(4, "the header"), 4);
        chunks.binary = magic == kGlbMagic;
        if (!chunks.binary) chunks.json.assign(reinterpret_cast<const char*>(&magic), 4);
    }
    if (chunks.binary) {
        const auto version = reader.read<uint32_t>("the header");
        if (version != 2) reader.fail("GLB version " + std::to_string(version) + " is not supported; 2 is");
        const auto length = reader.read<uint32_t>("the header");
        if (length > reader.size())
            reader.fail("the header claims " + std::to_string(length) + " bytes, but the file has " +
                        std::to_string(reader.size()) + "; it is truncated");
        size = reader.read<uint32_t>("the first chunk");
        if (reader.read<uint32_t>("the first chunk") != kGlbJson) reader.fail("the first chunk is not JSON");
        chunks.json_begin = reader.offset();
    } else {
        size -= chunks.json.size();
    }
    if (size > reader.remaining())
        reader.fail("the JSON claims " + std::to_string(size) + " bytes, but only " +
                    std::to_string(reader.remaining()) + " follow");
    const std::byte* text = reader.take(size_t(size), "the JSON");
    chunks.json.append(reinterpret_cast<const char*>(text), size_t(size));
    if (chunks.binary && reader.remaining() > 0) {
        chunks.bin_size = reader.read<uint32_t>("the second chunk");
        if (reader.read<uint32_t>("the second chunk") != kGlbBin) reader.fail("the second chunk is not BIN");
        chunks.bin_begin = reader.offset();
        if (chunks.bin_size > reader.remaining())
            reader.fail("the second chunk claims " + std::to_string(chunks.bin_size) + " bytes, but only " +
                        std::to_string(reader.remaining()) + " follow; the file is truncated");
    }
    return chunks;
}

/// What a file is that is no glTF, by its first bytes.
std::string foreign_kind(std::string_view head) {
    constexpr std::pair<std::string_view, const char*> kKinds[] = {
        {"ply", "it is a PLY"},
        {"NGSP", "it is a splat file (SPZ)"},
        {"\x1f\x8b", "it is compressed with gzip, as splat files are (SPZ)"},
        {"\x89PNG", "it is a PNG image"},
        {"\xff\xd8", "it is a JPEG image"}};
    for (const auto& [beginning, kind] : kKinds)
        if (head.starts_with(beginning)) return kind;
    return "it begins neither with a brace nor as a .glb does";
}

/// Throws if the file is not glTF at all: errors of its JSON would mislead.
void check_kind(const GltfDocument& document, const Chunks& chunks, GltfContent content) {
    if (chunks.binary) return;
    if (chunks.json.empty()) document.fail("the file is empty");
    const size_t first = chunks.json.find_first_not_of(" \t\r\n");
    if (first != std::string::npos && chunks.json[first] == '{') return;
    document.fail((content == GltfContent::meshes ? "is not a mesh scene (glTF): " : "is not a glTF: ") +
                  foreign_kind(chunks.json));
}

json parse(const std::string& name, const Chunks& chunks, GltfContent content) {
    const bool splats = content == GltfContent::splats;
    core::JsonLimits limits;
    limits.objects = kMostObjects * (splats ? 1 : kMeshFactor);
    limits.values = kMostValues * (splats ? 1 : kMeshFactor);
    if (splats) limits.skipped = "extras";
    limits.begin = chunks.json_begin;
    return core::parse_json<json>(chunks.json, name, limits);
}

/// Leaves of the nodes' extensions what the content needs: newer releases of tinygltf refuse files for others, and do not name the
/// node whose light is missing.
void keep_needed_extensions(const GltfDocument& document, json& nodes, const json& top, GltfContent content) {
    constexpr const char* kLights = "KHR_lights_punctual";
    if (!nodes.is_array()) return;
    const json::json_pointer list("/extensions/KHR_lights_punctual/lights");
    const size_t lights = top.contains(list) && top[list].is_array() ? top[list].size() : 0;
    size_t index = 0;
    for (json& node : nodes) {
        const size_t at = index++;
        if (!node.is_object()) continue;
        const json extensions = node.value("extensions", json());
        node.erase("extensions");
        if (content != GltfContent::meshes || !extensions.is_object() || !extensions.contains(kLights))
            continue;
        const json& reference = extensions[kLights];
        const auto light = reference.is_object() ? reference.find("light") : reference.end();
        if (light == reference.end() || !light->is_number_unsigned() || *light >= lights)
            document.fail("node " + std::to_string(at) + ": " + kLights +
                          ": \"light\" is missing or there is none of this number");
        node["extensions"][kLights] = reference;
    }
}

/// The sections that the content needs, as text. Images are excluded, because tinygltf would open them.
std::string needed_sections(const GltfDocument& document, const json& top, GltfContent content) {
    json kept = json::object();
    const auto keep = [&](std::initializer_list<const char*> keys) {
        for (const char* key : keys)
            if (const auto found = top.find(key); found != top.end()) kept[key] = *found;
    };
    keep({"asset", "scene", "scenes", "nodes", "meshes", "accessors", "bufferViews", "extensionsUsed",
          "extensionsRequired"});
    if (content == GltfContent::meshes) keep({"materials", "textures", "samplers", "cameras", "extensions"});
    if (const auto nodes = kept.find("nodes"); nodes != kept.end())
        keep_needed_extensions(document, *nodes, top, content);
    // Strings are names here, so bytes that are not UTF-8 may be replaced.
    return kept.dump(-1, ' ', false, json::error_handler_t::replace);
}

std::string percent_decoded(const std::string& text) {
    std::string decoded;
    for (size_t i = 0; i < text.size(); ++i) {
        unsigned value = 0;
        if (text[i] == '%' && i + 2 < text.size()) {
            const auto [end, error] = std::from_chars(&text[i + 1], &text[i + 1] + 2, value, 16);
            if (error == std::errc() && end == &text[i + 1] + 2) {
                decoded += char(value);
                i += 2;
                continue;
            }
        }
        decoded += text[i];
    }
    return decoded;
}

/// The name of the missing property in tinygltf's errors that describe it in words.
std::string missing_property(const std::string& error) {
    for (const auto& [words, property] : {std::pair{"Spot light", "spot"},
                                          {"Orthographic camera", "orthographic"},
                                          {"Perspective camera", "perspective"}})
        if (error.find(std::string(words) + " description not found") != std::string::npos)
            return std::string(" (\"") + property + "\")";
    return {};
}

/// The objects of the list "kinds".
std::vector<core::JsonField> objects_of(const core::JsonField& top, const std::string& kind) {
    std::vector<core::JsonField> fields;
    for (const json& value : top.list((kind + "s").c_str())) {
        fields.emplace_back(value, top.where() + ": " + kind + " " + std::to_string(fields.size()));
        if (!value.is_object()) fields.back().fail("is not an object");
    }
    return fields;
}

const std::vector<int>& roots(const GltfDocument& document) {
    const tinygltf::Model& model = document.model();
    if (model.scenes.empty()) document.fail("\"scenes\" is missing, so nothing is placed in the world");
    const int index = std::max(model.defaultScene, 0);
    if (size_t(index) >= model.scenes.size())
        document.fail("\"scene\" is " + std::to_string(index) + ", which does not exist");
    return model.scenes[size_t(index)].nodes;
}

glm::dmat4 local(const GltfDocument& document, const tinygltf::Node& node, int index) {
    const auto size = [&](const std::vector<double>& values, size_t n, const char* property) {
        if (!values.empty() && values.size() != n)
            document.fail("node " + std::to_string(index) + ": \"" + property + "\" needs " +
                          std::to_string(n) + " numbers");
        return !values.empty();
    };
    glm::dmat4 matrix(1.0);
    if (size(node.matrix, 16, "matrix")) {
        for (int i = 0; i < 16; ++i) matrix[i / 4][i % 4] = node.matrix[size_t(i)];
        return matrix;
    }
    if (size(node.rotation, 4, "rotation")) {
        const glm::dquat q(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]);
        if (!(glm::length(q) > 0)) document.fail("node " + std::to_string(index) + ": \"rotation\" is zero");
        matrix = glm::mat4_cast(glm::normalize(q));
    }
    if (size(node.scale, 3, "scale"))
        for (int i = 0; i < 3; ++i) matrix[i] *= node.scale[size_t(i)];
    if (size(node.translation, 3, "translation"))
        for (int i = 0; i < 3; ++i) matrix[3][i] = node.translation[size_t(i)];
    return matrix;
}

/// Throws for an extension without which the file cannot be read: its buffers may hold nothing that is.
void check_required(const GltfDocument& document, const json& top, GltfContent content) {
    const auto list = top.find("extensionsRequired");
    if (list == top.end() || !list->is_array()) return;
    for (const json& entry : *list) {
        if (!entry.is_string() || reads_extension(entry.get<std::string>(), content)) continue;
        const std::string name = entry.get<std::string>().substr(0, 100);
        document.fail("\"extensionsRequired\" names " + name + ", which is not supported" +
                      (name.find("compression") == std::string::npos ? "" : "; export it uncompressed"));
    }
}

}  // namespace

bool reads_extension(std::string_view name, GltfContent content) {
    constexpr std::string_view kMeshes[] = {"KHR_lights_punctual",   "KHR_materials_specular",
                                            "KHR_materials_ior",     "KHR_materials_unlit",
                                            "KHR_mesh_quantization", "KHR_materials_emissive_strength"};
    constexpr std::string_view kOfSurfaces[] = {"KHR_lights_", "KHR_materials_", "KHR_texture_",
                                                "EXT_lights_", "EXT_materials_", "EXT_texture_"};
    if (std::ranges::find(kMeshes, name) != std::end(kMeshes)) return true;
    if (content == GltfContent::meshes) return false;
    if (name == kSplatExtension || std::ranges::find(kSpzExtensions, name) != kSpzExtensions.end())
        return true;
    return std::ranges::any_of(kOfSurfaces, [&](std::string_view start) { return name.starts_with(start); });
}

void GltfDocument::fail(const std::string& text) const {
    throw InputError(name_ + ": " + core::one_line(text));
}

GltfDocument::GltfDocument(const std::filesystem::path& path, GltfContent content) : path_(path) {
    json top;
    uint64_t bin_begin = 0, bin_size = 0;
    {
        core::FileReader reader(path);
        name_ = reader.name();
        file_bytes_ = reader.size();
        const Chunks chunks = read_chunks(reader);
        binary_ = chunks.binary;
        bin_begin = chunks.bin_begin;
        bin_size = chunks.bin_size;
        check_kind(*this, chunks, content);
        top = parse(name_, chunks, content);
    }
    if (!top.is_object()) fail("the JSON is not an object");
    const core::JsonField field(top, name_);
    if (!top.contains("asset")) fail("the JSON has no \"asset\", which every glTF has");
    check_required(*this, top, content);
    if (top.contains("buffers")) add_buffers(field, bin_begin, bin_size);
    if (top.contains("images") && content == GltfContent::meshes) add_images(field);
    if (const auto list = top.find("animations"); list != top.end()) animated_ = !list->empty();
    const std::string text = needed_sections(*this, top, content);
    top = nullptr;
    tinygltf::TinyGLTF loader;
    std::string error, warning;
    bool loaded = false;
    try {
        loaded =
            loader.LoadASCIIFromString(&model_, &error, &warning, text.data(), unsigned(text.size()), "");
    } catch (const std::exception& exception) {
        error = core::plain_reason(exception.what());
    }
    if (!loaded || !error.empty())
        fail("is not a valid glTF: " + error.substr(0, kLongestReason) + missing_property(error));
}

void GltfDocument::add_buffers(const core::JsonField& top, uint64_t chunk_begin, uint64_t chunk_size) {
    constexpr uint64_t kMostBytes = uint64_t(1) << 50;
    for (const core::JsonField& field : objects_of(top, "buffer")) {
        const uint64_t length = field.whole("byteLength", kMostBytes);
        Buffer buffer;
        if (field.has("uri"))
            buffer = open_uri(field.text("uri"), "buffer " + std::to_string(buffers_.size()) + ": ");
        else if (binary_ && buffers_.empty())
            buffer = {path_, chunk_begin, chunk_size, {}};
        else
            field.fail("has no \"uri\", and is not the first of a .glb");
        if (length > buffer.size)
            field.fail("\"byteLength\" is " + std::to_string(length) + ", but it holds " +
                       std::to_string(buffer.size) + " bytes");
        buffer.size = length;
        buffers_.push_back(std::move(buffer));
    }
}

void GltfDocument::add_images(const core::JsonField& top) {
    for (const core::JsonField& field : objects_of(top, "image")) {
        ImageSource source;
        if (field.has("uri"))
            source.uri = field.text("uri");
        else if (field.has("bufferView"))
            source.view = int(field.whole("bufferView", INT32_MAX));
        images_.push_back(std::move(source));
    }
}

const tinygltf::BufferView& GltfDocument::buffer_view(int index, const std::string& what) const {
    if (index < 0 || size_t(index) >= model_.bufferViews.size())
        fail(what + "\"bufferView\" is missing or there is none of this number");
    const tinygltf::BufferView& view = model_.bufferViews[size_t(index)];
    if (view.buffer < 0 || size_t(view.buffer) >= buffers_.size())
        fail(what + "its buffer view's \"buffer\" is none of the file's");
    const uint64_t size = buffers_[size_t(view.buffer)].size;
    if (view.byteOffset > size || view.byteLength > size - view.byteOffset)
        fail(what + "its buffer view ends after its buffer, which has " + std::to_string(size) + " bytes");
    return view;
}

GltfDocument::Buffer GltfDocument::open_view(int index, const std::string& what) const {
    const tinygltf::BufferView& view = buffer_view(index, what);
    const Buffer& buffer = buffers_[size_t(view.buffer)];
    Buffer part{buffer.file, buffer.begin + view.byteOffset, view.byteLength, {}};
    if (buffer.file.empty())
        part.data.assign(buffer.data.begin() + std::ptrdiff_t(view.byteOffset),
                         buffer.data.begin() + std::ptrdiff_t(view.byteOffset + view.byteLength));
    return part;
}

std::vector<std::byte> GltfDocument::view_bytes(int index, const std::string& what) const {
    const Buffer part = open_view(index, what);
    const std::byte* bytes = reinterpret_cast<const std::byte*>(part.data.data());
    if (part.file.empty()) return {bytes, bytes + part.size};
    core::FileReader reader(part.file);
    reader.skip(part.begin, what);
    bytes = reader.take(size_t(part.size), what);
    return {bytes, bytes + part.size};
}

std::vector<unsigned char> GltfDocument::image_bytes(size_t index) const {
    const ImageSource& source = images_[index];
    const std::string what = "image " + std::to_string(index) + ": ";
    Buffer buffer = source.uri.empty() ? open_view(source.view, what) : open_uri(source.uri, what);
    if (buffer.size > kMostImageBytes)
        fail(what + "claims " + std::to_string(buffer.size) + " bytes, more than " +
             std::to_string(kMostImageBytes));
    if (buffer.file.empty()) return std::move(buffer.data);
    core::FileReader reader(buffer.file);
    reader.skip(buffer.begin, what);
    const std::byte* bytes = reader.take(size_t(buffer.size), what);
    const auto* begin = reinterpret_cast<const unsigned char*>(bytes);
    return {begin, begin + buffer.size};
}

GltfDocument::Buffer GltfDocument::open_uri(const std::string& uri, const std::string& what) const {
    Buffer buffer;
    if (uri.starts_with("data:")) {
        std::string mime;
        if (!tinygltf::IsDataURI(uri) || !tinygltf::DecodeDataURI(&buffer.data, mime, uri, 0, false))
            fail(what + "the data \"uri\" is not base64 of a media type that glTF allows");
        buffer.size = buffer.data.size();
        return buffer;
    }
    constexpr size_t kLongestName = 1024;
    if (uri.size() > kLongestName) fail(what + "\"uri\" is longer than a file's name can be");
    const std::filesystem::path folder = path_.parent_path();
    const auto relative = core::name_inside(percent_decoded(uri));
    if (uri.find("://") != std::string::npos || !relative || !core::links_stay_inside(folder, *relative))
        fail(what + "\"uri\" " + uri.substr(0, 200) +
             " leaves the file's folder; only files in or below it are read");
    buffer.file = folder / *relative;
    try {
        buffer.size = core::FileReader(buffer.file).size();
    } catch (const InputError& error) {
        fail(what + "\"uri\": " + error.what());
    }
    return buffer;
}

std::vector<std::filesystem::path> GltfDocument::external_files() const {
    std::vector<std::filesystem::path> files;
    for (const Buffer& buffer : buffers_)
        if (!buffer.file.empty() && std::find(files.begin(), files.end(), buffer.file) == files.end())
            files.push_back(buffer.file);
    return files;
}

uint64_t GltfDocument::bytes() const {
    uint64_t sum = file_bytes_;
    std::vector<std::filesystem::path> counted = {path_};
    for (const Buffer& buffer : buffers_) {
        if (buffer.file.empty() || std::find(counted.begin(), counted.end(), buffer.file) != counted.end())
            continue;
        counted.push_back(buffer.file);
        sum += buffer.size;
    }
    return sum;
}

const tinygltf::Mesh& GltfDocument::mesh(int index, const std::string& node) const {
    if (index < 0 || size_t(index) >= model_.meshes.size())
        fail(node + ": \"mesh\" " + std::to_string(index) + ": there is none of this number");
    return model_.meshes[size_t(index)];
}

void visit_nodes(const GltfDocument& document, const glm::dmat4& world,
                 const std::function<void(int, const glm::dmat4&)>& visit) {
    const std::vector<tinygltf::Node>& nodes = document.model().nodes;
    std::vector<bool> visited(nodes.size());
    std::vector<std::pair<int, glm::dmat4>> open;
    const std::vector<int>& first = roots(document);
    for (size_t i = first.size(); i-- > 0;) open.emplace_back(first[i], world);
    while (!open.empty()) {
        const auto [index, parent] = open.back();
        open.pop_back();
        if (index < 0 || size_t(index) >= nodes.size())
            document.fail("node " + std::to_string(index) + ": there is none of this number");
        if (visited[size_t(index)])
            document.fail("node " + std::to_string(index) + " has two parents or is its own ancestor");
        visited[size_t(index)] = true;
        const tinygltf::Node& node = nodes[size_t(index)];
        const glm::dmat4 matrix = parent * local(document, node, index);
        visit(index, matrix);
        for (size_t i = node.children.size(); i-- > 0;) open.emplace_back(node.children[i], matrix);
    }
}

}  // namespace ewa::io
