// SPDX-License-Identifier: Apache-2.0
// Finds the cameras of photos from one set of matches. Tries several settings of COLMAP (ways), and takes the best result.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "capture/colmap_program.h"
#include "capture/lens_check.h"
#include "capture/panoramas.h"
#include "capture/steps.h"

namespace ewa::capture {

/// The most photos for which a search gives the same result each time. Images are then numbered by name, and only one thread draws
/// random numbers.
constexpr size_t kSameEachTime = 200;

/// A model that a mapper has written.
struct MappedModel {
    std::filesystem::path folder;
    uint64_t images = 0;
};

/// The models in a folder, the largest first.
std::vector<MappedModel> models_in(const std::filesystem::path& folder);

/// A way to find the cameras of photos: settings of COLMAP's mapper.
struct Way {
    std::string name;  // text for the user, which follows "placed" and a count; empty: the first way
    std::vector<std::string> words{};  // options of COLMAP's mapper
    bool own_lenses = false;           // each photo has its own lens
    bool neighbours = false;           // use only matches of photos that follow each other
};

/// Facts about the matches and photos that decide which ways can be tried.
struct WayFacts {
    bool exif = false;    // most photos have a focal length by EXIF
    bool shared = false;  // photos share a lens, and may have their own
};

/// The ways to try after the first one, in order: those that cost little and place many photos come first.
std::vector<Way> other_ways(const WayFacts& facts);
/// The way with the options of `more` added.
Way with(const Way& way, const Way& more);
/// Whether two ways have equal settings, whatever their names.
bool is_same(const Way& first, const Way& second);

/// The result of a way.
struct Placing {
    Way way;
    std::vector<MappedModel> models{};  // the largest first
    Grade grade{};                      // of the largest
    double seconds = 0;
};

/// Places photos by the matches in the database of a folder.
class Mapping {
  public:
    /// views: the views of panoramas, whose lens is known, if `photos` has these; else null.
    Mapping(const Colmap& colmap, const Photos& photos, const PanoramaViews* views,
            std::filesystem::path work);

    /// Runs the mapper with one way's settings. Writes models into `folder`; none if the mapper finds no first pair of images.
    Placing place(const Way& way, const std::filesystem::path& folder) const;
    /// Tries this way, then others until enough photos are placed, then the best way with other random numbers. The models are in
    /// work/models. seconds: the time of the search so far; all ways together may take about as long.
    Placing place_enough(const Way& first, double seconds) const;
    /// Joins the largest model with others that share photos, if the joined cameras are possible.
    void join(Placing& placing) const;
    /// Adds photos with fewer matches to the largest model, if that adds no contradiction to its cameras.
    void extend(Placing& placing) const;
    /// The models in a folder.
    Placing placed_in(const Way& way, const std::filesystem::path& folder) const;

    /// Prints the result and the time of a way for the user.
    void say(const Placing& placing) const;
    const std::map<std::string, double>& expected() const { return expected_; }

  private:
    std::filesystem::path database_for(const Way& way) const;
    /// Runs the mapper with a way's settings, and with the further options `more`.
    void map(const Way& way, const std::filesystem::path& folder, const std::vector<std::string>& more) const;
    /// Grades a model, also by the matches in the database.
    Grade grade_in(const std::filesystem::path& model) const;
    /// Tries a way, and keeps it if it is better. Returns the seconds that it took.
    double try_way(Placing& best, const Way& way) const;
    /// The option of COLMAP's mapper for the first of its random numbers; empty if it has none.
    std::string seed_option() const;

    const Colmap& colmap_;
    const Photos& photos_;
    const PanoramaViews* views_;
    std::filesystem::path work_;
    std::map<std::string, double> expected_;  // focal lengths by EXIF, px
    WayFacts facts_;
};

}  // namespace ewa::capture
