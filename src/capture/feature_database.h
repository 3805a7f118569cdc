// SPDX-License-Identifier: Apache-2.0
// COLMAP's database: features of images, and matches between them. https://colmap.github.io/database.html
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "capture/matching.h"

struct sqlite3;

namespace ewa::capture {

/// The functions may be called from several threads. They throw RunError where the file cannot be read or written.
class FeatureDatabase {
  public:
    explicit FeatureDatabase(const std::filesystem::path& file);
    ~FeatureDatabase();
    FeatureDatabase(const FeatureDatabase&) = delete;
    FeatureDatabase& operator=(const FeatureDatabase&) = delete;

    /// Whether the tables are those that this class knows.
    bool is_known() const;
    /// The images' numbers by name.
    std::map<std::string, std::int64_t> images() const;
    /// The descriptors of an image, in the order of its features; empty if it has none.
    Descriptors descriptors(std::int64_t image) const;
    /// Those of the features with the largest scales, at most so many.
    Descriptors prominent(std::int64_t image, size_t most) const;

    /// Whether there are matches of two images, or `write` found none and COLMAP has not read that yet.
    bool is_compared(std::int64_t first, std::int64_t second) const;
    /// Writes the matches of two images for COLMAP to verify.
    void write(std::int64_t first, std::int64_t second, const std::vector<FeatureMatch>& matches);
    /// Has COLMAP pass over two images without comparing them, until `write` gives their matches.
    void pass_over(std::int64_t first, std::int64_t second);
    /// Makes what was written since the last call lasting, at once.
    void commit();

  private:
    class Statement;
    void execute(const char* sql) const;

    mutable std::mutex mutex_;
    std::string name_;
    std::unique_ptr<sqlite3, int (*)(sqlite3*)> database_;
};

}  // namespace ewa::capture
