// SPDX-License-Identifier: Apache-2.0
// glTF 2.0 with KHR_gaussian_splatting (Khronos; release candidate of 2026), as .glb, or as .gltf with a .bin
// beside it.
//
// A primitive of mode POINTS has the attributes
//   POSITION                                   metres, in the node's frame
//   KHR_gaussian_splatting:ROTATION            unit quaternion x y z w
//   KHR_gaussian_splatting:SCALE               linear standard deviations
//   KHR_gaussian_splatting:OPACITY             linear, 0..1
//   KHR_gaussian_splatting:SH_DEGREE_l_COEF_m  RGB, l = 0..3, m = 0..2l in INRIA's order
//   COLOR_0                                    linear colour and opacity, for programs that draw points
// glTF's world is LUF (x left, y up, z forward), which is PLY's turned by 180 degrees about z. The writer
// keeps the stored values and adds that turn as a node's rotation. The reader applies the nodes' transforms,
// to SH too.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <glm/mat4x4.hpp>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/atomic_file.h"
#include "core/folders.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "io/gltf/document.h"
#include "io/splats/formats.h"
#include "io/splats/linear_colors.h"
#include "io/splats/splat_values.h"
#include "scene/color.h"

namespace ewa::io {

namespace {

using Json = nlohmann::ordered_json;

const std::string kPrefix = kSplatExtension + ":";
constexpr int kMostPlacedPrimitives = 4096;  // each reads its attributes again

std::string sh_name(int degree, int coefficient) {
    return kPrefix + "SH_DEGREE_" + std::to_string(degree) + "_COEF_" + std::to_string(coefficient);
}

double opacity_logit(int component_type, double opacity) {
    const uint32_t steps = component_type == TINYGLTF_COMPONENT_TYPE_BYTE             ? 127
                           : component_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE  ? 255
                           : component_type == TINYGLTF_COMPONENT_TYPE_SHORT          ? 32767
                           : component_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ? 65535
                                                                                      : 0;
    return steps ? logit_of_steps(opacity, steps) : logit_of_opacity(opacity);
}

class SplatReader {
  public:
    explicit SplatReader(const GltfDocument& document) : document_(document), model_(document.model()) {}

    SplatScene read() {
        // From glTF's world (LUF) to PLY's: 180 degrees about z.
        glm::dmat4 to_ply(1.0);
        to_ply[0][0] = to_ply[1][1] = -1;
        visit_nodes(document_, to_ply, [&](int index, const glm::dmat4& matrix) {
            const int mesh = model_.nodes[size_t(index)].mesh;
            if (mesh >= 0) add_mesh(mesh, matrix, "node " + std::to_string(index));
        });
        if (primitives_ == 0)
            document_.fail("the scene's nodes reach no primitive with the extension " + kSplatExtension +
                           "; ewa train and ewa dataset render mesh scenes");
        scene_.file_sh_degree = std::max(scene_.file_sh_degree, scene_.gaussians.sh_degree);
        scene_.format = document_.binary() ? SplatFormat::glb : SplatFormat::gltf;
        scene_.variant = std::to_string(primitives_) + (primitives_ == 1 ? " primitive" : " primitives");
        return std::move(scene_);
    }

  private:
    void add_mesh(int index, const glm::dmat4& matrix, const std::string& node) {
        const tinygltf::Mesh& mesh = document_.mesh(index, node);
        for (size_t i = 0; i < mesh.primitives.size(); ++i) {
            const auto extension = mesh.primitives[i].extensions.find(kSplatExtension);
            if (extension == mesh.primitives[i].extensions.end()) continue;
            if (++primitives_ > kMostPlacedPrimitives)
                document_.fail(node + ": more than " + std::to_string(kMostPlacedPrimitives) +
                               " primitives are placed in the scene");
            where_ = "mesh " + std::to_string(index) + ", primitive " + std::to_string(i);
            Gaussians part = read_primitive(mesh.primitives[i], extension->second);
            try {
                transform_splats(part, matrix);
            } catch (const InputError& error) {
                document_.fail(node + ": " + error.what());
            }
            if (primitives_ == 1)
                scene_.gaussians = std::move(part);
            else
                append_splats(scene_.gaussians, part);
        }
    }

    Gaussians read_primitive(const tinygltf::Primitive& primitive, const tinygltf::Value& extension) {
        const std::string kernel = text(extension, "kernel"), space = text(extension, "colorSpace");
        if (kernel != "ellipse")
            document_.fail(where_ + ": \"kernel\" is \"" + kernel + "\"; only \"ellipse\" is supported");
        const bool linear = space == "lin_rec709_display";
        if (!linear && space != "srgb_rec709_display")
            document_.fail(where_ + ": \"colorSpace\" \"" + space + "\" is not supported");
        if (primitive.mode != TINYGLTF_MODE_POINTS) remark("a primitive's \"mode\" is not 0 (points)");

        const tinygltf::Accessor& position = attribute(primitive, "POSITION", TINYGLTF_TYPE_VEC3);
        Gaussians g;
        g.sh_degree = degree_of(primitive);
        count_ = position.count;
        require_memory(document_.name(), document_.bytes(), uint64_t(scene_.gaussians.size()) + count_,
                       std::max(g.sh_degree, scene_.gaussians.sh_degree));
        // All accessors are checked before memory is allocated.
        const tinygltf::Accessor& rotation = attribute(primitive, kPrefix + "ROTATION", TINYGLTF_TYPE_VEC4);
        const tinygltf::Accessor& scale = attribute(primitive, kPrefix + "SCALE", TINYGLTF_TYPE_VEC3);
        const tinygltf::Accessor& opacity = attribute(primitive, kPrefix + "OPACITY", TINYGLTF_TYPE_SCALAR);
        require_fractions(rotation, "ROTATION");
        require_fractions(opacity, "OPACITY");
        g.resize(count_);
        read_values(position, "POSITION", [&](size_t i, const double* v) {
            for (size_t k = 0; k < 3; ++k) g.means[3 * i + k] = float(v[k]);
        });
        read_values(rotation, "ROTATION", [&](size_t i, const double* v) {
            for (size_t k = 0; k < 4; ++k) g.quaternions[4 * i + k] = float(v[(k + 3) % 4]);
        });
        read_values(scale, "SCALE", [&](size_t i, const double* v) {
            for (size_t k = 0; k < 3; ++k) g.log_scales[3 * i + k] = log_of_scale(v[k]);
        });
        read_values(opacity, "OPACITY", [&](size_t i, const double* v) {
            g.opacity_logits[i] = float(opacity_logit(opacity.componentType, v[0]));
        });
        read_sh(primitive, g);
        if (linear) remark(linear_colors_to_srgb(g));
        return g;
    }

    std::string text(const tinygltf::Value& extension, const char* property) const {
        if (!extension.IsObject() || !extension.Has(property) || !extension.Get(property).IsString())
            document_.fail(where_ + ": the extension " + kSplatExtension + " has no \"" + property + "\"");
        return extension.Get(property).Get<std::string>();
    }

    const tinygltf::Accessor& attribute(const tinygltf::Primitive& primitive, const std::string& name,
                                        int type) const {
        const auto* accessor = document_.attribute(primitive, name, {type}, count_, where_);
        if (!accessor) document_.fail(where_ + ", attribute " + name + ": is missing");
        return *accessor;
    }

    void require_fractions(const tinygltf::Accessor& accessor, const char* name) const {
        if (accessor.componentType != TINYGLTF_COMPONENT_TYPE_FLOAT && !accessor.normalized)
            document_.fail(where_ + ", attribute " + kPrefix + name + ": integers must be \"normalized\"");
    }

    void read_values(const tinygltf::Accessor& accessor, const char* name,
                     const std::function<void(size_t, const double*)>& element) const {
        document_.read(accessor, where_ + ", attribute " + name, element);
    }

    /// The highest SH degree. Throws if a degree lacks some of its coefficients, or a lower degree is
    /// missing.
    int degree_of(const tinygltf::Primitive& primitive) {
        int degree = 0;
        for (int d = 1; d <= kMaxShDegree; ++d) {
            int present = 0;
            for (int k = 0; k < 2 * d + 1; ++k) present += int(primitive.attributes.count(sh_name(d, k)));
            if (present == 0) continue;
            if (present < 2 * d + 1 || degree != d - 1)
                document_.fail(where_ + ": of SH degree " + std::to_string(degree == d - 1 ? d : d - 1) +
                               " there are attributes missing");
            degree = d;
        }
        if (primitive.attributes.count(sh_name(kMaxShDegree + 1, 0)) > 0) {
            scene_.file_sh_degree = kMaxShDegree + 1;
            remark("SH degrees above 3 are skipped");
        }
        return degree;
    }

    void read_sh(const tinygltf::Primitive& primitive, Gaussians& g) const {
        size_t first = 0;
        for (int degree = 0; degree <= g.sh_degree; ++degree)
            for (int k = 0; k < 2 * degree + 1; ++k, first += 3) {
                const std::string name = sh_name(degree, k);
                read_values(attribute(primitive, name, TINYGLTF_TYPE_VEC3), name.c_str(),
                            [&](size_t i, const double* v) {
                                float* sh = &g.sh[g.sh_stride() * i + first];
                                for (size_t channel = 0; channel < 3; ++channel)
                                    sh[channel] = float(v[channel]);
                            });
            }
    }

    void remark(const std::string& text) {
        if (std::find(scene_.remarks.begin(), scene_.remarks.end(), text) == scene_.remarks.end())
            scene_.remarks.push_back(text);
    }

    const GltfDocument& document_;
    const tinygltf::Model& model_;
    SplatScene scene_;
    std::string where_;   // the primitive being read, for errors
    size_t count_ = 0;    // its splats
    int primitives_ = 0;  // read so far
};

// Writing. The layout of the buffer is known before its values, so they go to the file without a copy in
// memory.

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
    list.push_back(floats<4>(kPrefix + "ROTATION", "VEC4", [](const Gaussians& g, size_t i, size_t k) {
        return float(unit_quaternion(&g.quaternions[4 * i])[(k + 1) % 4]);
    }));
    list.push_back(floats<3>(kPrefix + "SCALE", "VEC3", [](const Gaussians& g, size_t i, size_t k) {
        return scale_of_log(g.log_scales[3 * i + k]);
    }));
    list.push_back(floats<1>(kPrefix + "OPACITY", "SCALAR", [](const Gaussians& g, size_t i, size_t) {
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

void write_binary(const std::filesystem::path& path, const Gaussians& gaussians,
                  const std::vector<Attribute>& attributes, const Json& root, uint64_t bytes,
                  const SaveOptions& options) {
    std::string text = root.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const uint64_t total = 12 + 8 + text.size() + 8 + bytes;
    if (total > std::numeric_limits<uint32_t>::max())
        throw InputError(path.string() + ": a .glb is limited to 4 GiB, and this one would have " +
                         std::to_string(total) + " bytes; write a .gltf");
    core::AtomicFile file(path);
    const uint32_t head[5] = {kGlbMagic, 2, uint32_t(total), uint32_t(text.size()), kGlbJson};
    file.write(head, sizeof(head));
    file.write(text);
    const uint32_t chunk[2] = {uint32_t(bytes), kGlbBin};
    file.write(chunk, sizeof(chunk));
    write_values(file, gaussians, attributes, options);
    file.commit();
}

/// Both files are on disk before either is renamed. The new values have another name than the old ones. The rename of
/// the .gltf thus replaces all of it at once.
void write_pair(const std::filesystem::path& path, const Gaussians& gaussians,
                const std::vector<Attribute>& attributes, Json root, const SaveOptions& options) {
    const ValueFiles beside = gltf_value_files(path);
    const std::filesystem::path& buffer = beside.written[0];
    root["buffers"][0]["uri"] = percent_encoded(buffer.filename().string());
    core::AtomicFile values(buffer), file(path);
    write_values(values, gaussians, attributes, options);
    file.write(root.dump(1) + "\n");
    values.commit();
    file.commit();
    remove_values(beside);
}

}  // namespace

SplatScene read_gltf_splats(const std::filesystem::path& path) {
    const GltfDocument document(path);
    return SplatReader(document).read();
}

std::vector<std::filesystem::path> gltf_values(const std::filesystem::path& gltf) try {
    if (!core::is_file(gltf)) return {};
    return GltfDocument(gltf).external_files();
} catch (const InputError&) {
    return {};
}

ValueFiles gltf_value_files(const std::filesystem::path& gltf) {
    return value_files(gltf, {std::filesystem::path(gltf).replace_extension(".bin")}, gltf_values);
}

std::vector<std::string> write_gltf_splats(const std::filesystem::path& path, const Gaussians& gaussians,
                                           const SaveOptions& options) {
    if (gaussians.size() == 0) throw InputError(path.string() + ": glTF cannot store a scene without splats");
    const std::vector<Attribute> attributes = attributes_of(gaussians);
    uint64_t bytes = 0;
    for (const Attribute& attribute : attributes) bytes += uint64_t(attribute.bytes) * gaussians.size();
    const Json json = structure(gaussians, attributes, bytes);
    if (core::lower(path.filename().string()).ends_with(".glb"))
        write_binary(path, gaussians, attributes, json, bytes, options);
    else
        write_pair(path, gaussians, attributes, json, options);
    return {};
}

}  // namespace ewa::io
