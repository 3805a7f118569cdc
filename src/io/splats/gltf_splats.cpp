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
// With KHR_gaussian_splatting_compression_spz_2 (draft), the values are an SPZ in a buffer view, and the accessors have none. The
// text of the extension turns its values from SPZ's frame (RUB) into glTF's (LUF). Files of Cesium's older profile, without "kernel" and
// "colorSpace", are in SPZ's frame.
// Earlier drafts are read too. Their attributes begin with _, as _SCALE. COLOR_0 has the colours, as sRGB values, and the opacities
// where no other attribute has them. Scales may be logarithms. Their SPZ may lie beside the extension, under other names.
// glTF's world is LUF (x left, y up, z forward), which is PLY's turned by 180 degrees about z. The writer
// keeps the stored values and adds that turn as a node's rotation. The reader applies the nodes' transforms,
// to SH too.
#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/mat4x4.hpp>
#include <map>
#include <optional>

#include "core/file_reader.h"
#include "core/folders.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "io/splats/formats.h"
#include "io/splats/gltf_splats.h"
#include "io/splats/linear_colors.h"
#include "io/splats/splat_values.h"

namespace ewa::io {

namespace {

constexpr int kMostPlacedPrimitives = 4096;  // each reads its attributes again

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
        count_placements();
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
        if (clamped_ > 0) remark(clamped_opacities_remark(clamped_));
        scene_.format = document_.binary() ? SplatFormat::glb : SplatFormat::gltf;
        scene_.variant = std::to_string(primitives_) + (primitives_ == 1 ? " primitive" : " primitives");
        return std::move(scene_);
    }

  private:
    void add_mesh(int index, const glm::dmat4& matrix, const std::string& node) {
        const tinygltf::Mesh& mesh = document_.mesh(index, node);
        for (size_t i = 0; i < mesh.primitives.size(); ++i) {
            const tinygltf::Value* extension = splat_extension(mesh.primitives[i]);
            if (!extension) continue;
            if (++primitives_ > kMostPlacedPrimitives)
                document_.fail(node + ": more than " + std::to_string(kMostPlacedPrimitives) +
                               " primitives are placed in the scene");
            where_ = "mesh " + std::to_string(index) + ", primitive " + std::to_string(i);
            turn_ = glm::dmat4(1.0);
            Gaussians part = read_primitive(mesh.primitives[i], *extension);
            try {
                transform_splats(part, matrix * turn_);
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
        if (const auto view = spz_view(primitive)) return read_packed(primitive, extension, *view);
        check_kernel(extension);
        const bool linear = is_linear(extension);
        if (primitive.mode != TINYGLTF_MODE_POINTS) remark("a primitive's \"mode\" is not 0 (points)");

        const tinygltf::Accessor& position = attribute(primitive, "POSITION", TINYGLTF_TYPE_VEC3);
        Gaussians g;
        g.sh_degree = degree_of(primitive);
        count_ = position.count;
        require_memory(document_.name(), document_.bytes(), uint64_t(scene_.gaussians.size()) + count_,
                       std::max(g.sh_degree, scene_.gaussians.sh_degree));
        // All accessors are checked before memory is allocated.
        const tinygltf::Accessor& rotation =
            attribute(primitive, kSplatPrefix + "ROTATION", TINYGLTF_TYPE_VEC4);
        const tinygltf::Accessor& scale = attribute(primitive, kSplatPrefix + "SCALE", TINYGLTF_TYPE_VEC3);
        const bool in_color = is_in_color(primitive, kSplatPrefix + "OPACITY");
        const tinygltf::Accessor& opacity =
            in_color ? attribute(primitive, "COLOR_0", TINYGLTF_TYPE_VEC4)
                     : attribute(primitive, kSplatPrefix + "OPACITY", TINYGLTF_TYPE_SCALAR);
        require_fractions(rotation, kSplatPrefix + "ROTATION");
        require_fractions(opacity, in_color ? "COLOR_0" : kSplatPrefix + "OPACITY");
        g.resize(count_);
        read_values(position, "POSITION", [&](size_t i, const double* v) {
            for (size_t k = 0; k < 3; ++k) g.means[3 * i + k] = float(v[k]);
        });
        read_values(rotation, "ROTATION", [&](size_t i, const double* v) {
            for (size_t k = 0; k < 4; ++k) g.quaternions[4 * i + k] = float(v[(k + 3) % 4]);
        });
        read_scales(scale, g);
        read_values(opacity, in_color ? "COLOR_0" : "OPACITY", [&](size_t i, const double* v) {
            const double value = v[in_color ? 3 : 0];
            clamped_ += value < 0 || value > 1;
            g.opacity_logits[i] = float(opacity_logit(opacity.componentType, value));
        });
        read_sh(primitive, g);
        if (linear) remark(linear_colors_to_srgb(g));
        return g;
    }

    /// Null for a primitive that is no splats. An SPZ beside the extension may be without it.
    static const tinygltf::Value* splat_extension(const tinygltf::Primitive& primitive) {
        static const tinygltf::Value none;
        const auto found = primitive.extensions.find(kSplatExtension);
        if (found != primitive.extensions.end()) return &found->second;
        const bool packed = std::ranges::any_of(
            kSpzExtensions, [&](const auto& name) { return primitive.extensions.contains(name); });
        return packed ? &none : nullptr;
    }

    /// The buffer view of the SPZ, if the primitive has one.
    std::optional<int> spz_view(const tinygltf::Primitive& primitive) const {
        const tinygltf::Value& extension = *splat_extension(primitive);
        const bool nests = extension.IsObject() && extension.Has("extensions");
        for (const std::string& name : kSpzExtensions) {
            const auto beside = primitive.extensions.find(name);
            const tinygltf::Value* spz = beside == primitive.extensions.end() ? nullptr : &beside->second;
            if (nests && extension.Get("extensions").Has(name)) spz = &extension.Get("extensions").Get(name);
            if (!spz) continue;
            if (!spz->IsObject() || !spz->Has("bufferView") || !spz->Get("bufferView").IsInt())
                document_.fail(where_ + ": " + name + " has no \"bufferView\"");
            return spz->Get("bufferView").GetNumberAsInt();
        }
        return std::nullopt;
    }

    /// How often the nodes place each SPZ; more are refused later.
    void count_placements() {
        size_t primitives = 0;
        visit_nodes(document_, glm::dmat4(1), [&](int index, const glm::dmat4&) {
            const int mesh = model_.nodes[size_t(index)].mesh;
            if (mesh < 0 || primitives > kMostPlacedPrimitives) return;
            for (const tinygltf::Primitive& primitive :
                 document_.mesh(mesh, "node " + std::to_string(index)).primitives) {
                if (!splat_extension(primitive)) continue;
                ++primitives;
                where_ = "mesh " + std::to_string(mesh);
                if (const auto view = spz_view(primitive)) ++placements_[*view];
            }
        });
    }

    /// The splats of an SPZ. They stay in memory until the last of the nodes has placed them.
    SplatScene unpacked(int view) {
        const bool last = --placements_[view] <= 0;
        const auto known = unpacked_.find(view);
        if (known != unpacked_.end()) {
            SplatScene scene = last ? std::move(known->second) : known->second;
            if (last) unpacked_.erase(known);
            return scene;
        }
        const std::string name = document_.name() + ": " + where_ + ", the SPZ";
        core::FileReader reader(name, document_.view_bytes(view, where_ + ", " + kSpzExtension + ": "));
        SplatScene scene = read_spz(reader);
        if (!last) unpacked_.emplace(view, scene);
        return scene;
    }

    Gaussians read_packed(const tinygltf::Primitive& primitive, const tinygltf::Value& extension, int view) {
        if (extension.Has("kernel")) check_kernel(extension);
        const auto position = primitive.attributes.find("POSITION");
        if (position == primitive.attributes.end() || position->second < 0 ||
            size_t(position->second) >= model_.accessors.size())
            document_.fail(where_ + ", attribute POSITION: is missing");
        const size_t count = model_.accessors[size_t(position->second)].count;
        const auto require = [&](int sh_degree) {
            require_memory(document_.name(), document_.bytes(), uint64_t(scene_.gaussians.size()) + count,
                           sh_degree, kPackedExpansion);
        };
        require(scene_.gaussians.sh_degree);
        SplatScene packed = unpacked(view);
        if (packed.gaussians.size() != count)
            document_.fail(where_ + ": the SPZ has " + std::to_string(packed.gaussians.size()) +
                           " splats, and POSITION has " + std::to_string(count));
        // All splats of the scene get the highest degree.
        require(std::max(packed.gaussians.sh_degree, scene_.gaussians.sh_degree));
        for (const std::string& text : packed.remarks) remark(text);
        scene_.antialiased = scene_.antialiased || packed.antialiased;
        scene_.file_sh_degree = std::max(scene_.file_sh_degree, packed.file_sh_degree);
        // read_spz has turned the values into a PLY's frame.
        const bool plain = extension.Has("kernel") || extension.Has("colorSpace");
        turn_[1][1] = -1;
        turn_[plain ? 0 : 2][plain ? 0 : 2] = -1;
        if (extension.Has("colorSpace") && is_linear(extension))
            remark(linear_colors_to_srgb(packed.gaussians));
        return std::move(packed.gaussians);
    }

    void check_kernel(const tinygltf::Value& extension) const {
        const std::string kernel = text(extension, "kernel", "ellipse");
        if (kernel != "ellipse")
            document_.fail(where_ + ": \"kernel\" is \"" + kernel + "\"; only \"ellipse\" is supported");
    }

    /// Earlier drafts have other names for the spaces, and sRGB where none is named.
    bool is_linear(const tinygltf::Value& extension) const {
        const std::string space = text(extension, "colorSpace", "srgb_rec709_display");
        const bool linear = space == "lin_rec709_display" || space == "BT.709-linear";
        if (!linear && space != "srgb_rec709_display" && space != "BT.709-sRGB")
            document_.fail(where_ + ": \"colorSpace\" \"" + space + "\" is not supported");
        return linear;
    }

    std::string text(const tinygltf::Value& extension, const char* property, const char* otherwise) const {
        if (!extension.IsObject() || !extension.Has(property)) return otherwise;
        if (!extension.Get(property).IsString())
            document_.fail(where_ + ": \"" + property + "\" of the extension " + kSplatExtension +
                           " is not a text");
        return extension.Get(property).Get<std::string>();
    }

    /// An attribute of kSplatPrefix, or what an earlier draft calls it where only that is there.
    static std::string named(const tinygltf::Primitive& primitive, const std::string& name) {
        if (!name.starts_with(kSplatPrefix)) return name;
        std::string earlier = "_";
        earlier += std::string_view(name).substr(kSplatPrefix.size());
        return !primitive.attributes.contains(name) && primitive.attributes.contains(earlier) ? earlier
                                                                                              : name;
    }

    static bool has(const tinygltf::Primitive& primitive, const std::string& name) {
        return primitive.attributes.contains(named(primitive, name));
    }

    /// Whether COLOR_0 stands for the attribute, as in earlier drafts. Now it is a hint for programs that draw points.
    static bool is_in_color(const tinygltf::Primitive& primitive, const std::string& name) {
        const bool draft = primitive.attributes.contains("_SCALE") ||
                           (!has(primitive, kSplatPrefix + "OPACITY") && !has(primitive, sh_name(0, 0)));
        return draft && has(primitive, "COLOR_0") && !has(primitive, name);
    }

    const tinygltf::Accessor& attribute(const tinygltf::Primitive& primitive, const std::string& name,
                                        int type) const {
        const auto* accessor = document_.attribute(primitive, named(primitive, name), {type}, count_, where_);
        if (!accessor) document_.fail(where_ + ", attribute " + name + ": is missing");
        return *accessor;
    }

    void require_fractions(const tinygltf::Accessor& accessor, const std::string& name) const {
        if (accessor.componentType != TINYGLTF_COMPONENT_TYPE_FLOAT && !accessor.normalized)
            document_.fail(where_ + ", attribute " + name + ": integers must be \"normalized\"");
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
            for (int k = 0; k < 2 * d + 1; ++k) present += int(has(primitive, sh_name(d, k)));
            if (present == 0) continue;
            if (present < 2 * d + 1 || degree != d - 1)
                document_.fail(where_ + ": of SH degree " + std::to_string(degree == d - 1 ? d : d - 1) +
                               " there are attributes missing");
            degree = d;
        }
        if (has(primitive, sh_name(kMaxShDegree + 1, 0))) {
            scene_.file_sh_degree = kMaxShDegree + 1;
            remark("SH degrees above 3 are skipped");
        }
        return degree;
    }

    /// Standard deviations, or their logarithms as in drafts of 2026, most of which are below 0.
    void read_scales(const tinygltf::Accessor& scale, Gaussians& g) {
        size_t negative = 0;
        read_values(scale, "SCALE", [&](size_t i, const double* v) {
            for (size_t k = 0; k < 3; ++k) {
                g.log_scales[3 * i + k] = log_of_scale(v[k]);
                negative += v[k] < 0;
            }
        });
        constexpr size_t kFew = 10;  // a share that no file of standard deviations has
        if (negative * kFew < g.log_scales.size() || negative == 0) return;
        read_values(scale, "SCALE", [&](size_t i, const double* v) {
            for (size_t k = 0; k < 3; ++k) g.log_scales[3 * i + k] = float(v[k]);
        });
        remark("scales below 0 are logarithms, as in a draft of the extension");
    }

    void read_color(const tinygltf::Primitive& primitive, Gaussians& g) const {
        const auto* color = document_.attribute(primitive, "COLOR_0",
                                                {TINYGLTF_TYPE_VEC3, TINYGLTF_TYPE_VEC4}, count_, where_);
        require_fractions(*color, "COLOR_0");
        read_values(*color, "COLOR_0", [&](size_t i, const double* v) {
            for (size_t k = 0; k < 3; ++k) g.sh[g.sh_stride() * i + k] = float(sh0_of_color(v[k]));
        });
    }

    void read_sh(const tinygltf::Primitive& primitive, Gaussians& g) const {
        const bool in_color = is_in_color(primitive, sh_name(0, 0));
        if (in_color) read_color(primitive, g);
        size_t first = in_color ? 3 : 0;
        for (int degree = in_color ? 1 : 0; degree <= g.sh_degree; ++degree)
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
    std::string where_;                   // the primitive being read, for errors
    glm::dmat4 turn_{1.0};                // from its values to the node's frame
    size_t count_ = 0;                    // its splats
    uint64_t clamped_ = 0;                // opacities
    int primitives_ = 0;                  // read so far
    std::map<int, int> placements_;       // of an SPZ by its buffer view, still to come
    std::map<int, SplatScene> unpacked_;  // by buffer view
};

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

}  // namespace ewa::io
