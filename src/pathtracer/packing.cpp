// SPDX-License-Identifier: Apache-2.0
#include "pathtracer/packing.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>
#include <numeric>

#include "ewa/error.h"
#include "scene/color.h"

namespace ewa::pathtracer {
namespace {

uint32_t word(double value) {
    return std::bit_cast<uint32_t>(float(value));
}

double mean(const glm::dvec3& v) {
    return (v.r + v.g + v.b) / 3;
}

/// An entry of the table of lights.
struct Entry {
    std::array<uint32_t, 4 * shared::LIGHT_TEXELS> words{};
    double power = 0;
};

Entry entry_of(const scene::Light& light, const glm::dvec3& origin, double unit, double scene_radius) {
    Entry entry;
    auto& w = entry.words;
    const bool directional = light.kind == shared::LIGHT_DIRECTIONAL;
    const glm::dvec3 direction = glm::normalize(light.direction);
    const glm::dvec3 place = directional ? -direction : (light.position - origin) / unit;
    // Irradiance falls with the square of the distance, which is in device units.
    const glm::dvec3 strength = directional ? light.intensity : light.intensity / (unit * unit);
    // The cone's linear ramp in the cosine, as in KHR_lights_punctual.
    const double scale = 1 / std::max(0.001, std::cos(light.inner) - std::cos(light.outer));
    for (size_t i = 0; i < 3; ++i) {
        w[i] = word(place[int(i)]);
        w[4 + i] = word(strength[int(i)]);
        w[8 + i] = word(direction[int(i)]);
    }
    w[3] = light.kind;
    w[11] = word(light.range / unit);
    w[12] = word(scale);
    w[13] = word(-std::cos(light.outer) * scale);
    const double spread = directional ? std::numbers::pi * scene_radius * scene_radius : 4 * std::numbers::pi;
    entry.power = spread * mean(strength);
    return entry;
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
        pack_materials(pack_lights());
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

    /// The table from which a path samples a light in proportion to its power: the punctual lights, then the
    /// emitting triangles by their sorted index. The power, averaged over the channels, is 4 pi times the
    /// intensity of a point light, a directional light's irradiance on the scene's disc, and pi times area and
    /// radiance of a triangle. Returns for each material the probability per area (device units) on its
    /// triangles.
    std::vector<double> pack_lights() {
        const std::vector<double> radiances = emission();
        const double unit = packed_.unit, radius = scene::bounds_of(scene_).radius() / unit;
        std::vector<Entry> entries;
        for (const scene::Light& light : scene_.lights)
            if (Entry entry = entry_of(light, packed_.origin, unit, radius); entry.power > 0)
                entries.push_back(entry);
        for (uint32_t index = 0; index < packed_.order.size(); ++index) {
            const scene::Triangle& t = scene_.triangles[packed_.order[index]];
            const double radiance = radiances[t.material];
            if (!(radiance > 0)) continue;
            const glm::dvec3 normal = glm::cross(t.corners[1] - t.corners[0], t.corners[2] - t.corners[0]);
            const double area = 0.5 * glm::length(normal) / (unit * unit);
            if (!(area > 0)) continue;
            Entry entry;
            entry.words[3] = shared::LIGHT_TRIANGLE;
            entry.words[11] = index;
            entry.power = std::numbers::pi * area * radiance;
            entries.push_back(entry);
        }
        double total = 0;
        for (const Entry& entry : entries) total += entry.power;
        std::vector<double> probabilities, triangle_density(scene_.materials.size());
        if (total > 0)
            for (size_t i = 0; i < radiances.size(); ++i)
                triangle_density[i] = std::numbers::pi * radiances[i] / total;
        for (const Entry& entry : entries) probabilities.push_back(entry.power / total);
        const AliasTable alias = alias_table(probabilities);
        for (size_t i = 0; i < entries.size(); ++i) {
            auto& w = entries[i].words;
            w[7] = word(probabilities[i]);
            w[14] = word(alias.threshold[i]);
            w[15] = alias.alias[i];
            packed_.lights.insert(packed_.lights.end(), w.begin(), w.end());
        }
        packed_.light_count = uint32_t(entries.size());
        return triangle_density;
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
            packed_.materials.insert(packed_.materials.end(), {word(triangle_density[i]), 0, 0, 0});
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

AliasTable alias_table(const std::vector<double>& probabilities) {
    const size_t n = probabilities.size();
    AliasTable table{std::vector<double>(n, 1.0), std::vector<uint32_t>(n)};
    std::iota(table.alias.begin(), table.alias.end(), 0u);
    std::vector<double> shares(n);
    std::vector<uint32_t> small, large;
    for (size_t i = 0; i < n; ++i) {
        shares[i] = probabilities[i] * double(n);
        (shares[i] < 1 ? small : large).push_back(uint32_t(i));
    }
    while (!small.empty() && !large.empty()) {
        const uint32_t poor = small.back(), rich = large.back();
        small.pop_back();
        table.threshold[poor] = shares[poor];
        table.alias[poor] = rich;
        shares[rich] -= 1 - shares[poor];
        if (shares[rich] < 1) {
            large.pop_back();
            small.push_back(rich);
        }
    }
    return table;
}

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
