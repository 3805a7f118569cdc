// SPDX-License-Identifier: Apache-2.0
// Views that the user saves under a number, and the film through them.
#pragma once
#include <cstdint>
#include <filesystem>
#include <vector>

#include "io/datasets/view_list.h"
#include "viewer/byte_image.h"

namespace ewa::viewer {

class SavedViews {
  public:
    explicit SavedViews(std::vector<io::NamedView> views) : views_(std::move(views)) {}

    const std::vector<io::NamedView>& all() const { return views_; }
    size_t size() const { return views_.size(); }
    /// Saves or replaces the view of this number.
    void save(size_t number, const Camera& camera, const glm::dvec3& pivot);
    void erase(size_t index);
    /// The view of this number, or null.
    const io::NamedView* find(size_t number) const;
    /// The smallest number from 1 without a view.
    size_t free_number() const;

  private:
    std::vector<io::NamedView> views_;
};

/// A film that is being written: frames along the path through saved views, one file each.
struct Film {
    static constexpr int kRate = 30;  // frames per second

    std::filesystem::path folder;
    std::vector<Camera> keys;  // at least one
    Size size;                 // of every frame, also if the window changes
    int frames = 0, next = 0;
    uint64_t waits_for = 0;  // serial of the frame that is being written; 0: none

    /// The keys are kRate * seconds frames apart; the first and last key are frames.
    Film(const SavedViews& views, const std::filesystem::path& folder, Size size, double seconds);
    bool finished() const { return next >= frames; }
    Camera camera() const;
    std::filesystem::path file() const;
};

}  // namespace ewa::viewer
