// SPDX-License-Identifier: Apache-2.0
// COLMAP's database: features of images, and matches between them. https://colmap.github.io/database.html
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
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
    /// Sets descriptors to zero for features so near the right or lower border that VLFeat writes none. COLMAP stores uninitialised
    /// memory for them, which differs between searches. Zeros match nothing. Only with plain images.
    void clear_unwritten_descriptors();
    /// Those of the features with the largest scales, at most so many.
    Descriptors prominent(std::int64_t image, size_t most) const;

    /// Whether there are matches of two images, or `write` found none and COLMAP has not read that yet.
    bool is_compared(std::int64_t first, std::int64_t second) const;
    /// Writes the matches of two images for COLMAP to verify.
    void write(std::int64_t first, std::int64_t second, const std::vector<FeatureMatch>& matches);
    /// Has COLMAP pass over two images without comparing them, until `write` gives their matches.
    void pass_over(std::int64_t first, std::int64_t second);

    /// Whether each image has its camera in its own row, as up to COLMAP 3.11. Later ones have rigs and frames.
    bool has_plain_images() const;
    /// Numbers the images in the order of their names. COLMAP's order is that in which its threads have finished. Only before the
    /// first matches, and with plain images.
    void number_by_name();
    /// The focal lengths that EXIF gives, px, by the images' names. Images without one are not in it.
    std::map<std::string, double> expected_focal_lengths() const;
    /// Gives each image a camera of its own, with the values of the one that it shares. Only with plain images.
    void give_own_cameras();
    /// Whether images share a camera.
    bool has_shared_cameras() const;
    /// Calls visit(first, second, matches) with the verified matches of each pair, by the pairs' numbers.
    void visit_verified(const std::function<void(std::int64_t first, std::int64_t second,
                                                 const std::vector<FeatureMatch>&)>& visit) const;
    /// Removes the verified matches of these two images.
    void remove_verified(std::int64_t first, std::int64_t second);
    /// Removes the descriptors, which are most of a file.
    void remove_descriptors();

    /// Commits all that was written since the last call, in one transaction.
    void commit();

  private:
    class Statement;
    /// x, y: px, with the image's corner at 0. scale: that of COLMAP's detector; 0: not known.
    struct Feature {
        float x = 0, y = 0, scale = 0;
    };
    /// The features of an image with `count` descriptors.
    std::vector<Feature> features(std::int64_t image, size_t count) const;
    std::int64_t count(const char* sql) const;
    void execute(const char* sql) const;

    mutable std::mutex mutex_;
    std::string name_;
    std::unique_ptr<sqlite3, int (*)(sqlite3*)> database_;
};

}  // namespace ewa::capture
