// SPDX-License-Identifier: Apache-2.0
#include "capture/feature_database.h"

#include <sqlite3.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "core/text.h"
#include "ewa/error.h"

namespace ewa::capture {
namespace {

constexpr std::int64_t kMostImages = 2147483647;  // a pair's number is made with it
constexpr int kUndefined = 0;                     // the configuration of a pair without a geometry
constexpr int kWait = 10000;                      // ms, for another program that uses the file
// Of a feature's scale. VLFeat describes none in the last row of its octave, nor beyond: up to 1.5 of the octave's pixels, and one more
// where the image has an odd size. The octave's pixel is the scale divided by 1.6 at most.
constexpr float kBorder = 2.5f / 1.6f;

struct Pair {
    std::int64_t number = 0;
    bool swapped = false;
};

Pair pair_of(std::int64_t first, std::int64_t second) {
    const bool swapped = first > second;
    if (swapped) std::swap(first, second);
    return {first * kMostImages + second, swapped};
}

}  // namespace

/// A statement of SQL, from its preparation to its end.
class FeatureDatabase::Statement {
  public:
    Statement(const FeatureDatabase& database, const char* sql) : database_(database) {
        sqlite3_stmt* statement = nullptr;
        check(sqlite3_prepare_v2(database.database_.get(), sql, -1, &statement, nullptr) == SQLITE_OK);
        statement_.reset(statement);
    }

    Statement& bind(int place, std::int64_t value) {
        check(sqlite3_bind_int64(statement_.get(), place, value) == SQLITE_OK);
        return *this;
    }
    template <class T>
    Statement& bind(int place, std::span<const T> values) {
        check(sqlite3_bind_blob64(statement_.get(), place, values.data(), values.size_bytes(),
                                  SQLITE_TRANSIENT) == SQLITE_OK);
        return *this;
    }
    /// Whether there is another row.
    bool step() {
        const int result = sqlite3_step(statement_.get());
        check(result == SQLITE_ROW || result == SQLITE_DONE);
        return result == SQLITE_ROW;
    }
    std::int64_t integer(int column) const { return sqlite3_column_int64(statement_.get(), column); }
    std::string text(int column) const {
        const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), column));
        return text ? text : "";
    }
    /// The array in the columns rows, cols, data. Throws RunError where the data have another size.
    template <class T>
    std::span<const T> array() const {
        const std::int64_t rows = integer(0), columns = integer(1);
        const auto* values = static_cast<const T*>(sqlite3_column_blob(statement_.get(), 2));
        const auto bytes = size_t(sqlite3_column_bytes(statement_.get(), 2));
        check(rows >= 0 && columns >= 0 && columns <= std::int64_t(kDescriptorSize) && rows <= kMostImages &&
                  size_t(rows * columns) * sizeof(T) == bytes,
              "an array has another size than it says");
        return {values, bytes / sizeof(T)};
    }
    void check(bool good, const char* reason = nullptr) const {
        if (!good)
            throw RunError(database_.name_ + ": " +
                           (reason ? reason : sqlite3_errmsg(database_.database_.get())));
    }

  private:
    const FeatureDatabase& database_;
    std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)> statement_{nullptr, sqlite3_finalize};
};

FeatureDatabase::FeatureDatabase(const std::filesystem::path& file)
    : name_(core::one_line(file.string())), database_(nullptr, sqlite3_close) {
    sqlite3* database = nullptr;
    const int result = sqlite3_open_v2(file.string().c_str(), &database, SQLITE_OPEN_READWRITE, nullptr);
    database_.reset(database);
    if (result != SQLITE_OK) throw RunError(name_ + ": " + sqlite3_errstr(result));
    sqlite3_busy_timeout(database, kWait);
    execute("BEGIN");
}

FeatureDatabase::~FeatureDatabase() = default;

void FeatureDatabase::execute(const char* sql) const {
    Statement(*this, sql).step();
}

bool FeatureDatabase::is_known() const {
    const std::scoped_lock lock(mutex_);
    Statement count(*this,
                    "SELECT COUNT(*) FROM sqlite_master WHERE type = 'table' AND name IN "
                    "('images', 'keypoints', 'descriptors', 'matches', 'two_view_geometries')");
    return count.step() && count.integer(0) == 5;
}

std::map<std::string, std::int64_t> FeatureDatabase::images() const {
    const std::scoped_lock lock(mutex_);
    std::map<std::string, std::int64_t> images;
    for (Statement rows(*this, "SELECT image_id, name FROM images"); rows.step();) {
        rows.check(rows.integer(0) > 0 && rows.integer(0) < kMostImages,
                   "an image has a number out of range");
        images[rows.text(1)] = rows.integer(0);
    }
    return images;
}

Descriptors FeatureDatabase::descriptors(std::int64_t image) const {
    const std::scoped_lock lock(mutex_);
    Statement row(*this, "SELECT rows, cols, data FROM descriptors WHERE image_id = ?");
    if (!row.bind(1, image).step()) return {};
    row.check(row.integer(0) == 0 || row.integer(1) == std::int64_t(kDescriptorSize),
              "its descriptors are not those of SIFT");
    const auto values = row.array<std::uint8_t>();
    return {values.begin(), values.end()};
}

std::vector<FeatureDatabase::Feature> FeatureDatabase::features(std::int64_t image, size_t count) const {
    std::vector<Feature> features(count);
    const std::scoped_lock lock(mutex_);
    Statement row(*this, "SELECT rows, cols, data FROM keypoints WHERE image_id = ?");
    if (!row.bind(1, image).step()) return features;
    const auto values = row.array<float>();
    const auto columns = size_t(row.integer(1));
    row.check(values.size() == count * columns, "an image has other keypoints than descriptors");
    // A keypoint is x, y and nothing, or scale and angle, or a 2x2 matrix by rows.
    for (size_t i = 0; i < count && columns >= 2; ++i) {
        const std::span<const float> at = values.subspan(i * columns, columns);
        features[i] = {at[0], at[1], columns < 4 ? 0 : columns < 6 ? at[2] : std::hypot(at[2], at[4])};
    }
    return features;
}

void FeatureDatabase::clear_unwritten_descriptors() {
    for (const auto& [name, image] : images()) {
        const Descriptors all = descriptors(image);
        std::vector<std::uint8_t> written(all.begin(), all.end());
        if (all.empty()) continue;
        const std::vector<Feature> found = features(image, all.size() / kDescriptorSize);
        const std::scoped_lock lock(mutex_);
        Statement size(*this,
                       "SELECT width, height FROM images JOIN cameras USING (camera_id) WHERE image_id = ?");
        if (!size.bind(1, image).step()) continue;
        bool changed = false;
        for (size_t i = 0; i < found.size(); ++i) {
            const float border = kBorder * found[i].scale;
            if (found[i].x < float(size.integer(0)) - border && found[i].y < float(size.integer(1)) - border)
                continue;
            std::fill_n(written.begin() + std::ptrdiff_t(i * kDescriptorSize), kDescriptorSize, 0);
            changed = true;
        }
        if (!changed) continue;
        Statement(*this, "UPDATE descriptors SET data = ?2 WHERE image_id = ?1")
            .bind(1, image)
            .bind(2, std::span<const std::uint8_t>(written))
            .step();
    }
}

Descriptors FeatureDatabase::prominent(std::int64_t image, size_t most) const {
    const Descriptors all = descriptors(image);
    const size_t count = all.size() / kDescriptorSize;
    const std::vector<Feature> found = features(image, count);
    std::vector<size_t> order(count);
    std::iota(order.begin(), order.end(), size_t(0));
    std::ranges::stable_sort(order, [&](size_t a, size_t b) { return found[a].scale > found[b].scale; });
    Descriptors largest;
    for (size_t i = 0; i < std::min(most, count); ++i) {
        const auto from = all.begin() + std::ptrdiff_t(order[i] * kDescriptorSize);
        largest.insert(largest.end(), from, from + std::ptrdiff_t(kDescriptorSize));
    }
    return largest;
}

bool FeatureDatabase::is_compared(std::int64_t first, std::int64_t second) const {
    const std::scoped_lock lock(mutex_);
    Statement row(*this,
                  "SELECT 1 FROM matches WHERE pair_id = ?1 AND (rows > 0 OR NOT EXISTS "
                  "(SELECT 1 FROM two_view_geometries WHERE pair_id = ?1))");
    return row.bind(1, pair_of(first, second).number).step();
}

void FeatureDatabase::write(std::int64_t first, std::int64_t second,
                            const std::vector<FeatureMatch>& matches) {
    const Pair pair = pair_of(first, second);
    std::vector<std::uint32_t> places;
    places.reserve(2 * matches.size());
    for (const FeatureMatch& match : matches) {
        places.push_back(pair.swapped ? match.second : match.first);
        places.push_back(pair.swapped ? match.first : match.second);
    }
    const std::scoped_lock lock(mutex_);
    Statement(*this, "DELETE FROM two_view_geometries WHERE pair_id = ?").bind(1, pair.number).step();
    Statement(*this, "INSERT OR REPLACE INTO matches (pair_id, rows, cols, data) VALUES (?, ?, 2, ?)")
        .bind(1, pair.number)
        .bind(2, std::int64_t(matches.size()))
        .bind(3, std::span<const std::uint32_t>(places))
        .step();
}

void FeatureDatabase::pass_over(std::int64_t first, std::int64_t second) {
    const std::int64_t pair = pair_of(first, second).number;
    const std::scoped_lock lock(mutex_);
    Statement(*this, "INSERT OR IGNORE INTO matches (pair_id, rows, cols) VALUES (?, 0, 2)")
        .bind(1, pair)
        .step();
    Statement(*this,
              "INSERT OR IGNORE INTO two_view_geometries (pair_id, rows, cols, config) VALUES (?, 0, 2, ?)")
        .bind(1, pair)
        .bind(2, kUndefined)
        .step();
}

std::int64_t FeatureDatabase::count(const char* sql) const {
    const std::scoped_lock lock(mutex_);
    Statement row(*this, sql);
    return row.step() ? row.integer(0) : 0;
}

bool FeatureDatabase::has_cameras() const {
    return count("SELECT COUNT(*) FROM sqlite_master WHERE type = 'table' AND name = 'cameras'") == 1 &&
           count("SELECT COUNT(*) FROM pragma_table_info('images') WHERE name = 'camera_id'") == 1;
}

bool FeatureDatabase::has_rigs() const {
    return count(
               "SELECT COUNT(*) FROM sqlite_master WHERE type = 'table' AND name IN ('rigs', 'frames', "
               "'frame_data')") > 0;
}

void FeatureDatabase::number_by_name() {
    const std::map<std::string, std::int64_t> numbers = images();
    std::int64_t highest = 0, next = 0;
    for (const auto& [name, number] : numbers) highest = std::max(highest, number);
    std::vector<std::pair<std::int64_t, std::int64_t>> moves;
    for (const auto& [name, number] : numbers)
        if (number != ++next) moves.emplace_back(number, next);
    const std::scoped_lock lock(mutex_);
    const auto move = [&](std::int64_t from, std::int64_t to) {
        for (const char* sql : {"UPDATE images SET image_id = ?2 WHERE image_id = ?1",
                                "UPDATE keypoints SET image_id = ?2 WHERE image_id = ?1",
                                "UPDATE descriptors SET image_id = ?2 WHERE image_id = ?1"})
            Statement(*this, sql).bind(1, from).bind(2, to).step();
    };
    // Numbers may not meet on the way.
    for (const auto& [from, to] : moves) move(from, highest + from);
    for (const auto& [from, to] : moves) move(highest + from, to);
}

std::map<std::string, double> FeatureDatabase::expected_focal_lengths() const {
    const std::scoped_lock lock(mutex_);
    std::map<std::string, double> lengths;
    for (Statement rows(
             *this,
             "SELECT LENGTH(params) / 8, 1, params, name FROM images JOIN cameras USING (camera_id) "
             "WHERE prior_focal_length != 0 AND LENGTH(params) >= 8");
         rows.step();)
        lengths[rows.text(3)] = rows.array<double>().front();
    return lengths;
}

bool FeatureDatabase::has_shared_cameras() const {
    return count("SELECT COUNT(*) - COUNT(DISTINCT camera_id) FROM images") > 0;
}

void FeatureDatabase::give_own_cameras() {
    const std::map<std::string, std::int64_t> numbers = images();
    const bool rigs = has_rigs();
    const std::scoped_lock lock(mutex_);
    std::int64_t next = 1;
    if (Statement last(*this, "SELECT MAX(camera_id) FROM cameras"); last.step()) next += last.integer(0);
    for (const auto& [name, number] : numbers) {
        Statement(
            *this,
            "INSERT INTO cameras SELECT ?1, model, width, height, params, prior_focal_length FROM cameras "
            "WHERE camera_id = (SELECT camera_id FROM images WHERE image_id = ?2)")
            .bind(1, next)
            .bind(2, number)
            .step();
        Statement(*this, "UPDATE images SET camera_id = ?1 WHERE image_id = ?2")
            .bind(1, next)
            .bind(2, number)
            .step();
        if (rigs) give_own_rig(number, next);
        ++next;
    }
}

void FeatureDatabase::give_own_rig(std::int64_t image, std::int64_t camera) {
    // A sensor of type 0 is a camera.
    Statement(*this, "INSERT INTO rigs (ref_sensor_id, ref_sensor_type) VALUES (?, 0)")
        .bind(1, camera)
        .step();
    Statement(*this,
              "UPDATE frames SET rig_id = (SELECT MAX(rig_id) FROM rigs) WHERE frame_id = "
              "(SELECT frame_id FROM frame_data WHERE data_id = ? AND sensor_type = 0)")
        .bind(1, image)
        .step();
    Statement(*this, "UPDATE frame_data SET sensor_id = ?1 WHERE data_id = ?2 AND sensor_type = 0")
        .bind(1, camera)
        .bind(2, image)
        .step();
}

void FeatureDatabase::visit_verified(
    const std::function<void(std::int64_t, std::int64_t, const std::vector<FeatureMatch>&)>& visit) const {
    const std::scoped_lock lock(mutex_);
    for (Statement rows(*this,
                        "SELECT rows, cols, data, pair_id FROM two_view_geometries WHERE rows > 0 ORDER BY "
                        "pair_id");
         rows.step();) {
        const auto places = rows.array<std::uint32_t>();
        std::vector<FeatureMatch> matches;
        for (size_t i = 0; i + 1 < places.size(); i += 2) matches.push_back({places[i], places[i + 1]});
        visit(rows.integer(3) / kMostImages, rows.integer(3) % kMostImages, matches);
    }
}

void FeatureDatabase::remove_verified(std::int64_t first, std::int64_t second) {
    const std::scoped_lock lock(mutex_);
    Statement(*this, "DELETE FROM two_view_geometries WHERE pair_id = ?")
        .bind(1, pair_of(first, second).number)
        .step();
}

void FeatureDatabase::remove_descriptors() {
    const std::scoped_lock lock(mutex_);
    execute("DELETE FROM descriptors");
}

void FeatureDatabase::commit() {
    const std::scoped_lock lock(mutex_);
    execute("COMMIT");
    execute("BEGIN");
}

}  // namespace ewa::capture
