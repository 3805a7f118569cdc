// SPDX-License-Identifier: Apache-2.0
#include "io/splats/tileset.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/folders.h"
#include "core/json_field.h"
#include "core/sandboxed_path.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "io/splats/formats.h"
#include "io/splats/gltf_splats.h"
#include "io/splats/levels.h"
#include "io/splats/part_folders.h"
#include "io/splats/splat_tree.h"
#include "scene/splat_arrays.h"

namespace ewa::io {

namespace {

using nlohmann::ordered_json;

constexpr size_t kMostOfATile = 100'000, kFewestOfATile = 1'000;
constexpr double kReach = 3;  // standard deviations that viewers draw; they cull by the box
constexpr int kDeepest = 31;
constexpr const char* kFolder = "tiles";
/// write_tileset makes so many of half a billion splats. Each tile has two objects besides its box, and fewer than 24 values.
constexpr size_t kMostTiles = size_t(1) << 20;
constexpr core::JsonLimits kTilesetLimits = {.bytes = uint64_t(4096) * kMostTiles,
                                             .depth = 512,
                                             .objects = 2 * kMostTiles + 1024,
                                             .values = 24 * kMostTiles + 1024,
                                             .skipped = "boundingVolume"};
/// CesiumJS replaces a tile whose error covers more than 16 px. Splats that are 2 px wide then suffice.
constexpr double kErrorPerWidth = 8;

/// From a PLY's frame (x right, y down, z forward) to that of 3D Tiles (x east, y north, z up).
const glm::dmat4 kUp({1, 0, 0, 0}, {0, 0, -1, 0}, {0, 1, 0, 0}, {0, 0, 0, 1});

struct Tile {
    int depth = 0;
    size_t level = 0, splats = 0;
    double error = 0;      // world units
    Bound bound;           // in the frame of a PLY, relative to the scene's origin
    glm::dvec3 origin{0};  // of its coordinates, in the same frame
    std::string file;
};

/// The width of a usual splat: twice its second standard deviation, as a surface has two. World units.
double usual_width(const Gaussians& g) {
    std::vector<float> widths;
    for (size_t i = 0; i < g.size(); ++i) {
        std::array<float, 3> scales = {g.log_scales[3 * i], g.log_scales[3 * i + 1], g.log_scales[3 * i + 2]};
        std::ranges::sort(scales);
        widths.push_back(scales[1]);
    }
    const auto middle = widths.begin() + std::ptrdiff_t(widths.size() / 2);
    std::nth_element(widths.begin(), middle, widths.end());
    return 2 * std::exp(double(*middle));
}

/// Whether write_tileset gives tiles such names.
bool is_tile(const std::filesystem::path& file) {
    return file.extension() == ".glb" && is_pair_of_numbers(file.stem().string());
}

class TilesetWriter {
  public:
    /// earth: as SaveOptions::earth.
    TilesetWriter(const std::filesystem::path& path, const SaveOptions& options,
                  const std::optional<glm::dmat4>& earth)
        : path_(path),
          options_(options),
          earth_(earth),
          folders_(path, {tile_files, names_tile_folder, is_tile}),
          folder_(folders_.add(kFolder)) {}

    std::vector<std::string> write(Gaussians g) {
        const glm::dvec3 origin = g.origin;
        g.origin = glm::dvec3(0);
        plan(g);
        const size_t levels = size_t(deepest_) + 1;
        std::vector<size_t> sizes(1, g.size());
        for (size_t level = 0; level < levels; ++level) {
            if (level > 0) {
                sizes.push_back((sizes.back() + 1) / 2);
                decimate_splats(g, sizes.back());
            }
            write_level(g, level);
        }
        join();
        folders_.replace(structure(origin).dump(1) + "\n");
        std::vector<std::string> remarks(
            1, std::to_string(written_) + " tiles of levels with " + counts_text(sizes) + " splats");
        if (size_t(options_.levels) > levels)
            remarks.push_back(std::to_string(levels) + " of " + std::to_string(options_.levels) +
                              " levels: more would have tiles of fewer than " +
                              std::to_string(kFewestOfATile) + " splats");
        const std::vector<std::string> lost = loss_.remarks();
        remarks.insert(remarks.end(), lost.begin(), lost.end());
        return remarks;
    }

  private:
    void plan(const Gaussians& g) {
        const int levels = options_.levels;
        // A half of a node with more has at least as many as a tile should.
        nodes_ = build_tree(g, {.most = levels > 0 ? 2 * kFewestOfATile - 1 : kMostOfATile,
                                .longest = 0,
                                .few = 0,
                                .depth = levels > 0 ? levels - 1 : kDeepest});
        tiles_.resize(nodes_.size());
        for (size_t at = 0; at < nodes_.size(); ++at) {
            deepest_ = std::max(deepest_, tiles_[at].depth);
            if (nodes_[at].axis < 0) continue;
            for (const size_t child : {nodes_[at].first, nodes_[at].second})
                tiles_[child].depth = tiles_[at].depth + 1;
        }
        for (size_t at = 0; at < nodes_.size(); ++at)
            tiles_[at].level = nodes_[at].axis < 0 ? 0 : size_t(deepest_ - tiles_[at].depth);
    }

    /// Each tile of the level.
    void write_level(const Gaussians& g, size_t level) {
        std::vector<std::vector<uint32_t>> splats(nodes_.size());
        for (size_t i = 0; i < g.size(); ++i)
            for (int depth = 0; depth <= deepest_; ++depth) {
                const size_t at = node_of(nodes_, &g.means[3 * i], depth);
                if (tiles_[at].level != level || tiles_[at].depth != depth) continue;
                splats[at].push_back(uint32_t(i));
                break;
            }
        for (size_t at = 0; at < nodes_.size(); ++at) {
            if (splats[at].empty()) continue;
            Gaussians part = scene::rows_of(g, splats[at]);
            splats[at] = {};
            select_splats(part, morton_order(part));
            write_tile(std::move(part), tiles_[at]);
        }
    }

    void write_tile(Gaussians part, Tile& tile) {
        for (size_t i = 0; i < part.size(); ++i) tile.bound.add(bound_of_splat(part, i, kReach));
        tile.origin = 0.5 * (tile.bound.low + tile.bound.high);
        for (size_t i = 0; i < part.means.size(); ++i)
            part.means[i] = float(double(part.means[i]) - tile.origin[int(i % 3)]);
        tile.splats = part.size();
        tile.error = tile.level == 0 ? 0 : kErrorPerWidth * usual_width(part);
        tile.file = folder_ + "/" + std::to_string(tile.level) + "_" + std::to_string(written_++) + ".glb";
        SaveOptions options = options_;
        options.progress = {};
        write_cesium_tile(path_.parent_path() / tile.file, part, options, loss_);
    }

    /// Boxes and errors of parents are those of their children too. Children follow their parents.
    void join() {
        for (size_t at = nodes_.size(); at-- > 0;) {
            if (nodes_[at].axis < 0) continue;
            for (const size_t child : {nodes_[at].first, nodes_[at].second}) {
                tiles_[at].bound.add(tiles_[child].bound);
                tiles_[at].error = std::max(tiles_[at].error, tiles_[child].error);
            }
        }
    }

    /// origin: of the tile.
    static ordered_json box_of(const Bound& bound, const glm::dvec3& origin) {
        const glm::dvec3 middle = kUp * glm::dvec4(0.5 * (bound.low + bound.high) - origin, 1);
        const glm::dvec3 half = 0.5 * (bound.high - bound.low);
        return {{"box", {middle.x, middle.y, middle.z, half.x, 0, 0, 0, half.z, 0, 0, 0, half.y}}};
    }

    /// above: from the frame of a PLY with the parent's origin to that of the parent's children, as 3D Tiles has it.
    ordered_json tile_of(size_t at, const glm::dmat4& above, const glm::dvec3& origin_above) const {
        const Tile& tile = tiles_[at];
        const glm::dvec3 origin = tile.file.empty() ? origin_above : tile.origin;
        ordered_json value = {{"boundingVolume", box_of(tile.bound, origin)}, {"geometricError", tile.error}};
        const glm::dmat4 move = glm::translate(above, origin - origin_above) * glm::inverse(kUp);
        if (move != glm::dmat4(1))
            for (int i = 0; i < 16; ++i) value["transform"].push_back(move[i / 4][i % 4]);
        if (!tile.file.empty()) value["content"]["uri"] = tile.file;
        if (nodes_[at].axis >= 0)
            for (const size_t child : {nodes_[at].first, nodes_[at].second})
                if (tiles_[child].bound.low.x <= tiles_[child].bound.high.x)
                    value["children"].push_back(tile_of(child, kUp, origin));
        return value;
    }

    ordered_json structure(const glm::dvec3& origin) const {
        ordered_json value = {{"asset", {{"version", "1.1"}, {"generator", "ewa " EWA_VERSION}}}};
        value["extensionsUsed"] = {"3DTILES_content_gltf"};
        const ordered_json names = {kSplatExtension, kSpzExtension};
        value["extensions"]["3DTILES_content_gltf"] = {{"extensionsUsed", names},
                                                       {"extensionsRequired", names}};
        const Bound& all = tiles_[0].bound;
        // What a viewer misses that shows nothing at all.
        value["geometricError"] = std::max(glm::length(all.high - all.low), tiles_[0].error);
        value["root"] = tile_of(0, glm::translate(earth_.value_or(kUp), origin), glm::dvec3(0));
        value["root"]["refine"] = "REPLACE";
        return value;
    }

    std::filesystem::path path_;
    const SaveOptions& options_;
    const std::optional<glm::dmat4> earth_;
    std::vector<TreeNode> nodes_;
    std::vector<Tile> tiles_;
    PartFolders folders_;
    const std::string folder_;
    SpzLoss loss_;
    int deepest_ = 0;
    size_t written_ = 0;
};

}  // namespace

glm::dmat4 earth_of_place(const Place& place) {
    constexpr double kRadius = 6378137.0, kFlattening = 1 / 298.257223563;  // WGS 84
    const double squared = kFlattening * (2 - kFlattening);                 // eccentricity
    const double latitude = glm::radians(place.latitude), longitude = glm::radians(place.longitude),
                 heading = glm::radians(place.heading);
    const glm::dvec3 up(std::cos(latitude) * std::cos(longitude), std::cos(latitude) * std::sin(longitude),
                        std::sin(latitude));
    const glm::dvec3 east(-std::sin(longitude), std::cos(longitude), 0), north = glm::cross(up, east);
    const double normal = kRadius / std::sqrt(1 - squared * up.z * up.z);
    const glm::dvec3 at(up.x * (normal + place.height), up.y * (normal + place.height),
                        up.z * (normal * (1 - squared) + place.height));
    const glm::dvec3 forward = std::cos(heading) * north + std::sin(heading) * east;
    const glm::dvec3 right = glm::cross(forward, up);
    return {glm::dvec4(right, 0), glm::dvec4(-up, 0), glm::dvec4(forward, 0), glm::dvec4(at, 1)};
}

bool names_tile_folder(std::string_view name) {
    return without_number(name) == kFolder;
}

std::vector<std::filesystem::path> tile_files(const std::filesystem::path& tileset) try {
    std::vector<std::filesystem::path> files;
    if (!core::is_file(tileset)) return files;
    const auto all = core::read_json_file<nlohmann::json>(tileset, kTilesetLimits);
    std::vector<const nlohmann::json*> tiles;
    const auto visit = [&](const nlohmann::json& object, const char* key) {
        if (object.contains(key)) tiles.push_back(&object[key]);
    };
    visit(all, "root");
    for (size_t at = 0; at < tiles.size(); ++at) {
        const nlohmann::json& tile = *tiles[at];
        if (tile.is_array())
            for (const nlohmann::json& child : tile) tiles.push_back(&child);
        visit(tile, "children");
        const auto content = tile.find("content");
        if (content == tile.end()) continue;
        const auto name = core::name_inside(core::text_in(*content, "uri"));
        if (name && core::links_stay_inside(tileset.parent_path(), *name) &&
            core::is_file(tileset.parent_path() / *name))
            files.push_back(tileset.parent_path() / *name);
    }
    return files;
} catch (const InputError&) {
    return {};
}

std::vector<std::string> write_tileset(const std::filesystem::path& path, Gaussians gaussians,
                                       const SaveOptions& options) {
    if (gaussians.size() == 0) throw InputError(path.string() + ": a tileset without splats has no box");
    std::vector<std::string> remarks;
    std::optional<glm::dmat4> earth = options.earth;
    if (const auto place = earth ? std::nullopt : place_in(options.comments)) {
        earth = earth_of_place(*place);
        remarks.push_back("on the globe at latitude " + std::to_string(place->latitude) + ", longitude " +
                          std::to_string(place->longitude) + " and height " +
                          std::to_string(int(std::lround(place->height))) + " m, by the GPS of the photos");
    }
    for (std::string& remark : TilesetWriter(path, options, earth).write(std::move(gaussians)))
        remarks.push_back(std::move(remark));
    return remarks;
}

}  // namespace ewa::io
