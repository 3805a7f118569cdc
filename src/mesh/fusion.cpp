// SPDX-License-Identifier: Apache-2.0
#include "mesh/fusion.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <vector>

#include "core/messages.h"
#include "core/parallel.h"
#include "ewa/error.h"
#include "mesh/meshing.h"
#include "mesh/middle.h"
#include "mesh/parts.h"
#include "scene/depth_map.h"

namespace ewa::mesh {
namespace {

using Corners = std::array<uint32_t, 3>;

constexpr uint64_t kAxisBits = 21;
/// A block's values and counts, and what OpenVDB adds.
constexpr uint64_t kBlockBytes = kBlockVoxels * (sizeof(float) + sizeof(uint16_t)) + 128;

uint64_t key_of(const glm::ivec3& place) {
    uint64_t key = 0;
    for (int k = 0; k < 3; ++k) key = key << kAxisBits | uint64_t(place[k] + kMostBlocks);
    return key;
}

glm::ivec3 place_of(uint64_t key) {
    constexpr uint64_t mask = (uint64_t(1) << kAxisBits) - 1;
    return glm::ivec3(int(key >> (2 * kAxisBits)), int(key >> kAxisBits & mask), int(key & mask)) -
           kMostBlocks;
}

void sort_unique(std::vector<uint64_t>& keys) {
    std::ranges::sort(keys);
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
}

/// Where the volume lies in the world.
struct Lattice {
    Space space;
    double voxel = 1;
    double truncation() const { return kTruncation * voxel; }
    bool contracts() const { return std::isfinite(space.radius); }
    glm::dvec3 index(const glm::dvec3& world) const { return space.contracted(world) / voxel; }
    /// How far from the middle a point of contracted space may be. Beyond, less than a voxel is left of the world.
    double limit() const { return 2 * space.radius - voxel; }
};

[[noreturn]] void fail_too_fine(double voxel, const std::string& why) {
    throw InputError(
        fmt::format("voxels of {:.3g} are too small: {}; --voxel sets another size", voxel, why));
}

void add_place(std::vector<uint64_t>& keys, const glm::dvec3& index, double voxel) {
    glm::ivec3 place(0);
    for (int k = 0; k < 3; ++k) {
        const double at = std::floor(index[k] / kBlockSide);
        if (!(std::abs(at) < kMostBlocks)) fail_too_fine(voxel, "the surfaces are millions of voxels apart");
        place[k] = int(at);
    }
    const uint64_t key = key_of(place);
    if (keys.empty() || keys.back() != key) keys.push_back(key);
}

glm::dvec3 ray_of(const Camera& camera, int x, int y) {
    return {(x + 0.5 - camera.cx) / camera.fx, (y + 0.5 - camera.cy) / camera.fy, 1};
}

/// The depth without pixels that are too coarse. finest: the side of a voxel in the middle that is taken as such.
Image fine_depth(const Camera& camera, const Image& depth, const Lattice& lattice, double finest) {
    Image fine = depth;
    const double limit = kCoarsestPixel * finest * focal(camera);
    const glm::dmat3 to_world = glm::transpose(camera.rotation);
    core::on_all_cores(size_t(depth.height), [&](size_t y) {
        for (int x = 0; x < depth.width; ++x) {
            float& z = *fine.at(x, int(y));
            double most = limit;
            if (lattice.contracts() && z > 0)
                most *= lattice.space.growth(to_world *
                                             (double(z) * ray_of(camera, x, int(y)) - camera.translation));
            if (!(z > 0 && double(z) <= most)) z = 0;
        }
    });
    return fine;
}

/// About how many blocks a view needs: those that its pixels cover, times two in depth.
double blocks_of_view(const Camera& camera, const Image& depth, const Lattice& lattice) {
    const double per_depth = 1 / (focal(camera) * lattice.voxel * kBlockSide);
    const glm::dmat3 to_world = glm::transpose(camera.rotation);
    double blocks = 0;
    for (int y = 0; y < depth.height; ++y)
        for (int x = 0; x < depth.width; ++x) {
            const double z = double(*depth.at(x, y));
            if (!(z > 0)) continue;
            double side = z * per_depth;
            if (lattice.contracts())
                side /= lattice.space.growth(to_world * (z * ray_of(camera, x, y) - camera.translation));
            blocks += 2 * std::min(1.0, side * side);
        }
    return blocks;
}

/// The blocks within the truncation of what a row of pixels shows, along its rays.
std::vector<uint64_t> blocks_of_row(const Camera& camera, const Image& depth, int y, const Lattice& lattice) {
    std::vector<uint64_t> keys;
    const glm::dmat3 to_world = glm::transpose(camera.rotation);
    const glm::dvec3 eye = camera.position();
    for (int x = 0; x < depth.width; ++x) {
        const double z = double(*depth.at(x, y));
        if (!(z > 0)) continue;
        const glm::dvec3 ray = to_world * ray_of(camera, x, y), point = eye + z * ray;
        // Points closer to each other than two voxels meet the same blocks.
        const double side = lattice.voxel * lattice.space.growth(point);
        const int step = int(std::clamp(2 * side * focal(camera) / z, 1.0, 8.0));
        if (x % step != 0 || y % step != 0) continue;
        const glm::dvec3 at = lattice.index(point);
        glm::dvec3 along = ray;  // what the ray becomes; a voxel of view z is one along it
        if (lattice.contracts()) {
            along = glm::length(ray) * glm::normalize(lattice.space.contracted_direction(point, ray));
            constexpr double kRoom = 2;  // voxels beyond the truncation
            if (glm::length(at + kTruncation * along) + kRoom > lattice.limit() / lattice.voxel) continue;
        }
        for (double s = -kTruncation; s <= kTruncation; s += 2)
            for (int corner = 0; corner < 8; ++corner) {
                constexpr double kReach = 1.5;
                const glm::dvec3 to(corner & 1 ? kReach : -kReach, corner & 2 ? kReach : -kReach,
                                    corner & 4 ? kReach : -kReach);
                add_place(keys, at + s * along + to, lattice.voxel);
            }
    }
    sort_unique(keys);
    return keys;
}

class Fusion {
  public:
    Fusion(std::span<const Camera> cameras, const DepthOfView& depth, const Lattice& lattice, double usual,
           const FusionOptions& options, const std::function<void(size_t)>& done)
        : cameras_(cameras),
          depth_(depth),
          lattice_(lattice),
          finest_(std::max(lattice.voxel, usual)),
          options_(options),
          done_(done),
          volume_(meshing().make_volume()) {}

    Fused run() {
        find_blocks();
        for (size_t i = 0; i < cameras_.size(); ++i) {
            add_view(cameras_[i], fine_depth(cameras_[i], depth_(i), lattice_, finest_));
            if (done_) done_(cameras_.size() + i + 1);
        }
        finish_values();
        Fused out;
        out.mesh = mesh_of(volume_->surface());
        out.voxel = lattice_.voxel;
        out.space = lattice_.space;
        out.blocks = blocks_.size();
        return out;
    }

  private:
    void check_room(double blocks) const {
        const double bytes = blocks * double(kBlockBytes);
        if (options_.most_bytes > 0 && bytes > double(options_.most_bytes))
            fail_too_fine(lattice_.voxel, fmt::format("the volume would take {} or more, of at most {}",
                                                      core::bytes_text(uint64_t(std::min(bytes, 1e18))),
                                                      core::bytes_text(options_.most_bytes)));
    }

    void find_blocks() {
        for (size_t i = 0; i < cameras_.size(); ++i) {
            const Image depth = fine_depth(cameras_[i], depth_(i), lattice_, finest_);
            // Before its blocks take memory, too.
            check_room(blocks_of_view(cameras_[i], depth, lattice_));
            std::vector<std::vector<uint64_t>> rows(size_t(depth.height));
            core::on_all_cores(rows.size(), [&](size_t y) {
                rows[y] = blocks_of_row(cameras_[i], depth, int(y), lattice_);
            });
            std::vector<uint64_t> seen;
            for (const auto& row : rows) seen.insert(seen.end(), row.begin(), row.end());
            sort_unique(seen);
            std::vector<uint64_t> all;
            std::ranges::set_union(keys_, seen, std::back_inserter(all));
            keys_ = std::move(all);
            check_room(double(keys_.size()));
            if (done_) done_(i + 1);
        }
        std::vector<glm::ivec3> places;
        places.reserve(keys_.size());
        for (const uint64_t key : keys_) places.push_back(place_of(key));
        volume_->add(places);
        blocks_ = volume_->blocks();
        // The volume has its own order.
        std::vector<std::pair<uint64_t, uint32_t>> order;
        for (size_t b = 0; b < blocks_.size(); ++b)
            order.emplace_back(key_of(blocks_[b].corner / kBlockSide), uint32_t(b));
        std::ranges::sort(order);
        for (const auto& [key, b] : order) block_of_.push_back(b);
        counts_.assign(blocks_.size() * kBlockVoxels, 0);
    }

    void add_view(const Camera& camera, const Image& depth) {
        constexpr size_t kTogether = 64;
        core::on_all_cores((blocks_.size() + kTogether - 1) / kTogether, [&](size_t group) {
            const size_t end = std::min(blocks_.size(), (group + 1) * kTogether);
            for (size_t b = group * kTogether; b < end; ++b)
                if (contracted(blocks_[b]))
                    add_view_to_contracted(b, camera, depth);
                else
                    add_view_to(b, camera, depth);
        });
    }

    bool contracted(const Block& block) const {
        if (!lattice_.contracts()) return false;
        const glm::dvec3 corner(block.corner),
            far = glm::max(glm::abs(corner), glm::abs(corner + double(kBlockSide)));
        return lattice_.voxel * glm::length(far) > lattice_.space.radius;
    }

    void add_view_to(size_t b, const Camera& camera, const Image& depth) {
        const glm::dvec3 corner =
            camera.rotation * (lattice_.space.middle + lattice_.voxel * glm::dvec3(blocks_[b].corner)) +
            camera.translation;
        const glm::dmat3 steps = lattice_.voxel * camera.rotation;
        const glm::dvec3 middle = corner + steps * glm::dvec3(0.5 * (kBlockSide - 1));
        const double radius = 0.5 * std::sqrt(3.0) * kBlockSide * lattice_.voxel;
        if (middle.z <= radius) return;
        const glm::dvec2 at = pixel_of(camera, middle);
        const double reach = 1 + 2 * focal(camera) * radius / (middle.z - radius);
        if (at.x < -reach || at.y < -reach || at.x > depth.width + reach || at.y > depth.height + reach)
            return;
        const glm::vec3 base(corner);
        const glm::mat3 step(steps);
        const float truncation = float(lattice_.truncation());
        for (int v = 0; v < int(kBlockVoxels); ++v) {
            const glm::vec3 p = base + step * glm::vec3(place_in_block(v));
            if (!(p.z > 0)) continue;
            const float d = depth_at(depth, pixel_of(camera, p), truncation);
            if (!(d > 0) || p.z - d > truncation) continue;
            add_value(b, v, std::min(1.0f, (d - p.z) / truncation));
        }
    }

    /// The voxels of such a block are no cubes in the world. Distances are those in contracted space, in the unit of view z.
    void add_view_to_contracted(size_t b, const Camera& camera, const Image& depth) {
        if (!in_view(blocks_[b], camera, depth)) return;
        const Space& space = lattice_.space;
        const glm::dvec3 eye = camera.position(), shift = camera.rotation * space.middle + camera.translation;
        for (int v = 0; v < int(kBlockVoxels); ++v) {
            const glm::dvec3 at = lattice_.voxel * glm::dvec3(blocks_[b].corner + place_in_block(v));
            if (!(glm::length(at) < lattice_.limit())) continue;
            const glm::dvec3 from_middle = space.expanded(at), p = camera.rotation * from_middle + shift;
            if (!(p.z > 0)) continue;
            const glm::dvec3 world = space.middle + from_middle;
            const double d = double(depth_at(depth, glm::vec2(pixel_of(camera, p)),
                                             float(lattice_.truncation() * space.growth(world))));
            if (!(d > 0)) continue;
            const glm::dvec3 seen = space.contracted(eye + d / p.z * (world - eye));
            const double distance = glm::length(seen - at) * p.z / glm::length(p) / lattice_.truncation();
            if (p.z > d && distance > 1) continue;
            add_value(b, v, float(std::min(1.0, p.z > d ? -distance : distance)));
        }
    }

    /// Whether the view may show a part of a contracted block. It lies about between its corners.
    bool in_view(const Block& block, const Camera& camera, const Image& depth) const {
        glm::dvec2 low(1e300), high(-1e300);
        int behind = 0;
        for (int c = 0; c < 8; ++c) {
            glm::dvec3 at = lattice_.voxel *
                            glm::dvec3(block.corner + kBlockSide * glm::ivec3(c & 1, c >> 1 & 1, c >> 2));
            at *= std::min(1.0, lattice_.limit() / glm::length(at));
            const glm::dvec3 p =
                camera.rotation * (lattice_.space.middle + lattice_.space.expanded(at)) + camera.translation;
            behind += !(p.z > 0);
            const glm::dvec2 pixel = pixel_of(camera, p);
            low = glm::min(low, pixel);
            high = glm::max(high, pixel);
        }
        if (behind > 0) return behind < 8;
        const glm::dvec2 reach = 1.0 + 0.25 * (high - low);
        return low.x - reach.x < depth.width && low.y - reach.y < depth.height && high.x + reach.x > 0 &&
               high.y + reach.y > 0;
    }

    static glm::ivec3 place_in_block(int v) { return {v >> 6, v >> 3 & 7, v & 7}; }

    void add_value(size_t b, int v, float value) {
        uint16_t& count = counts_[b * kBlockVoxels + size_t(v)];
        if (count == UINT16_MAX) return;
        blocks_[b].values[v] += value;
        ++count;
    }

    void finish_values() {
        core::on_all_cores(blocks_.size(), [&](size_t b) {
            for (size_t v = 0; v < kBlockVoxels; ++v) {
                const uint16_t count = counts_[b * kBlockVoxels + v];
                float& value = blocks_[b].values[v];
                value = count > 0 ? value / float(count) : 1.0f;
            }
        });
    }

    bool observed(const glm::ivec3& at) const {
        glm::ivec3 place(0);
        for (int k = 0; k < 3; ++k) place[k] = at[k] >> 3;
        const uint64_t key = key_of(place);
        const auto found = std::ranges::lower_bound(keys_, key);
        if (found == keys_.end() || *found != key) return false;
        const glm::ivec3 in = at - place * kBlockSide;
        const size_t block = block_of_[size_t(found - keys_.begin())];
        return counts_[block * kBlockVoxels + size_t((in.x * kBlockSide + in.y) * kBlockSide + in.z)] > 0;
    }

    bool in_observed_cell(const glm::vec3& vertex) const {
        const glm::ivec3 cell(glm::floor(vertex));
        for (int c = 0; c < 8; ++c)
            if (!observed(cell + glm::ivec3(c & 1, c >> 1 & 1, c >> 2))) return false;
        return true;
    }

    /// The mesh is changed in contracted space, where all its triangles have about one size.
    scene::TriangleMesh mesh_of(const IndexedTriangles& surface) const {
        scene::TriangleMesh mesh = options_.closed ? whole(surface) : observed_part(surface);
        drop_small_parts(mesh, options_.least_part * lattice_.voxel);
        if (options_.most_triangles > 0) simplify(mesh, options_.most_triangles);
        if (lattice_.contracts())
            for (glm::vec3& p : mesh.positions) p = glm::vec3(lattice_.space.expanded(glm::dvec3(p)));
        return mesh;
    }

    scene::TriangleMesh whole(const IndexedTriangles& surface) const {
        scene::TriangleMesh mesh;
        mesh.origin = lattice_.space.middle;
        for (const glm::vec3& p : surface.positions) mesh.positions.push_back(float(lattice_.voxel) * p);
        mesh.triangles = surface.triangles;
        return mesh;
    }

    scene::TriangleMesh observed_part(const IndexedTriangles& surface) const {
        std::vector<uint8_t> kept(surface.positions.size());
        constexpr size_t kTogether = 4096;
        core::on_all_cores((kept.size() + kTogether - 1) / kTogether, [&](size_t group) {
            for (size_t i = group * kTogether; i < std::min(kept.size(), (group + 1) * kTogether); ++i)
                kept[i] = in_observed_cell(surface.positions[i]);
        });
        scene::TriangleMesh mesh = whole(surface);
        std::erase_if(mesh.triangles,
                      [&](const Corners& t) { return !(kept[t[0]] && kept[t[1]] && kept[t[2]]); });
        return mesh;
    }

    std::span<const Camera> cameras_;
    const DepthOfView& depth_;
    Lattice lattice_;
    double finest_;
    const FusionOptions& options_;
    const std::function<void(size_t)>& done_;
    std::unique_ptr<Volume> volume_;
    std::vector<uint64_t> keys_;      // of all blocks, in ascending order
    std::vector<uint32_t> block_of_;  // the block of each key
    std::vector<Block> blocks_;
    std::vector<uint16_t> counts_;  // views that gave a voxel a value
};

}  // namespace

Fused fuse(std::span<const Camera> cameras, const DepthOfView& depth, const FusionOptions& options,
           const std::function<void(size_t)>& done) {
    Lattice lattice;
    if (options.unbounded) lattice.space = space_of_views(cameras, depth);
    const double usual = usual_voxel(cameras, depth, lattice.space);
    if (!(usual > 0))
        throw InputError("no camera sees a surface: nowhere do the splats take half of the light of a pixel");
    lattice.voxel = options.voxel > 0 ? options.voxel : options.coarser * usual;
    if (!options.unbounded)
        for (const Camera& camera : cameras)
            lattice.space.middle += camera.position() / double(cameras.size());
    return Fusion(cameras, depth, lattice, usual, options, done).run();
}

}  // namespace ewa::mesh
