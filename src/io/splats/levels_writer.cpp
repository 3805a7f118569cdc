// SPDX-License-Identifier: Apache-2.0
// Writes streamed SOG, whose layout levels.h describes.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "io/splats/formats.h"
#include "io/splats/levels.h"
#include "io/splats/part_folders.h"
#include "io/splats/sog.h"
#include "io/splats/splat_tree.h"
#include "scene/decimate.h"
#include "scene/splat_arrays.h"

namespace ewa::io {

namespace {

using nlohmann::ordered_json;

/// A leaf is split above this number of splats of level 0: with those of all levels, about 512 Ki.
constexpr size_t kMostOfALeaf = size_t(256) << 10;
/// A leaf that is longer than this is split too, unless it has few splats.
constexpr double kLongestLeaf = 16;
constexpr size_t kFew = size_t(8) << 10;
/// A chunk takes leaves until it has more.
constexpr size_t kMostOfAChunk = size_t(512) << 10;
/// Levels are made until one has at most this number of splats.
constexpr size_t kCoarseEnough = 1'000'000;

struct LevelRows {
    size_t level, file, offset, count;
    double error;  // squared, of all merges since level 0
};

/// What the file has of a node.
struct NodeRows {
    std::vector<LevelRows> rows;  // of a leaf
    double light = 0;             // of the first of them, scene::squared_light
    Bound bound;
};

/// Seven digits, as other writers have.
double rounded(double value) {
    char text[32];
    std::snprintf(text, sizeof(text), "%.7g", value);
    return std::strtod(text, nullptr);
}

bool is_in_chunk(const std::filesystem::path& file) {
    return file.filename() == kSogMeta || std::ranges::count(kSogImages, without_number(file)) > 0;
}

class LevelsWriter {
  public:
    LevelsWriter(const std::filesystem::path& path, const SaveOptions& options, size_t splats)
        : path_(path), options_(options), folders_(path, {level_files, names_chunk_folder, is_in_chunk}) {
        const bool until_coarse = options.levels == 0;
        size_t size = splats;
        do {
            sizes_.push_back(size);
            size = (size + 1) / 2;
        } while (sizes_.size() < kMostLevels && sizes_.back() > 1 &&
                 (until_coarse ? sizes_.back() > kCoarseEnough : sizes_.size() < size_t(options.levels)));
    }

    std::vector<std::string> write(Gaussians g) {
        if (sizes_.size() > 1) scene::put_neighbors_together(g);
        nodes_ = build_tree(g, {.most = kMostOfALeaf, .longest = kLongestLeaf, .few = kFew});
        rows_.resize(nodes_.size());
        for (size_t level = 0; level < sizes_.size(); ++level) {
            if (level > 0) scene::decimate_traced(g, sizes_[level], errors_);
            write_level(g, level);
        }
        folders_.replace(meta().dump() + "\n");
        std::vector<std::string> remarks;
        if (sizes_.size() > 1) remarks.push_back("levels of " + counts_text(sizes_) + " splats");
        for (std::string& remark : lost_) remarks.push_back(std::move(remark));
        return remarks;
    }

  private:
    void write_level(const Gaussians& g, size_t level) {
        std::vector<std::vector<uint32_t>> splats(nodes_.size());
        for (size_t i = 0; i < g.size(); ++i) splats[node_of(nodes_, &g.means[3 * i])].push_back(uint32_t(i));
        Gaussians chunk;
        for (size_t at = 0; at < nodes_.size(); ++at) {
            if (splats[at].empty()) continue;
            Gaussians leaf = scene::rows_of(g, splats[at]);
            double error = 0;
            if (level > 0)
                for (const uint32_t i : splats[at]) error += errors_[i];
            splats[at] = {};
            for (size_t i = 0; i < leaf.size(); ++i) rows_[at].bound.add(bound_of_splat(leaf, i));
            if (rows_[at].rows.empty() && sizes_.size() > 1)
                for (size_t i = 0; i < leaf.size(); ++i) rows_[at].light += scene::squared_light(leaf, i);
            select_splats(leaf, morton_order(leaf));
            rows_[at].rows.push_back({level, names_.size(), chunk.size(), leaf.size(), error});
            append_splats(chunk, leaf);
            if (chunk.size() > kMostOfAChunk) write_chunk(chunk, level);
        }
        if (chunk.size() > 0) write_chunk(chunk, level);
        chunks_ = 0;
    }

    void write_chunk(Gaussians& chunk, size_t level) {
        std::string folder = std::to_string(level);
        folder.append("_").append(std::to_string(chunks_++));
        folder = folders_.add(folder);
        SaveOptions options = options_;
        options.progress = {};
        lost_ = write_sog_rows(path_.parent_path() / folder / "meta.json", chunk, options);
        names_.push_back(folder + "/meta.json");
        written_ += chunk.size();
        size_t all = 0;
        for (const size_t size : sizes_) all += size;
        if (options_.progress) options_.progress(sizes_[0] * written_ / all, sizes_[0]);
        chunk = {};
    }

    static ordered_json json_of(const Bound& box) {
        ordered_json value;
        for (int k = 0; k < 3; ++k) {
            value["min"].push_back(rounded(box.low[k]));
            value["max"].push_back(rounded(box.high[k]));
        }
        return value;
    }

    /// Children follow their parents, so the boxes come from the end.
    void join_bounds() {
        for (size_t at = nodes_.size(); at-- > 0;)
            if (nodes_[at].axis >= 0)
                for (const size_t child : {nodes_[at].first, nodes_[at].second})
                    rows_[at].bound.add(rows_[child].bound);
    }

    /// The error of each level against the finest one of the leaf, as a part of its light. It never falls: a step to a finer level
    /// removes an error.
    std::vector<double> errors_of(const NodeRows& leaf) const {
        std::vector<double> errors(sizes_.size());
        double last = 0;
        for (const LevelRows& rows : leaf.rows) {
            const double error = (rows.error - leaf.rows[0].error) / leaf.light;
            if (error > last && std::isfinite(error)) last = error;
            errors[rows.level] = rounded(last);
        }
        return errors;
    }

    ordered_json json_of(size_t at) const {
        ordered_json value;
        value["bound"] = json_of(rows_[at].bound);
        if (nodes_[at].axis >= 0) {
            value["children"] = {json_of(nodes_[at].first), json_of(nodes_[at].second)};
            return value;
        }
        value["lods"] = ordered_json::object();
        for (const LevelRows& rows : rows_[at].rows)
            value["lods"][std::to_string(rows.level)] = {
                {"file", rows.file}, {"offset", rows.offset}, {"count", rows.count}};
        if (sizes_.size() > 1) value["errors"] = errors_of(rows_[at]);
        return value;
    }

    ordered_json meta() {
        join_bounds();
        size_t all = 0;
        for (const size_t size : sizes_) all += size;
        ordered_json value;
        value["version"] = 1;
        value["asset"]["generator"] = "ewa " EWA_VERSION;
        value["count"] = all;
        value["counts"] = sizes_;
        value["lodLevels"] = sizes_.size();
        if (sizes_.size() > 1) value["lodErrors"] = true;
        value["filenames"] = names_;
        value["tree"] = json_of(0);
        return value;
    }

    std::filesystem::path path_;
    const SaveOptions& options_;
    PartFolders folders_;
    std::vector<size_t> sizes_;  // of the levels
    std::vector<TreeNode> nodes_;
    std::vector<NodeRows> rows_;  // of each node
    std::vector<float> errors_;   // of each splat of the level
    std::vector<std::string> names_, lost_;
    size_t chunks_ = 0, written_ = 0;
};

}  // namespace

std::string counts_text(const std::vector<size_t>& counts) {
    std::string text;
    for (const size_t count : counts) text.append(text.empty() ? "" : ", ").append(std::to_string(count));
    return text;
}

bool names_chunk_folder(std::string_view name) {
    return is_pair_of_numbers(without_number(name));
}

std::vector<std::string> write_levels(const std::filesystem::path& path, Gaussians gaussians,
                                      const SaveOptions& options) {
    if (gaussians.size() == 0)
        throw InputError(path.string() + ": a streamed SOG without splats has no tree; write another format");
    const size_t count = gaussians.size();
    return LevelsWriter(path, options, count).write(std::move(gaussians));
}

}  // namespace ewa::io
