// SPDX-License-Identifier: Apache-2.0
// Writes splats as glTF, whose layout gltf_splats.cpp describes.
#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/text.h"
#include "ewa/error.h"
#include "io/gltf/glb_file.h"
#include "io/splats/formats.h"
#include "io/splats/gltf_splats.h"
#include "io/splats/splat_values.h"
#include "scene/color.h"

namespace ewa::io {

namespace {

using Json = nlohmann::ordered_json;

constexpr int kSpzVersionOfGltf = 2;  // that of the extension's name

// The layout of the buffer is known before its values, so they go to the file without a copy in memory.

struct Attribute {
    std::string name;
    const char* type;
    size_t bytes;                                                      // per element; a multiple of 4
    std::function<void(const Gaussians&, size_t, std::byte*)> encode;  // element i
    int component = TINYGLTF_COMPONENT_TYPE_FLOAT;
    bool normalized = false;
};

template <size_t n, class Value>
Attribute floats(const std::string& name, const char* type, Value value) {
    const auto encode = [value](const Gaussians& g, size_t i, std::byte* to) {
        std::array<float, n> values{};
        for (size_t k = 0; k < n; ++k) values[k] = value(g, i, k);
        std::memcpy(to, values.data(), sizeof(values));
    };
    return {name, type, sizeof(float) * n, encode, TINYGLTF_COMPONENT_TYPE_FLOAT, false};
}

/// COLOR_0: the base colour in linear light, and opacity.
void encode_color(const Gaussians& g, size_t i, std::byte* to) {
    constexpr double kLargest = 65535;
    std::array<uint16_t, 4> color{};
    for (size_t k = 0; k < 3; ++k) {
        const double shown = std::clamp(color_of_sh0(g.sh[g.sh_stride() * i + k]), 0.0, 1.0);
        color[k] = uint16_t(to_level(scene::linear_of_srgb(shown) * kLargest, uint32_t(kLargest)));
    }
    color[3] = uint16_t(to_level(sigmoid(g.opacity_logits[i]) * kLargest, uint32_t(kLargest)));
    std::memcpy(to, color.data(), sizeof(color));
}

std::vector<Attribute> attributes_of(const Gaussians& gaussians) {
    std::vector<Attribute> list;
    list.push_back(floats<3>("POSITION", "VEC3",
                             [](const Gaussians& g, size_t i, size_t k) { return g.means[3 * i + k]; }));
    list.push_back({"COLOR_0", "VEC4", 8, encode_color, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, true});
    list.push_back(floats<4>(kSplatPrefix + "ROTATION", "VEC4", [](const Gaussians& g, size_t i, size_t k) {
        return float(unit_quaternion(&g.quaternions[4 * i])[(k + 1) % 4]);
    }));
    list.push_back(floats<3>(kSplatPrefix + "SCALE", "VEC3", [](const Gaussians& g, size_t i, size_t k) {
        return scale_of_log(g.log_scales[3 * i + k]);
    }));
    list.push_back(floats<1>(kSplatPrefix + "OPACITY", "SCALAR", [](const Gaussians& g, size_t i, size_t) {
        return float(sigmoid(g.opacity_logits[i]));
    }));
    size_t first = 0;
    for (int degree = 0; degree <= gaussians.sh_degree; ++degree)
        for (int k = 0; k < 2 * degree + 1; ++k, first += 3)
            list.push_back(
                floats<3>(sh_name(degree, k), "VEC3", [first](const Gaussians& g, size_t i, size_t channel) {
                    return g.sh[g.sh_stride() * i + first + channel];
                }));
    return list;
}

void add_bounds(const Gaussians& gaussians, Json& accessor) {
    std::array<double, 3> low, high;
    low.fill(std::numeric_limits<double>::infinity());
    high.fill(-std::numeric_limits<double>::infinity());
    for (size_t i = 0; i < gaussians.means.size(); ++i) {
        low[i % 3] = std::min(low[i % 3], double(gaussians.means[i]));
        high[i % 3] = std::max(high[i % 3], double(gaussians.means[i]));
    }
    accessor["min"] = low;
    accessor["max"] = high;
}

/// The box where these two axes are negated.
void turn_bounds(Json& accessor, std::array<size_t, 2> axes) {
    const auto low = accessor["min"], high = accessor["max"];
    for (const size_t k : axes) {
        accessor["min"][k] = -high[k].get<double>();
        accessor["max"][k] = -low[k].get<double>();
    }
}

/// The node turns by 180 degrees about z, because the values are in PLY's frame.
Json structure(const Gaussians& gaussians, const std::vector<Attribute>& attributes, uint64_t buffer_bytes) {
    const size_t count = gaussians.size();
    Json views = Json::array(), accessors = Json::array(), names = Json::object();
    uint64_t offset = 0;
    for (const Attribute& attribute : attributes) {
        const uint64_t bytes = uint64_t(attribute.bytes) * count;
        Json accessor = {{"bufferView", views.size()},
                         {"componentType", attribute.component},
                         {"count", count},
                         {"type", attribute.type}};
        if (attribute.normalized) accessor["normalized"] = true;
        if (attribute.name == "POSITION") add_bounds(gaussians, accessor);
        names[attribute.name] = accessors.size();
        accessors.push_back(std::move(accessor));
        views.push_back({{"buffer", 0},
                         {"byteOffset", offset},
                         {"byteLength", bytes},
                         {"target", TINYGLTF_TARGET_ARRAY_BUFFER}});
        offset += bytes;
    }
    const Json extension = {{"kernel", "ellipse"},
                            {"colorSpace", "srgb_rec709_display"},
                            {"projection", "perspective"},
                            {"sortingMethod", "cameraDistance"}};
    const Json primitive = {{"attributes", names},
                            {"mode", TINYGLTF_MODE_POINTS},
                            {"extensions", {{kSplatExtension, extension}}}};
    return {{"asset", {{"version", "2.0"}, {"generator", "ewa " EWA_VERSION}}},
            {"extensionsUsed", {kSplatExtension}},
            {"scene", 0},
            {"scenes", {{{"nodes", {0}}}}},
            {"nodes", {{{"mesh", 0}, {"rotation", {0, 0, 1, 0}}}}},
            {"meshes", {{{"primitives", {primitive}}}}},
            {"accessors", accessors},
            {"bufferViews", views},
            {"buffers", {{{"byteLength", buffer_bytes}}}}};
}

void write_values(core::AtomicFile& file, const Gaussians& gaussians,
                  const std::vector<Attribute>& attributes, const SaveOptions& options) {
    const size_t n = gaussians.size();
    for (size_t a = 0; a < attributes.size(); ++a) {
        encode_in_pieces(
            n, attributes[a].bytes, [&](size_t i, std::byte* to) { attributes[a].encode(gaussians, i, to); },
            [&](const std::byte* bytes, size_t size, size_t) { file.write(bytes, size); });
        if (options.progress) options.progress(n * uint64_t(a + 1) / attributes.size(), n);
    }
}

/// Encodes all characters but the unreserved ones of RFC 3986.
std::string percent_encoded(const std::string& text) {
    std::string encoded;
    for (const char c : text) {
        const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                           c == '-' || c == '.' || c == '_' || c == '~';
        constexpr const char* kDigits = "0123456789ABCDEF";
        const auto byte = static_cast<unsigned char>(c);
        encoded += plain ? std::string(1, c) : std::string{'%', kDigits[byte >> 4], kDigits[byte & 15]};
    }
    return encoded;
}

void write_pair(const std::filesystem::path& path, Json root, const ValueWriter& write_values) {
    NewValues values(path, gltf_value_files);
    write_values(values.add());
    root["buffers"][0]["uri"] = percent_encoded(values.claim()[0].filename().string());
    values.replace(root.dump(1) + "\n");
}

void write_document(const std::filesystem::path& path, const Json& root, uint64_t bytes,
                    const ValueWriter& write_values) {
    if (core::lower(path.filename().string()).ends_with(".glb"))
        write_glb(path, root.dump(), bytes, "write a .gltf", write_values);
    else
        write_pair(path, root, write_values);
}

/// An SPZ in place of the accessors' values. cesium: in Cesium's older profile. See gltf_splats.cpp.
void write_packed(const std::filesystem::path& path, const Gaussians& gaussians, const SaveOptions& options,
                  bool cesium, SpzLoss& loss) {
    SaveOptions packing = options;
    packing.spz_version = kSpzVersionOfGltf;
    std::string packed = pack_spz(path, gaussians, packing, loss);
    const size_t bytes = packed.size();
    packed.resize((bytes + 3) / 4 * 4, '\0');
    std::vector<Attribute> attributes = attributes_of(gaussians);
    if (cesium)
        std::erase_if(attributes, [](const Attribute& attribute) {
            return attribute.name == kSplatPrefix + "OPACITY" || attribute.name == sh_name(0, 0);
        });
    Json root = structure(gaussians, attributes, packed.size());
    for (Json& accessor : root["accessors"]) {
        accessor.erase("bufferView");
        // An SPZ has colours of 8 bits, which CesiumJS puts into the accessor as they are.
        if (accessor["componentType"] == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT)
            accessor["componentType"] = TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE;
    }
    turn_bounds(root["accessors"][0], cesium ? std::array<size_t, 2>{1, 2} : std::array<size_t, 2>{0, 1});
    Json& extension = root["meshes"][0]["primitives"][0]["extensions"][kSplatExtension];
    if (cesium) extension = Json::object();
    extension["extensions"][kSpzExtension] = {{"bufferView", 0}};
    root["bufferViews"] = {{{"buffer", 0}, {"byteOffset", 0}, {"byteLength", bytes}}};
    root["extensionsUsed"].push_back(kSpzExtension);
    root["extensionsRequired"] = root["extensionsUsed"];
    root["nodes"] = {{{"mesh", 0}}};
    write_document(path, root, packed.size(),
                   [&](core::AtomicFile& file) { file.write(packed.data(), packed.size()); });
}

}  // namespace

std::vector<std::string> write_gltf_splats(const std::filesystem::path& path, const Gaussians& gaussians,
                                           const SaveOptions& options) {
    if (gaussians.size() == 0) throw InputError(path.string() + ": glTF cannot store a scene without splats");
    if (options.gltf_spz) {
        SpzLoss loss;
        write_packed(path, gaussians, options, false, loss);
        return loss.remarks();
    }
    const std::vector<Attribute> attributes = attributes_of(gaussians);
    uint64_t bytes = 0;
    for (const Attribute& attribute : attributes) bytes += uint64_t(attribute.bytes) * gaussians.size();
    write_document(path, structure(gaussians, attributes, bytes), bytes,
                   [&](core::AtomicFile& file) { write_values(file, gaussians, attributes, options); });
    return {};
}

void write_cesium_tile(const std::filesystem::path& path, const Gaussians& gaussians,
                       const SaveOptions& options, SpzLoss& loss) {
    write_packed(path, gaussians, options, true, loss);
}

}  // namespace ewa::io
