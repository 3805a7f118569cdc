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
    /// Sets descriptors to zero, which match nothing, for features so near the right or lower border that VLFeat computes none.
    /// COLMAP stores uninitialised memory for these, which differs from run to run. Requires has_cameras().
    void clear_unwritten_descriptors();
    /// The descriptors of the image's features with the largest scales, at most `most`.
    Descriptors prominent(std::int64_t image, size_t most) const;

    /// Whether the database has matches of two images, or write() was called without matches and COLMAP has not read that yet.
    bool is_compared(std::int64_t first, std::int64_t second) const;
    /// Writes the matches of two images for COLMAP to verify.
    void write(std::int64_t first, std::int64_t second, const std::vector<FeatureMatch>& matches);
    /// Marks two images so that COLMAP does not compare them, until write() gives their matches.
    void pass_over(std::int64_t first, std::int64_t second);

    /// Whether the table of images states each image's camera.
    bool has_cameras() const;
    /// Whether each image belongs to a frame of a rig, as from COLMAP 3.12 on.
    bool has_rigs() const;
    /// Numbers the images in the order of their names. COLMAP numbers them in the order in which its threads finish. Call it before
    /// the first matches. Requires has_cameras() without has_rigs().
    void number_by_name();
    /// The focal lengths that EXIF gives, px, by image name. It has no entry for images without one.
    std::map<std::string, double> expected_focal_lengths() const;
    /// Gives each image a camera of its own, a copy of its shared one, and a rig of its own where there are rigs. Requires has_cameras().
    void give_own_cameras();
    /// Whether images share a camera.
    bool has_shared_cameras() const;
    /// Calls visit(first, second, matches) with the verified matches of each pair of images, in the order of COLMAP's pair ids.
    void visit_verified(const std::function<void(std::int64_t first, std::int64_t second,
                                                 const std::vector<FeatureMatch>&)>& visit) const;
    /// Removes the verified matches of these two images.
    void remove_verified(std::int64_t first, std::int64_t second);
    /// Removes the descriptors, which take most of the file's bytes.
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
    void give_own_rig(std::int64_t image, std::int64_t camera);
    void execute(const char* sql) const;

    mutable std::mutex mutex_;
    std::string name_;
    std::unique_ptr<sqlite3, int (*)(sqlite3*)> database_;
};

}  // namespace ewa::capture
