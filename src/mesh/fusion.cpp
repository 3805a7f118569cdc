// SPDX-License-Identifier: Apache-2.0
#include "mesh/fusion.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <vector>

#include "core/parallel.h"
#include "ewa/error.h"
#include "mesh/depth_map.h"
#include "mesh/meshing.h"
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
    glm::dvec3 origin{0};
    double voxel = 1;
    double truncation() const { return kTruncation * voxel; }
    glm::dvec3 index(const glm::dvec3& world) const { return (world - origin) / voxel; }
};

/// A view's depth up to which its pixels are fine enough.
double depth_limit(const Camera& camera, const Lattice& lattice, double usual) {
    return kCoarsestPixel * std::max(lattice.voxel, usual) * focal(camera);
}

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

/// The blocks within the truncation of what a row of pixels shows, along its rays.
std::vector<uint64_t> blocks_of_row(const Camera& camera, const Image& depth, int y, const Lattice& lattice,
                                    double limit) {
    std::vector<uint64_t> keys;
    const glm::dmat3 to_world = glm::transpose(camera.rotation);
    const glm::dvec3 eye = camera.position();
    for (int x = 0; x < depth.width; ++x) {
        const double z = double(*depth.at(x, y));
        if (!(z > 0 && z <= limit)) continue;
        // Points closer to each other than two voxels meet the same blocks.
        const int step = int(std::clamp(2 * lattice.voxel * focal(camera) / z, 1.0, 8.0));
        if (x % step != 0 || y % step != 0) continue;
        const glm::dvec3 ray =
            to_world * glm::dvec3((x + 0.5 - camera.cx) / camera.fx, (y + 0.5 - camera.cy) / camera.fy, 1);
        for (double s = -kTruncation; s <= kTruncation; s += 2) {
            const glm::dvec3 at = lattice.index(eye + (z + s * lattice.voxel) * ray);
            for (int corner = 0; corner < 8; ++corner) {
                constexpr double kReach = 1.5;
                const glm::dvec3 to(corner & 1 ? kReach : -kReach, corner & 2 ? kReach : -kReach,
                                    corner & 4 ? kReach : -kReach);
                add_place(keys, at + to, lattice.voxel);
            }
        }
    }
    sort_unique(keys);
    return keys;
}

class Fusion {
  public:
    Fusion(std::span<const Camera> cameras, const DepthOfView& depth, const Lattice& lattice, double usual,
           uint64_t most_bytes, const std::function<void(size_t)>& done)
        : cameras_(cameras),
          depth_(depth),
          lattice_(lattice),
          usual_(usual),
          most_bytes_(most_bytes),
          done_(done),
          volume_(meshing().make_volume()) {}

    Fused run() {
        find_blocks();
        for (size_t i = 0; i < cameras_.size(); ++i) {
            add_view(cameras_[i], depth_(i));
            if (done_) done_(cameras_.size() + i + 1);
        }
        finish_values();
        Fused out;
        out.mesh = observed_part(volume_->surface());
        out.voxel = lattice_.voxel;
        out.blocks = blocks_.size();
        return out;
    }

  private:
    void find_blocks() {
        for (size_t i = 0; i < cameras_.size(); ++i) {
            const Image& depth = depth_(i);
            const double limit = depth_limit(cameras_[i], lattice_, usual_);
            std::vector<std::vector<uint64_t>> rows(size_t(depth.height));
            core::on_all_cores(rows.size(), [&](size_t y) {
                rows[y] = blocks_of_row(cameras_[i], depth, int(y), lattice_, limit);
            });
            std::vector<uint64_t> seen;
            for (const auto& row : rows) seen.insert(seen.end(), row.begin(), row.end());
            sort_unique(seen);
            std::vector<uint64_t> all;
            std::ranges::set_union(keys_, seen, std::back_inserter(all));
            keys_ = std::move(all);
            if (most_bytes_ > 0 && keys_.size() * kBlockBytes > most_bytes_)
                fail_too_fine(lattice_.voxel,
                              fmt::format("the volume would take more than {} MiB", most_bytes_ >> 20));
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
        const float limit = float(depth_limit(camera, lattice_, usual_));
        core::on_all_cores((blocks_.size() + kTogether - 1) / kTogether, [&](size_t group) {
            const size_t end = std::min(blocks_.size(), (group + 1) * kTogether);
            for (size_t b = group * kTogether; b < end; ++b) add_view_to(b, camera, depth, limit);
        });
    }

    void add_view_to(size_t b, const Camera& camera, const Image& depth, float limit) {
        const glm::dvec3 corner =
            camera.rotation * (lattice_.origin + lattice_.voxel * glm::dvec3(blocks_[b].corner)) +
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
        float* values = blocks_[b].values;
        uint16_t* counts = &counts_[b * kBlockVoxels];
        for (int v = 0; v < int(kBlockVoxels); ++v) {
            const glm::vec3 p = base + step * glm::vec3(v >> 6, v >> 3 & 7, v & 7);
            if (!(p.z > 0)) continue;
            const float d = depth_at(depth, pixel_of(camera, p), truncation);
            if (!(d > 0 && d <= limit) || p.z - d > truncation || counts[v] == UINT16_MAX) continue;
            values[v] += std::min(1.0f, (d - p.z) / truncation);
            ++counts[v];
        }
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

    scene::TriangleMesh observed_part(const IndexedTriangles& surface) const {
        std::vector<uint8_t> kept(surface.positions.size());
        constexpr size_t kTogether = 4096;
        core::on_all_cores((kept.size() + kTogether - 1) / kTogether, [&](size_t group) {
            for (size_t i = group * kTogether; i < std::min(kept.size(), (group + 1) * kTogether); ++i)
                kept[i] = in_observed_cell(surface.positions[i]);
        });
        scene::TriangleMesh mesh;
        mesh.origin = lattice_.origin;
        for (const glm::vec3& p : surface.positions) mesh.positions.push_back(float(lattice_.voxel) * p);
        for (const Corners& t : surface.triangles)
            if (kept[t[0]] && kept[t[1]] && kept[t[2]]) mesh.triangles.push_back(t);
        return mesh;
    }

    std::span<const Camera> cameras_;
    const DepthOfView& depth_;
    Lattice lattice_;
    double usual_;
    uint64_t most_bytes_;
    const std::function<void(size_t)>& done_;
    std::unique_ptr<Volume> volume_;
    std::vector<uint64_t> keys_;      // of all blocks, in ascending order
    std::vector<uint32_t> block_of_;  // the block of each key
    std::vector<Block> blocks_;
    std::vector<uint16_t> counts_;  // views that gave a voxel a value
};

}  // namespace

double usual_voxel(std::span<const Camera> cameras, const DepthOfView& depth) {
    std::vector<float> sides;
    for (size_t i = 0; i < cameras.size(); ++i) {
        const Image& image = depth(i);
        // Every view has the same say, whatever its size.
        constexpr size_t kSamples = 10000;
        const size_t step = std::max<size_t>(1, image.pixels.size() / kSamples);
        for (size_t p = 0; p < image.pixels.size(); p += step)
            if (image.pixels[p] > 0) sides.push_back(image.pixels[p] / float(focal(cameras[i])));
    }
    if (sides.empty()) return 0;
    const auto middle = sides.begin() + std::ptrdiff_t(sides.size() / 2);
    std::ranges::nth_element(sides, middle);
    return kVoxelPixels * double(*middle);
}

Fused fuse(std::span<const Camera> cameras, const DepthOfView& depth, const FusionOptions& options,
           const std::function<void(size_t)>& done) {
    const double usual = usual_voxel(cameras, depth);
    if (!(usual > 0))
        throw InputError("no camera sees a surface: nowhere do the splats take half of the light of a pixel");
    Lattice lattice;
    lattice.voxel = options.voxel > 0 ? options.voxel : usual;
    for (const Camera& camera : cameras) lattice.origin += camera.position() / double(cameras.size());
    return Fusion(cameras, depth, lattice, usual, options.most_bytes, done).run();
}

}  // namespace ewa::mesh
