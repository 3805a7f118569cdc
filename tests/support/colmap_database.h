// SPDX-License-Identifier: Apache-2.0
// A database as COLMAP 3.8 writes it, with the features of some images.
#pragma once
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <cstdint>
#include <string>
#include <vector>

namespace ewa::test {

struct DatabaseImage {
    std::string name;
    std::vector<std::uint8_t> descriptors;  // 128 a feature
    std::vector<float> scales;              // of the features
};

/// The images get the numbers 1, 2 ...
inline void write_colmap_database(const std::string& file, const std::vector<DatabaseImage>& images) {
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
    const auto run = [&](const std::string& sql, const void* data = nullptr, size_t bytes = 0) {
        sqlite3_stmt* statement = nullptr;
        ASSERT_EQ(sqlite3_prepare_v2(database, sql.c_str(), -1, &statement, nullptr), SQLITE_OK)
            << sqlite3_errmsg(database);
        if (data) sqlite3_bind_blob(statement, 1, data, int(bytes), SQLITE_TRANSIENT);
        EXPECT_EQ(sqlite3_step(statement), SQLITE_DONE) << sqlite3_errmsg(database);
        sqlite3_finalize(statement);
    };
    run("CREATE TABLE images (image_id INTEGER PRIMARY KEY NOT NULL, name TEXT NOT NULL UNIQUE)");
    for (const char* table : {"keypoints", "descriptors"})
        run(std::string("CREATE TABLE ") + table +
            " (image_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER NOT NULL, cols INTEGER NOT NULL, data "
            "BLOB)");
    run("CREATE TABLE matches (pair_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER NOT NULL, cols INTEGER NOT "
        "NULL, data BLOB)");
    run("CREATE TABLE two_view_geometries (pair_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER NOT NULL, cols "
        "INTEGER NOT NULL, data BLOB, config INTEGER NOT NULL, F BLOB, E BLOB, H BLOB, qvec BLOB, tvec "
        "BLOB)");
    for (size_t i = 0; i < images.size(); ++i) {
        const std::string number = std::to_string(i + 1), rows = std::to_string(images[i].scales.size());
        run("INSERT INTO images VALUES (" + number + ", '" + images[i].name + "')");
        std::vector<float> keypoints;  // x, y and a matrix
        for (const float scale : images[i].scales)
            keypoints.insert(keypoints.end(),
                             {1, 2, 0.6f * scale, -0.8f * scale, 0.8f * scale, 0.6f * scale});
        run("INSERT INTO keypoints VALUES (" + number + ", " + rows + ", 6, ?)", keypoints.data(),
            keypoints.size() * sizeof(float));
        run("INSERT INTO descriptors VALUES (" + number + ", " + rows + ", 128, ?)",
            images[i].descriptors.data(), images[i].descriptors.size());
    }
    sqlite3_close(database);
}

}  // namespace ewa::test
