// SPDX-License-Identifier: Apache-2.0
#include "pathtracer/packing.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>

#include "ewa/error.h"
#include "pathtracer/light_table.h"
#include "scene/color.h"

namespace ewa::pathtracer {

namespace {

uint32_t word(float value) {
    return std::bit_cast<uint32_t>(value);
}

void append(std::vector<uint32_t>& words, const glm::vec3& v, uint32_t last) {
    words.insert(words.end(), {word(v.x), word(v.y), word(v.z), last});
}

/// An edge is a difference rounded to float32, so its end may be outside the box of the corners by this
/// share.
constexpr float kRounding = 4e-7f;

FloatBox box_of(const DeviceTriangle& t) {
    FloatBox box;
    for (const glm::vec3& p : {t.corner, t.corner + t.edge1, t.corner + t.edge2}) {
        box.low = glm::min(box.low, p);
        box.high = glm::max(box.high, p);
    }
    const glm::vec3 margin = kRounding * (glm::abs(t.corner) + glm::abs(t.edge1) + glm::abs(t.edge2));
    box.low -= margin;
    box.high += margin;
    return box;
}

class Packer {
  public:
    Packer(const scene::MeshScene& scene, const std::vector<Image>& images)
        : scene_(scene), images_(images) {}

    PackedScene pack() {
        place();
        pack_triangles();
        pack_textures();
        const LightTable lights =
            light_table(scene_, packed_.origin, packed_.unit, packed_.order, emission());
        pack_materials(lights.triangle_density);
        packed_.lights = lights.words;
        packed_.light_count = lights.count;
        // A buffer needs at least one texel.
        for (std::vector<uint32_t>* words : {&packed_.textures, &packed_.lights, &packed_.texels})
            if (words->empty()) words->resize(4);
        return std::move(packed_);
    }

  private:
    void place() {
        if (scene_.triangles.empty()) throw InputError("the scene has no triangles to render");
        if (scene_.triangles.size() > scene::kMostTriangles)
            throw InputError("the scene has " + std::to_string(scene_.triangles.size()) +
                             " triangles, more than " + std::to_string(scene::kMostTriangles));
        const scene::Box box = scene::bounds_of(scene_);
        packed_.origin = box.center();
        const double radius = box.radius();
        packed_.unit = radius > 0 && std::isfinite(radius) ? std::exp2(std::floor(std::log2(radius)) - 3) : 1;
    }

    void pack_triangles() {
        std::vector<DeviceTriangle> triangles;
        std::vector<FloatBox> boxes;
        triangles.reserve(scene_.triangles.size());
        boxes.reserve(scene_.triangles.size());
        for (const scene::Triangle& t : scene_.triangles) {
            std::array<glm::vec3, 3> p;
            for (size_t k = 0; k < 3; ++k) p[k] = glm::vec3((t.corners[k] - packed_.origin) / packed_.unit);
            triangles.push_back({p[0], p[1] - p[0], p[2] - p[0]});
            boxes.push_back(box_of(triangles.back()));
        }
        Hierarchy hierarchy = build_hierarchy(boxes);
        for (const Node& node : hierarchy.nodes)
            for (size_t child = 0; child < 2; ++child) {
                append(packed_.nodes, node.boxes[child].low, node.references[child]);
                append(packed_.nodes, node.boxes[child].high, 0);
            }
        for (const uint32_t i : hierarchy.order) {
            const scene::Triangle& t = scene_.triangles[i];
            const DeviceTriangle& d = triangles[i];
            const scene::Material& material = scene_.materials[t.material];
            append(packed_.triangles, d.corner, t.material);
            append(packed_.triangles, d.edge1, 0);
            append(packed_.triangles, d.edge2, material.two_sided ? 1 : 0);
            auto& s = packed_.surfaces;
            // A surface is smooth where all three corners have a direction.
            const bool smooth = std::count(t.normals.begin(), t.normals.end(), scene::kNoNormal) == 0;
            s.insert(s.end(),
                     {smooth ? t.normals[0] : scene::kNoNormal, t.normals[1], t.normals[2], t.colors[0]});
            s.insert(s.end(), {word(t.uvs[0].x), word(t.uvs[0].y), word(t.uvs[1].x), word(t.uvs[1].y)});
            s.insert(s.end(), {word(t.uvs[2].x), word(t.uvs[2].y), t.colors[1], t.colors[2]});
            packed_.alpha_tested = packed_.alpha_tested || material.masked || material.blended;
        }
        packed_.order = std::move(hierarchy.order);
    }

    void pack_textures() {
        std::vector<uint32_t> first(images_.size());
        for (size_t i = 0; i < images_.size(); ++i) {
            const Image& image = images_[i];
            first[i] = uint32_t(packed_.texels.size());
            if (packed_.texels.size() + uint64_t(image.width) * uint64_t(image.height) > kMostTexels)
                throw InputError("the textures have more than " + std::to_string(kMostTexels) +
                                 " texels together");
            for (int y = 0; y < image.height; ++y)
                for (int x = 0; x < image.width; ++x) {
                    uint32_t rgba = 0xff000000u;
                    for (int c = 0; c < image.channels; ++c)
                        rgba = (rgba & ~(0xffu << (8 * c))) |
                               (uint32_t(std::lround(std::clamp(image.at(x, y)[c], 0.0f, 1.0f) * 255))
                                << (8 * c));
                    packed_.texels.push_back(rgba);
                }
            if (image.width == 0) packed_.texels.push_back(0xffffffffu);
        }
        for (const scene::Texture& texture : scene_.textures) {
            const auto image = size_t(texture.image);
            packed_.textures.insert(packed_.textures.end(),
                                    {first[image], uint32_t(std::max(images_[image].width, 1)),
                                     uint32_t(std::max(images_[image].height, 1)),
                                     texture.wrap_s | (texture.wrap_t << shared::TEXTURE_WRAP_T_SHIFT) |
                                         (texture.nearest ? shared::TEXTURE_NEAREST : 0u)});
        }
    }

    /// Mean radiance that each material emits, averaged over its whole texture.
    std::vector<double> emission() const {
        std::vector<double> result;
        for (const scene::Material& material : scene_.materials) {
            glm::dvec3 factor(material.emitted);
            if (material.emitted_texture >= 0 && factor != glm::dvec3(0))
                factor *=
                    mean_color(images_[size_t(scene_.textures[size_t(material.emitted_texture)].image)]);
            result.push_back((factor.r + factor.g + factor.b) / 3);
        }
        return result;
    }

    /// In linear light, and above zero, so that a texture that emits anywhere is sampled sometimes.
    static glm::dvec3 mean_color(const Image& image) {
        glm::dvec3 sum(0);
        for (int y = 0; y < image.height; ++y)
            for (int x = 0; x < image.width; ++x)
                for (int c = 0; c < 3; ++c) sum[c] += scene::linear_of_srgb(image.at(x, y)[c]);
        const double count = double(image.width) * image.height;
        return count > 0 ? glm::max(sum / count, glm::dvec3(1e-3)) : glm::dvec3(1);
    }

    void pack_materials(const std::vector<double>& triangle_density) {
        const auto texture = [](int index) { return index < 0 ? shared::NO_TEXTURE : uint32_t(index); };
        for (size_t i = 0; i < scene_.materials.size(); ++i) {
            const scene::Material& m = scene_.materials[i];
            const uint32_t flags =
                (m.two_sided ? shared::MATERIAL_TWO_SIDED : 0u) | (m.masked ? shared::MATERIAL_MASKED : 0u) |
                (m.blended ? shared::MATERIAL_BLENDED : 0u) | (m.unlit ? shared::MATERIAL_UNLIT : 0u);
            append(packed_.materials, m.base, word(m.opacity));
            packed_.materials.insert(packed_.materials.end(),
                                     {word(m.metallic), word(m.roughness), word(m.f0), word(m.f90)});
            append(packed_.materials, m.emitted, word(m.cutoff));
            packed_.materials.insert(
                packed_.materials.end(),
                {texture(m.base_texture), texture(m.metal_texture), texture(m.emitted_texture), flags});
            packed_.materials.insert(packed_.materials.end(), {word(float(triangle_density[i])), 0, 0, 0});
        }
    }

    const scene::MeshScene& scene_;
    const std::vector<Image>& images_;
    PackedScene packed_;
};

float value(uint32_t bits) {
    return std::bit_cast<float>(bits);
}

glm::vec3 vector(const uint32_t* words) {
    return {value(words[0]), value(words[1]), value(words[2])};
}

}  // namespace

PackedScene pack(const scene::MeshScene& scene, const std::vector<Image>& images) {
    return Packer(scene, images).pack();
}

std::vector<DeviceTriangle> device_triangles(const PackedScene& packed) {
    std::vector<DeviceTriangle> triangles;
    for (size_t i = 0; i < packed.triangles.size(); i += 4 * shared::TRIANGLE_TEXELS) {
        const uint32_t* words = &packed.triangles[i];
        triangles.push_back({vector(words), vector(words + 4), vector(words + 8)});
    }
    return triangles;
}

std::vector<Node> device_nodes(const PackedScene& packed) {
    std::vector<Node> nodes;
    for (size_t i = 0; i < packed.nodes.size(); i += 4 * shared::NODE_TEXELS) {
        Node node;
        for (size_t child = 0; child < 2; ++child) {
            const uint32_t* words = &packed.nodes[i + 8 * child];
            node.boxes[child] = {vector(words), vector(words + 4)};
            node.references[child] = words[3];
        }
        nodes.push_back(node);
    }
    return nodes;
}

}  // namespace ewa::pathtracer
