// SPDX-License-Identifier: Apache-2.0
// The JSON is a few kB whose layout is known beforehand, so that the values go from the scene to the file
// without a copy of them in a buffer.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/text.h"
#include "ewa/error.h"
#include "io/gltf/gltf_document.h"
#include "io/splats/gltf_splats.h"
#include "io/splats/splat_values.h"

namespace ewa::io {

namespace {

using Json = nlohmann::ordered_json;

constexpr int kFloat = 5126, kUnsignedShort = 5123, kArrayBuffer = 34962, kPoints = 0;
constexpr uint32_t kMagic = 0x46546c67, kJsonChunk = 0x4e4f534a, kBinChunk = 0x004e4942;

struct Attribute {
    std::string name;
    const char* type;
    size_t bytes;                                                      // an element; a multiple of 4
    std::function<void(const Gaussians&, size_t, std::byte*)> encode;  // element i
    int component = kFloat;
    bool normalized = false;
};

template <size_t n, class Value>
Attribute floats(const std::string& name, const char* type, Value value) {
    const auto encode = [value](const Gaussians& g, size_t i, std::byte* to) {
        std::array<float, n> values{};
        for (size_t k = 0; k < n; ++k) values[k] = value(g, i, k);
        std::memcpy(to, values.data(), sizeof(values));
    };
    return {name, type, sizeof(float) * n, encode, kFloat, false};
}

/// IEC 61966-2-1.
double linear_of_srgb(double v) {
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

/// For programs that draw points: the colour without view dependence in linear light, as COLOR_0 is, and
/// opacity.
void encode_color(const Gaussians& g, size_t i, std::byte* to) {
    constexpr double kLargest = 65535;
    std::array<uint16_t, 4> color{};
    for (size_t k = 0; k < 3; ++k) {
        const double shown = std::clamp(color_of_sh0(g.sh[g.sh_stride() * i + k]), 0.0, 1.0);
        color[k] = uint16_t(to_level(linear_of_srgb(shown) * kLargest, uint32_t(kLargest)));
    }
    color[3] = uint16_t(to_level(sigmoid(g.opacity_logits[i]) * kLargest, uint32_t(kLargest)));
    std::memcpy(to, color.data(), sizeof(color));
}

std::vector<Attribute> attributes_of(const Gaussians& gaussians) {
    const std::string prefix = "KHR_gaussian_splatting:";
    std::vector<Attribute> list;
    list.push_back(floats<3>("POSITION", "VEC3",
                             [](const Gaussians& g, size_t i, size_t k) { return g.means[3 * i + k]; }));
    list.push_back({"COLOR_0", "VEC4", 8, encode_color, kUnsignedShort, true});
    list.push_back(floats<4>(prefix + "ROTATION", "VEC4", [](const Gaussians& g, size_t i, size_t k) {
        return float(unit_quaternion(&g.quaternions[4 * i])[(k + 1) % 4]);
    }));
    list.push_back(floats<3>(prefix + "SCALE", "VEC3", [](const Gaussians& g, size_t i, size_t k) {
        return scale_of_log(g.log_scales[3 * i + k]);
    }));
    list.push_back(floats<1>(prefix + "OPACITY", "SCALAR", [](const Gaussians& g, size_t i, size_t) {
        return float(sigmoid(g.opacity_logits[i]));
    }));
    size_t first = 0;
    for (int degree = 0; degree <= gaussians.sh_degree; ++degree)
        for (int k = 0; k < 2 * degree + 1; ++k, first += 3)
            list.push_back(
                floats<3>(prefix + "SH_DEGREE_" + std::to_string(degree) + "_COEF_" + std::to_string(k),
                          "VEC3", [first](const Gaussians& g, size_t i, size_t channel) {
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

/// The node's half turn round z says that the values are in PLY's frame.
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
        views.push_back(
            {{"buffer", 0}, {"byteOffset", offset}, {"byteLength", bytes}, {"target", kArrayBuffer}});
        offset += bytes;
    }
    const Json extension = {{"kernel", "ellipse"},
                            {"colorSpace", "srgb_rec709_display"},
                            {"projection", "perspective"},
                            {"sortingMethod", "cameraDistance"}};
    const Json primitive = {
        {"attributes", names}, {"mode", kPoints}, {"extensions", {{"KHR_gaussian_splatting", extension}}}};
    return {{"asset", {{"version", "2.0"}, {"generator", "ewa " EWA_VERSION}}},
            {"extensionsUsed", {"KHR_gaussian_splatting"}},
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
    constexpr size_t kSplatsAtOnce = 16384;
    const size_t n = gaussians.size();
    std::vector<std::byte> bytes;
    for (size_t a = 0; a < attributes.size(); ++a) {
        const Attribute& attribute = attributes[a];
        bytes.resize(kSplatsAtOnce * attribute.bytes);
        for (size_t begin = 0; begin < n; begin += kSplatsAtOnce) {
            const size_t end = std::min(begin + kSplatsAtOnce, n);
            for (size_t i = begin; i < end; ++i)
                attribute.encode(gaussians, i, &bytes[(i - begin) * attribute.bytes]);
            file.write(bytes.data(), (end - begin) * attribute.bytes);
        }
        if (options.progress) options.progress(n * uint64_t(a + 1) / attributes.size(), n);
    }
}

/// Characters that stand for themselves in a URI (RFC 3986, "unreserved").
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

void write_binary(const std::filesystem::path& path, const Gaussians& gaussians,
                  const std::vector<Attribute>& attributes, const Json& json, uint64_t bytes,
                  const SaveOptions& options) {
    std::string text = json.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const uint64_t total = 12 + 8 + text.size() + 8 + bytes;
    if (total > std::numeric_limits<uint32_t>::max())
        throw InputError(path.string() + ": a .glb ends at 4 GiB and this one would have " +
                         std::to_string(total) + " bytes; write a .gltf");
    core::AtomicFile file(path);
    const uint32_t head[5] = {kMagic, 2, uint32_t(total), uint32_t(text.size()), kJsonChunk};
    file.write(head, sizeof(head));
    file.write(text);
    const uint32_t chunk[2] = {uint32_t(bytes), kBinChunk};
    file.write(chunk, sizeof(chunk));
    write_values(file, gaussians, attributes, options);
    file.commit();
}

bool refers_to(const std::filesystem::path& gltf, const std::filesystem::path& values) try {
    return GltfDocument(gltf).refers_to(values);
} catch (const InputError&) {
    return false;
}

/// The values are put in place first: a .gltf that is there has them. The .gltf is on disk by then, so that
/// none stay without one.
void write_pair(const std::filesystem::path& path, const Gaussians& gaussians,
                const std::vector<Attribute>& attributes, Json json, const SaveOptions& options) {
    check_gltf_values(path);
    const std::filesystem::path buffer = gltf_values_path(path);
    json["buffers"][0]["uri"] = percent_encoded(buffer.filename().string());
    core::AtomicFile values(buffer), file(path);
    write_values(values, gaussians, attributes, options);
    file.write(json.dump(1) + "\n");
    values.commit();
    file.commit();
}

}  // namespace

std::filesystem::path gltf_values_path(const std::filesystem::path& gltf) {
    return std::filesystem::path(gltf).replace_extension(".bin");
}

void check_gltf_values(const std::filesystem::path& gltf) {
    const std::filesystem::path values = gltf_values_path(gltf);
    std::error_code none;
    if (!std::filesystem::exists(values, none) || refers_to(gltf, values)) return;
    throw InputError(core::one_line(
        values.string() + ": would be replaced by the values of " + gltf.filename().string() +
        ", and is no part of one that is there; choose another name, or .glb, which is one file"));
}

std::vector<std::string> write_gltf_splats(const std::filesystem::path& path, const Gaussians& gaussians,
                                           const SaveOptions& options, bool binary) {
    if (gaussians.size() == 0)
        throw InputError(path.string() + ": glTF has no way to hold a scene without splats");
    const std::vector<Attribute> attributes = attributes_of(gaussians);
    uint64_t bytes = 0;
    for (const Attribute& attribute : attributes) bytes += uint64_t(attribute.bytes) * gaussians.size();
    const Json json = structure(gaussians, attributes, bytes);
    if (binary)
        write_binary(path, gaussians, attributes, json, bytes, options);
    else
        write_pair(path, gaussians, attributes, json, options);
    return {};
}

}  // namespace ewa::io
