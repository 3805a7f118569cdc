// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <glm/mat4x4.hpp>
#include <optional>

#include "core/text.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "io/gltf/gltf_document.h"
#include "io/gltf/gltf_nodes.h"
#include "io/splats/gltf_splats.h"
#include "io/splats/splat_scene.h"
#include "io/splats/splat_values.h"

namespace ewa::io {

namespace {

const std::string kExtension = "KHR_gaussian_splatting";
const std::string kPrefix = kExtension + ":";
constexpr double kLeastOpacity = 1e-30, kMostOpacity = 1 - 0x1p-25;  // half a step below 1 in float32
constexpr int kMostPlaced = 4096;                                    // each reads its attributes anew

std::string sh_name(int degree, int coefficient) {
    return kPrefix + "SH_DEGREE_" + std::to_string(degree) + "_COEF_" + std::to_string(coefficient);
}

/// sRGB's curve (IEC 61966-2-1), odd below zero, and its slope.
double srgb_of_linear(double v) {
    const double a = std::abs(v);
    const double encoded = a <= 0.0031308 ? 12.92 * a : 1.055 * std::pow(a, 1 / 2.4) - 0.055;
    return std::copysign(encoded, v);
}
double srgb_slope(double v) {
    const double a = std::abs(v);
    return a <= 0.0031308 ? 12.92 : 1.055 / 2.4 * std::pow(a, 1 / 2.4 - 1);
}

double opacity_logit(int component_type, double opacity) {
    switch (component_type) {
        case TINYGLTF_COMPONENT_TYPE_BYTE:
            return logit_of_steps(opacity, 127);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            return logit_of_steps(opacity, 255);
        case TINYGLTF_COMPONENT_TYPE_SHORT:
            return logit_of_steps(opacity, 32767);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            return logit_of_steps(opacity, 65535);
        default:
            return logit(opacity, kLeastOpacity, kMostOpacity);
    }
}

class SplatReader {
  public:
    explicit SplatReader(const GltfDocument& document) : document_(document), model_(document.model()) {}

    SplatScene read() {
        // glTF's world, LUF, to PLY's: half a turn round z.
        glm::dmat4 to_ply(1.0);
        to_ply[0][0] = to_ply[1][1] = -1;
        visit_nodes(document_, to_ply, [&](int index, const glm::dmat4& matrix) {
            const int mesh = model_.nodes[size_t(index)].mesh;
            if (mesh >= 0) add_mesh(mesh, matrix, "node " + std::to_string(index));
        });
        if (primitives_ == 0)
            document_.fail("the scene's nodes reach no primitive with the extension " + kExtension +
                           "; a mesh scene is photographed by ewa train and ewa dataset");
        scene_.file_sh_degree = std::max(scene_.file_sh_degree, scene_.gaussians.sh_degree);
        scene_.format = document_.binary() ? SplatFormat::glb : SplatFormat::gltf;
        scene_.variant = std::to_string(primitives_) + (primitives_ == 1 ? " primitive" : " primitives");
        return std::move(scene_);
    }

  private:
    void add_mesh(int index, const glm::dmat4& matrix, const std::string& node) {
        if (size_t(index) >= model_.meshes.size())
            document_.fail(node + ": \"mesh\" " + std::to_string(index) + ": there is none of this number");
        const tinygltf::Mesh& mesh = model_.meshes[size_t(index)];
        for (size_t i = 0; i < mesh.primitives.size(); ++i) {
            const auto extension = mesh.primitives[i].extensions.find(kExtension);
            if (extension == mesh.primitives[i].extensions.end()) continue;
            if (++primitives_ > kMostPlaced)
                document_.fail(node + ": more than " + std::to_string(kMostPlaced) +
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
            document_.fail(where_ + ": \"kernel\" is \"" + kernel + "\"; only \"ellipse\" is known");
        const bool linear = space == "lin_rec709_display";
        if (!linear && space != "srgb_rec709_display")
            document_.fail(where_ + ": \"colorSpace\" \"" + space + "\" is not known");
        if (primitive.mode != TINYGLTF_MODE_POINTS) remark("a primitive's \"mode\" is not 0 (points)");

        const tinygltf::Accessor& position = attribute(primitive, "POSITION", TINYGLTF_TYPE_VEC3);
        Gaussians g;
        g.sh_degree = degree_of(primitive);
        count_ = position.count;
        require_memory(document_.name(), document_.bytes(), uint64_t(scene_.gaussians.size()) + count_,
                       std::max(g.sh_degree, scene_.gaussians.sh_degree));
        // The others are checked before memory is taken for any.
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
        if (linear) to_srgb(g);
        return g;
    }

    std::string text(const tinygltf::Value& extension, const char* property) const {
        if (!extension.IsObject() || !extension.Has(property) || !extension.Get(property).IsString())
            document_.fail(where_ + ": the extension " + kExtension + " has no \"" + property + "\"");
        return extension.Get(property).Get<std::string>();
    }

    const tinygltf::Accessor& attribute(const tinygltf::Primitive& primitive, const std::string& name,
                                        int type) const {
        const std::string what = where_ + ", attribute " + name;
        const auto found = primitive.attributes.find(name);
        if (found == primitive.attributes.end()) document_.fail(what + ": is missing");
        const tinygltf::Accessor& accessor = document_.accessor(found->second, what);
        if (accessor.type != type) document_.fail(what + ": \"type\" is not the one this attribute has");
        if (name != "POSITION" && accessor.count != count_)
            document_.fail(what + ": has " + std::to_string(accessor.count) + " elements for " +
                           std::to_string(count_) + " positions");
        return accessor;
    }

    void require_fractions(const tinygltf::Accessor& accessor, const char* name) const {
        if (accessor.componentType != TINYGLTF_COMPONENT_TYPE_FLOAT && !accessor.normalized)
            document_.fail(where_ + ", attribute " + kPrefix + name + ": integers must be \"normalized\"");
    }

    void read_values(const tinygltf::Accessor& accessor, const char* name,
                     const std::function<void(size_t, const double*)>& element) const {
        document_.read(accessor, where_ + ", attribute " + name, element);
    }

    /// All coefficients of a degree or none, and none without those below it.
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
            remark("SH degrees above 3 are left out");
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

    /// The colour without view dependence exactly; what depends on the view by the curve's slope there.
    void to_srgb(Gaussians& g) {
        remark("colours are in linear light and become sRGB values; splats that overlap blend in these" +
               std::string(g.sh_degree > 0 ? ", and view dependence is taken to first order" : ""));
        for (size_t i = 0; i < g.size(); ++i)
            for (size_t channel = 0; channel < 3; ++channel) {
                float* sh = &g.sh[g.sh_stride() * i + channel];
                const double color = color_of_sh0(sh[0]);
                sh[0] = float(sh0_of_color(srgb_of_linear(color)));
                for (size_t k = 3; k < g.sh_stride(); k += 3) sh[k] = float(sh[k] * srgb_slope(color));
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

}  // namespace

SplatScene read_gltf_splats(const std::filesystem::path& path) {
    const GltfDocument document(path);
    return SplatReader(document).read();
}

}  // namespace ewa::io
