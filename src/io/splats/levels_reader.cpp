// SPDX-License-Identifier: Apache-2.0
// Reads streamed SOG, whose layout levels.h describes.
#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "core/folders.h"
#include "core/json.h"
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
          name_(core::one_line(path.string())),
          values_(core::read_json_file<json>(path, kLevelLimits)) {
        if (!values_.is_object()) fail("the JSON is not an object");
        if (const auto version = values_.find("version"); version != values_.end() && *version != 1)
            fail("the \"version\" of its streamed SOG is unknown; 1 is supported");
        levels_.resize(size_t(integer(at(values_, "lodLevels"), "lodLevels", kMostLevels)));
        if (levels_.empty()) fail("\"lodLevels\" is 0");
        read_files();
        read_tree();
        for (std::vector<Rows>& rows : levels_) check_rows(rows);
    }

    [[noreturn]] void fail(const std::string& text) const { throw InputError(name_ + ": " + text); }

    const std::vector<std::filesystem::path>& files() const { return files_; }
    size_t levels() const { return levels_.size(); }
    /// In order of the files and offsets.
    const std::vector<Rows>& rows(size_t level) const { return levels_[level]; }
    bool has_environment() const { return values_.contains("environment"); }

    uint64_t count(size_t level) const {
        uint64_t sum = 0;
        for (const Rows& rows : levels_[level]) sum += rows.count;
        return sum;
    }

  private:
    static constexpr uint64_t kMostRows = uint64_t(1) << 32;

    const json& at(const json& object, const char* key) const {
        const auto found = object.is_object() ? object.find(key) : object.end();
        if (!object.is_object() || found == object.end())
            fail("has no \"" + std::string(key) + "\"; it is damaged, or not of a streamed SOG");
        return *found;
    }

    uint64_t integer(const json& value, const char* what, uint64_t most) const {
        if (!value.is_number_unsigned() || value.get<uint64_t>() > most)
            fail("\"" + std::string(what) + "\" is not a whole number of 0 to " + std::to_string(most));
        return value.get<uint64_t>();
    }

    void read_files() {
        const json& names = at(values_, "filenames");
        if (!names.is_array()) fail("\"filenames\" is not a list");
        std::set<std::filesystem::path> known;
        for (const json& name : names) {
            const std::string text = name.is_string() ? name.get<std::string>() : "";
            const auto inside = core::name_inside(text);
            if (!inside || !core::links_stay_inside(path_.parent_path(), *inside))
                fail("names the chunk \"" + core::one_line(text) + "\", which is not in its folder");
            if (!known.insert(*inside).second) fail("names the chunk \"" + core::one_line(text) + "\" twice");
            files_.push_back(path_.parent_path() / *inside);
        }
    }

    void read_tree() {
        std::vector<const json*> open(1, &at(values_, "tree"));
        while (!open.empty()) {
            const json& node = *open.back();
            open.pop_back();
            if (!node.is_object()) fail("a node of \"tree\" is not an object");
            if (const auto children = node.find("children"); children != node.end()) {
                if (!children->is_array()) fail("\"children\" of a node is not a list");
                for (const json& child : *children) open.push_back(&child);
            }
            if (const auto lods = node.find("lods"); lods != node.end()) read_leaf(*lods);
        }
    }

    void read_leaf(const json& lods) {
        if (!lods.is_object()) fail("\"lods\" of a leaf is not an object");
        for (const auto& [key, value] : lods.items()) {
            size_t level = 0;
            while (level < levels_.size() && key != std::to_string(level)) ++level;
            if (level == levels_.size())
                fail("a leaf has the level \"" + core::one_line(key) + "\", and \"lodLevels\" is " +
                     std::to_string(levels_.size()));
            const uint64_t file = integer(at(value, "file"), "file", kMostRows);
            if (file >= files_.size())
                fail("a leaf has rows of file " + std::to_string(file) + ", and \"filenames\" has " +
                     std::to_string(files_.size()));
            levels_[level].push_back({size_t(file), integer(at(value, "offset"), "offset", kMostRows),
                                      integer(at(value, "count"), "count", kMostRows)});
        }
    }

    void check_rows(std::vector<Rows>& rows) const {
        std::ranges::sort(rows, [](const Rows& a, const Rows& b) {
            return a.file != b.file ? a.file < b.file : a.offset < b.offset;
        });
        for (size_t k = 1; k < rows.size(); ++k)
            if (rows[k].file == rows[k - 1].file && rows[k].offset < rows[k - 1].offset + rows[k - 1].count)
                fail("two leaves of one level have the same rows of the chunk \"" +
                     core::one_line(files_[rows[k].file].lexically_relative(path_.parent_path()).string()) +
                     "\"");
    }

    std::filesystem::path path_;
    std::string name_;
    json values_;
    std::vector<std::filesystem::path> files_;
    std::vector<std::vector<Rows>> levels_;
};

/// "68,644 splats" of each level.
std::string counts_text(const LevelsMeta& meta) {
    std::string text;
    for (size_t level = 0; level < meta.levels(); ++level)
        text.append(level == 0 ? "" : ", ").append(std::to_string(meta.count(level)));
    return text;
}

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
                    counts_text(meta) + " splats";
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
    const LevelsMeta meta(path);
    std::vector<size_t> counts;
    for (size_t level = 0; level < meta.levels(); ++level) counts.push_back(size_t(meta.count(level)));
    return counts;
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
