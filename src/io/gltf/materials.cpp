// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <map>
#include <numbers>

#include "ewa/error.h"
#include "io/gltf/document.h"
#include "io/gltf/mesh.h"

namespace ewa::io {

namespace {

constexpr size_t kMostMaterials = 65536;
constexpr uint64_t kMostTotalBytes = uint64_t(512) << 20;  // of all images together

double finite(const GltfDocument& document, double value, double low, double high, const std::string& what) {
    if (!(value >= low && value <= high))
        document.fail(what + " is " + std::to_string(value) + ", which is out of range");
    return value;
}

glm::dvec3 color(const GltfDocument& document, const std::vector<double>& values, double high,
                 const std::string& what) {
    if (values.size() < 3) document.fail(what + " needs 3 numbers");
    glm::dvec3 result;
    for (int i = 0; i < 3; ++i) result[i] = finite(document, values[size_t(i)], 0, high, what);
    return result;
}

const tinygltf::Value* extension(const tinygltf::ExtensionMap& extensions, const char* name) {
    const auto found = extensions.find(name);
    return found == extensions.end() ? nullptr : &found->second;
}

double number(const tinygltf::Value* object, const char* key, double otherwise) {
    if (!object || !object->IsObject() || !object->Has(key) || !object->Get(key).IsNumber()) return otherwise;
    return object->Get(key).GetNumberAsDouble();
}

uint32_t wrap_of(int mode) {
    return mode == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE     ? shared::WRAP_CLAMP
           : mode == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? shared::WRAP_MIRROR
                                                           : shared::WRAP_REPEAT;
}

class MaterialReader {
  public:
    MaterialReader(const GltfDocument& document, scene::MeshScene& scene)
        : document_(document), scene_(scene) {}

    void read(std::vector<int>& texture_sets) {
        const auto& materials = document_.model().materials;
        if (materials.size() > kMostMaterials)
            document_.fail("has " + std::to_string(materials.size()) + " \"materials\", more than " +
                           std::to_string(kMostMaterials));
        for (size_t i = 0; i < materials.size(); ++i) {
            where_ = "material " + std::to_string(i);
            set_ = -1;
            scene_.materials.push_back(material(materials[i]));
            texture_sets.push_back(std::max(set_, 0));
        }
        scene_.materials.emplace_back();
        texture_sets.push_back(0);
    }

  private:
    /// A number of the material from 0 to `high`.
    double checked(double value, double high, const std::string& name) const {
        return finite(document_, value, 0, high, where_ + ": \"" + name + "\"");
    }
    float factor(double value, double high, const std::string& name) const {
        return float(checked(value, high, name));
    }

    scene::Material material(const tinygltf::Material& source) {
        const auto& pbr = source.pbrMetallicRoughness;
        scene::Material m;
        const std::string base = where_ + ": \"baseColorFactor\"";
        m.base = color(document_, pbr.baseColorFactor, 1e6, base);
        if (pbr.baseColorFactor.size() > 3) m.opacity = factor(pbr.baseColorFactor[3], 1, "baseColorFactor");
        m.metallic = factor(pbr.metallicFactor, 1, "metallicFactor");
        m.roughness = factor(pbr.roughnessFactor, 1, "roughnessFactor");
        m.emitted = color(document_, source.emissiveFactor, 1e6, where_ + ": \"emissiveFactor\"");
        m.two_sided = source.doubleSided;
        m.masked = source.alphaMode == "MASK";
        m.blended = source.alphaMode == "BLEND";
        m.cutoff = factor(source.alphaCutoff, 1e6, "alphaCutoff");
        m.base_texture = texture(pbr.baseColorTexture);
        m.metal_texture = texture(pbr.metallicRoughnessTexture);
        m.emitted_texture = texture(source.emissiveTexture);
        if (source.normalTexture.index >= 0) remark(scene_, "normal textures are skipped");
        if (source.occlusionTexture.index >= 0)
            remark(scene_, "occlusion textures are skipped: the path tracer computes occlusion");
        extend(source, m);
        return m;
    }

    void extend(const tinygltf::Material& source, scene::Material& m) {
        const auto* emission = extension(source.extensions, "KHR_materials_emissive_strength");
        const auto* refraction = extension(source.extensions, "KHR_materials_ior");
        const auto* fine = extension(source.extensions, "KHR_materials_specular");
        m.emitted *= factor(number(emission, "emissiveStrength", 1), 1e9, "emissiveStrength");
        const double ior = checked(number(refraction, "ior", 1.5), 1e6, "ior");
        const double specular = checked(number(fine, "specularFactor", 1), 1, "specularFactor");
        const double edge = ior > 0 ? (ior - 1) / (ior + 1) : 1;  // 0 means an infinite index of refraction
        m.f0 = float(edge * edge * specular);
        m.f90 = float(specular);
        if (extension(source.extensions, "KHR_materials_unlit")) {
            m.unlit = true;
            m.emitted = m.base;
            m.emitted_texture = m.base_texture;
            m.base = glm::vec3(0);
            m.metallic = m.f0 = m.f90 = 0;
        }
        if (fine)
            for (const char* key : {"specularTexture", "specularColorTexture", "specularColorFactor"})
                if (fine->IsObject() && fine->Has(key))
                    remark(scene_, std::string("KHR_materials_specular: ") + key + " is skipped");
    }

    template <class Info>
    int texture(const Info& info) {
        if (info.index < 0) return -1;
        if (info.index >= int(document_.model().textures.size()))
            document_.fail(where_ + ": texture " + std::to_string(info.index) +
                           ": there is none of this \"index\"");
        if (info.texCoord < 0 || (set_ >= 0 && set_ != info.texCoord))
            document_.fail(where_ + ": its textures use different \"texCoord\" sets, which is not supported");
        set_ = info.texCoord;
        if (extension(info.extensions, "KHR_texture_transform"))
            remark(scene_, "KHR_texture_transform is skipped");
        const auto [place, fresh] = textures_.try_emplace(info.index, int(scene_.textures.size()));
        if (fresh) add_texture(document_.model().textures[size_t(info.index)], info.index);
        return place->second;
    }

    void add_texture(const tinygltf::Texture& source, int index) {
        const std::string what = "texture " + std::to_string(index);
        if (source.source < 0 || size_t(source.source) >= document_.images())
            document_.fail(what + ": \"source\" is missing or there is no image of this number");
        scene::Texture texture;
        if (source.sampler >= 0) {
            if (size_t(source.sampler) >= document_.model().samplers.size())
                document_.fail(what + ": \"sampler\": there is none of this number");
            const tinygltf::Sampler& sampler = document_.model().samplers[size_t(source.sampler)];
            texture.wrap_s = wrap_of(sampler.wrapS);
            texture.wrap_t = wrap_of(sampler.wrapT);
            texture.nearest = sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST;
        }
        const auto [place, fresh] = images_.try_emplace(source.source, int(scene_.images.size()));
        if (fresh) {
            scene::EncodedImage image{document_.name() + ": image " + std::to_string(source.source),
                                      document_.image_bytes(size_t(source.source))};
            image_bytes_ += image.bytes.size();
            if (image_bytes_ > kMostTotalBytes)
                document_.fail(what + ": the images claim more than " + std::to_string(kMostTotalBytes) +
                               " bytes together");
            scene_.images.push_back(std::move(image));
        }
        texture.image = place->second;
        scene_.textures.push_back(texture);
    }

    const GltfDocument& document_;
    scene::MeshScene& scene_;
    std::string where_;
    int set_ = -1;
    uint64_t image_bytes_ = 0;
    std::map<int, int> textures_, images_;  // index in the file to index in the scene
};

/// The columns of the matrix, normalised. Throws if the node flattens an axis.
glm::dmat3 axes_of(const GltfDocument& document, const glm::dmat4& matrix, const std::string& what) {
    glm::dmat3 axes;
    for (int i = 0; i < 3; ++i) {
        const glm::dvec3 column(matrix[i]);
        const double length = glm::length(column);
        if (!(length > 0) || !std::isfinite(length))
            document.fail(what + ": its \"scale\" is zero or not finite");
        axes[i] = column / length;
    }
    return axes;
}

glm::dvec3 place_of(const GltfDocument& document, const glm::dmat4& matrix, const std::string& what) {
    const glm::dvec3 place(matrix[3]);
    for (int i = 0; i < 3; ++i)
        if (!std::isfinite(float(place[i]))) document.fail(what + ": its \"translation\" is not finite");
    return place;
}

}  // namespace

void remark(scene::MeshScene& scene, const std::string& text) {
    if (std::find(scene.remarks.begin(), scene.remarks.end(), text) == scene.remarks.end())
        scene.remarks.push_back(text);
}

void read_materials(const GltfDocument& document, scene::MeshScene& scene, std::vector<int>& texture_sets) {
    MaterialReader(document, scene).read(texture_sets);
}

void add_camera(const GltfDocument& document, int node, const glm::dmat4& matrix, scene::MeshScene& scene) {
    const int index = document.model().nodes[size_t(node)].camera;
    const std::string what = "node " + std::to_string(node) + ", camera " + std::to_string(index);
    if (index < 0 || size_t(index) >= document.model().cameras.size())
        document.fail(what + ": there is none of this number");
    const tinygltf::Camera& source = document.model().cameras[size_t(index)];
    if (source.type != "perspective") return remark(scene, "cameras that are not perspective are skipped");
    scene::FileCamera camera;
    camera.name = document.model().nodes[size_t(node)].name;
    camera.vertical_angle = source.perspective.yfov;
    if (!(camera.vertical_angle > 0 && camera.vertical_angle < std::numbers::pi))
        document.fail(what + ": \"yfov\" is not an angle between 0 and pi (radians)");
    camera.axes = axes_of(document, matrix, what);
    for (int i = 0; i < 3; ++i)
        if (std::abs(glm::dot(camera.axes[i], camera.axes[(i + 1) % 3])) > 1e-4 ||
            !(glm::determinant(camera.axes) > 0))
            document.fail(what + ": its axes are sheared or mirrored by a \"scale\" or \"matrix\"");
    camera.position = place_of(document, matrix, what);
    scene.cameras.push_back(std::move(camera));
}

void add_light(const GltfDocument& document, int node, const glm::dmat4& matrix, scene::MeshScene& scene) {
    const tinygltf::Value* reference =
        extension(document.model().nodes[size_t(node)].extensions, "KHR_lights_punctual");
    if (!reference) return;
    const std::string what = "node " + std::to_string(node) + ": KHR_lights_punctual";
    const tinygltf::Light& source =
        document.model().lights.at(size_t(reference->Get("light").GetNumberAsInt()));
    scene::Light light;
    if (source.type == "directional")
        light.kind = shared::LIGHT_DIRECTIONAL;
    else if (source.type == "spot")
        light.kind = shared::LIGHT_SPOT;
    else if (source.type != "point")
        document.fail(what + ": the \"type\" is not supported");
    light.intensity = glm::dvec3(finite(document, source.intensity, 0, 1e12, what + ": \"intensity\""));
    if (!source.color.empty()) light.intensity *= color(document, source.color, 1e6, what + ": \"color\"");
    light.range = finite(document, source.range, 0, 1e30, what + ": \"range\"");
    if (light.kind == shared::LIGHT_SPOT) {
        light.outer = finite(document, source.spot.outerConeAngle, 0, std::numbers::pi / 2,
                             what + ": \"outerConeAngle\"");
        light.inner =
            finite(document, source.spot.innerConeAngle, 0, light.outer, what + ": \"innerConeAngle\"");
    }
    light.position = place_of(document, matrix, what);
    light.direction = -axes_of(document, matrix, what)[2];
    scene.lights.push_back(light);
}

scene::Sky read_sky(const GltfDocument& document) {
    scene::Sky sky;
    const tinygltf::Model& model = document.model();
    const tinygltf::Value& extras = model.scenes[size_t(std::max(model.defaultScene, 0))].extras;
    if (!extras.IsObject() || !extras.Has("sky")) return sky;
    const std::string what = "the scene's \"sky\"";
    const tinygltf::Value& given = extras.Get("sky");
    if (!given.IsObject()) document.fail(what + " is not an object");
    const std::pair<const char*, glm::vec3*> parts[] = {
        {"zenith", &sky.zenith}, {"horizon", &sky.horizon}, {"ground", &sky.ground}};
    for (const auto& [key, target] : parts) {
        if (!given.Has(key)) continue;
        const tinygltf::Value& list = given.Get(key);
        std::vector<double> values;
        if (list.IsArray())
            for (size_t i = 0; i < list.ArrayLen(); ++i)
                values.push_back(list.Get(int(i)).IsNumber() ? list.Get(int(i)).GetNumberAsDouble() : -1);
        *target = color(document, values, 1e6, what + ": \"" + key + "\"");
    }
    return sky;
}

}  // namespace ewa::io
