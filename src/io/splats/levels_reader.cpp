// SPDX-License-Identifier: Apache-2.0
// Reads streamed SOG, whose layout levels.h describes.
#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "core/folders.h"
#include "core/json_field.h"
#include "core/sandboxed_path.h"
#include "core/text.h"
#include "ewa/splat_edit.h"
#include "io/splats/formats.h"
#include "io/splats/levels.h"
#include "io/splats/splat_values.h"

namespace ewa::io {

namespace {

using nlohmann::json;

/// 260 million splats in 10 levels have about 20,000 chunks and as many leaves.
constexpr core::JsonLimits kLevelLimits = {.depth = 512};

struct Rows {
    size_t file;
    uint64_t offset, count;
};

/// The values of a lod-meta.json, checked.
class LevelsMeta {
  public:
    explicit LevelsMeta(const std::filesystem::path& path)
        : path_(path),
          top_(core::JsonField::of_file(path, kLevelLimits, "; it is damaged, or not of a streamed SOG")) {
        if (top_.has("version") && top_.value()["version"] != 1)
            fail("the \"version\" of its streamed SOG is unknown; 1 is supported");
        levels_.resize(size_t(top_.whole("lodLevels", kMostLevels, 1)));
        read_files();
        read_tree();
        for (std::vector<Rows>& rows : levels_) check_rows(rows);
    }

    [[noreturn]] void fail(const std::string& text) const { top_.fail(text); }

    const std::vector<std::filesystem::path>& files() const { return files_; }
    size_t levels() const { return levels_.size(); }
    /// In order of the files and offsets.
    const std::vector<Rows>& rows(size_t level) const { return levels_[level]; }
    bool has_environment() const { return top_.value().contains("environment"); }

    std::vector<size_t> counts() const {
        std::vector<size_t> sums(levels_.size());
        for (size_t level = 0; level < levels_.size(); ++level)
            for (const Rows& rows : levels_[level]) sums[level] += size_t(rows.count);
        return sums;
    }

  private:
    static constexpr uint64_t kMostRows = uint64_t(1) << 32;

    void read_files() {
        std::set<std::filesystem::path> known;
        for (const json& name : top_.list("filenames")) {
            const std::string text = name.is_string() ? name.get<std::string>() : "";
            const auto inside = core::name_inside(text);
            if (!inside || !core::links_stay_inside(path_.parent_path(), *inside))
                fail("names the chunk \"" + text + "\", which is not in its folder");
            if (!known.insert(*inside).second) fail("names the chunk \"" + text + "\" twice");
            files_.push_back(path_.parent_path() / *inside);
        }
    }

    void read_tree() {
        const std::string where = top_.where() + ": a node of \"tree\"";
        std::vector<const json*> open(1, &top_.members("tree"));
        while (!open.empty()) {
            const core::JsonField node(*open.back(), where);
            open.pop_back();
            if (!node.value().is_object()) node.fail("is not a JSON object");
            if (node.has("children"))
                for (const json& child : node.list("children")) open.push_back(&child);
            if (node.has("lods")) read_leaf(node.part("lods"));
        }
    }

    void read_leaf(const core::JsonField& lods) {
        for (const auto& [key, value] : lods.value().items()) {
            size_t level = 0;
            while (level < levels_.size() && key != std::to_string(level)) ++level;
            if (level == levels_.size())
                fail("a leaf has the level \"" + key + "\", and \"lodLevels\" is " +
                     std::to_string(levels_.size()));
            const core::JsonField rows = lods.part(key.c_str());
            const uint64_t file = rows.whole("file", kMostRows);
            if (file >= files_.size())
                fail("a leaf has rows of file " + std::to_string(file) + ", and \"filenames\" has " +
                     std::to_string(files_.size()));
            levels_[level].push_back(
                {size_t(file), rows.whole("offset", kMostRows), rows.whole("count", kMostRows)});
        }
    }

    void check_rows(std::vector<Rows>& rows) const {
        std::ranges::sort(rows, [](const Rows& a, const Rows& b) {
            return a.file != b.file ? a.file < b.file : a.offset < b.offset;
        });
        for (size_t k = 1; k < rows.size(); ++k)
            if (rows[k].file == rows[k - 1].file && rows[k].offset < rows[k - 1].offset + rows[k - 1].count)
                fail("two leaves of one level have the same rows of the chunk \"" +
                     files_[rows[k].file].lexically_relative(path_.parent_path()).string() + "\"");
    }

    std::filesystem::path path_;
    core::JsonField top_;
    std::vector<std::filesystem::path> files_;
    std::vector<std::vector<Rows>> levels_;
};

SplatScene read_chunk(const LevelsMeta& meta, size_t index) try {
    return read_sog_meta(meta.files()[index]);
} catch (const InputError& error) {
    meta.fail("\"filenames\" " + std::to_string(index) + ": " + error.what());
}

}  // namespace

SplatScene read_level(const std::filesystem::path& path, size_t level) {
    const LevelsMeta meta(path);
    if (level >= meta.levels())
        meta.fail("has no level " + std::to_string(level) + "; the last is " +
                  std::to_string(meta.levels() - 1));
    SplatScene scene;
    scene.format = SplatFormat::sog_levels;
    scene.variant = "level " + std::to_string(level) + " of " + std::to_string(meta.levels()) + " with " +
                    counts_text(meta.counts()) + " splats";
    const std::vector<Rows>& rows = meta.rows(level);
    for (size_t begin = 0, end = 0; begin < rows.size(); begin = end) {
        const std::filesystem::path& file = meta.files()[rows[begin].file];
        SplatScene chunk = read_chunk(meta, rows[begin].file);
        std::vector<uint32_t> kept;
        for (end = begin; end < rows.size() && rows[end].file == rows[begin].file; ++end) {
            if (rows[end].offset + rows[end].count > chunk.gaussians.size())
                meta.fail("a leaf has the rows " + std::to_string(rows[end].offset) + " to " +
                          std::to_string(rows[end].offset + rows[end].count) + " of " +
                          core::one_line(file.string()) + ", which has " +
                          std::to_string(chunk.gaussians.size()));
            for (uint64_t i = 0; i < rows[end].count; ++i) kept.push_back(uint32_t(rows[end].offset + i));
        }
        keep_splats(chunk.gaussians, kept);
        append_splats(scene.gaussians, chunk.gaussians);
        scene.antialiased = scene.antialiased || chunk.antialiased;
        for (std::string& remark : chunk.remarks)
            if (std::ranges::find(scene.remarks, remark) == scene.remarks.end())
                scene.remarks.push_back(std::move(remark));
    }
    scene.file_sh_degree = scene.gaussians.sh_degree;
    if (meta.has_environment())
        scene.remarks.emplace_back("the environment, which all levels show, is skipped");
    return scene;
}

std::vector<size_t> count_levels(const std::filesystem::path& path) {
    return LevelsMeta(path).counts();
}

SplatScene read_levels(const std::filesystem::path& path) {
    return read_level(path, 0);
}

Paths level_files(const std::filesystem::path& path) try {
    Paths files;
    if (!core::is_file(path)) return files;
    const LevelsMeta levels(path);
    for (const std::filesystem::path& meta : levels.files()) {
        if (!core::is_file(meta)) continue;
        files.push_back(meta);
        const Paths images = sog_images(meta);
        files.insert(files.end(), images.begin(), images.end());
    }
    return files;
} catch (const InputError&) {
    return {};
}

}  // namespace ewa::io
