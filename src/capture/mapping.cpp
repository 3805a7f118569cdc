// SPDX-License-Identifier: Apache-2.0
#include "capture/mapping.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <set>

#include "capture/doubts.h"
#include "capture/feature_database.h"
#include "core/file_reader.h"
#include "core/folders.h"
#include "core/process.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::capture {
namespace {

namespace fs = std::filesystem;

// COLMAP adjusts all cameras and points after each growth to 1.4 times, not to 1.1 times. The last adjustment gives as small
// errors: docs/capture.md has the figures. Models of few images count.
constexpr const char* kGlobalRatio = "1.4";
constexpr std::array kRatioOfImages{"Mapper.ba_global_images_ratio",   // until COLMAP 3.11
                                    "Mapper.ba_global_frames_ratio"};  // later
constexpr std::array kMapping{"--Mapper.min_model_size",
                              "3",
                              "--Mapper.ba_global_points_ratio",
                              kGlobalRatio,
                              "--Mapper.ba_global_max_num_iterations",
                              "25",
                              "--Mapper.ba_global_max_refinements",
                              "2",
                              "--Mapper.ba_local_max_num_iterations",
                              "15"};
constexpr size_t kTriedAnyway = 2;  // ways that count on no time
constexpr int kSeeds = 4;           // of random numbers that are tried
constexpr int kFollowing = 10;      // photos, in the order of names, that are neighbours
constexpr int kLeastJoining = 3;    // photos of two models that are joined
// Of a photo with points, which the last photos need. COLMAP needs 30 of the others: with fewer, a wrong photo misplaces those after it.
constexpr const char* kFewMatches = "20";

const std::vector<std::string> kLensOfExif{"--Mapper.ba_refine_focal_length", "0",
                                           "--Mapper.ba_refine_extra_params", "0"};
const std::vector<std::string> kForward{"--Mapper.init_max_forward_motion", "1",
                                        "--Mapper.init_min_tri_angle", "4"};

std::set<std::string> names_of(const fs::path& model) {
    std::set<std::string> names;
    for (const auto& [id, image] : read_sparse(model).images) names.insert(image.name);
    return names;
}

}  // namespace

std::vector<MappedModel> models_in(const fs::path& folder) {
    std::vector<MappedModel> models;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
        const fs::path images = entry.path() / "images.bin";
        if (!core::is_file(images)) continue;
        core::FileReader reader(images);
        models.push_back({entry.path(), reader.read<uint64_t>("number of images")});
    }
    std::sort(models.begin(), models.end(), [](const MappedModel& a, const MappedModel& b) {
        return a.images != b.images ? a.images > b.images : a.folder < b.folder;
    });
    return models;
}

std::vector<Way> other_ways(const WayFacts& facts) {
    const Way exif{.name = "with the lens by EXIF", .words = kLensOfExif},
        own{.name = "with a lens for each photo", .own_lenses = true},
        forward{.name = "with forward motion", .words = kForward};
    if (facts.exif && facts.shared) return {exif, with(exif, forward), forward, own};
    if (facts.exif) return {exif, with(exif, forward), forward};
    if (facts.shared) return {own, forward, with(own, forward)};
    return {forward};
}

Way with(const Way& way, const Way& more) {
    Way both = way;
    both.name += (way.name.empty() ? "" : " and ") + more.name;
    both.words.insert(both.words.end(), more.words.begin(), more.words.end());
    both.own_lenses |= more.own_lenses;
    both.neighbours |= more.neighbours;
    return both;
}

bool is_same(const Way& first, const Way& second) {
    return first.words == second.words && first.own_lenses == second.own_lenses &&
           first.neighbours == second.neighbours;
}

Mapping::Mapping(const Colmap& colmap, const Photos& photos, const PanoramaViews* views, fs::path work)
    : colmap_(colmap), photos_(photos), views_(views), work_(std::move(work)) {
    const FeatureDatabase database(work_ / "database.db");
    if (views_ || !database.is_known() || !database.has_cameras()) return;
    expected_ = database.expected_focal_lengths();
    facts_.exif = 2 * expected_.size() > photos_.names.size();
    facts_.shared = database.has_shared_cameras();
}

fs::path Mapping::database_for(const Way& way) const {
    const fs::path whole = work_ / "database.db", changed = work_ / "changed.db";
    if (!way.own_lenses && !way.neighbours) return whole;
    fs::remove(changed);  // MinGW's library overwrites none
    fs::copy_file(whole, changed);
    FeatureDatabase database(changed);
    database.remove_descriptors();
    if (way.own_lenses) database.give_own_cameras();
    if (way.neighbours) {
        std::map<std::int64_t, int> place;
        for (const auto& [name, number] : database.images()) place.emplace(number, int(place.size()));
        std::vector<std::pair<std::int64_t, std::int64_t>> far;
        database.visit_verified([&](std::int64_t first, std::int64_t second, const auto&) {
            if (std::abs(place[first] - place[second]) > kFollowing) far.emplace_back(first, second);
        });
        for (const auto& [first, second] : far) database.remove_verified(first, second);
    }
    database.commit();
    return changed;
}

Placing Mapping::placed_in(const Way& way, const fs::path& folder) const {
    Placing placing{.way = way, .models = models_in(folder)};
    if (!placing.models.empty()) placing.grade = grade_in(placing.models.front().folder);
    return placing;
}

Grade Mapping::grade_in(const fs::path& model) const {
    const SparseModel read = read_sparse(model);
    Grade grade = grade_of(read, expected_);
    const FeatureDatabase database(work_ / "database.db");
    if (views_ || !database.is_known()) return grade;
    grade.contradictions = contradictions_in(read, database).size();
    const std::vector<Station> stations = stations_of(read);
    grade.parted = int(parted_by(jumps_among(stations, matches_along(stations, database)), stations.size()));
    return grade;
}

void Mapping::map(const Way& way, const fs::path& folder, const std::vector<std::string>& more) const {
    const bool glomap = way.words.empty() && more.empty() && !core::find_program("glomap").empty();
    std::vector<std::string> words{glomap ? "glomap" : "colmap",
                                   "mapper",
                                   "--database_path",
                                   argument(database_for(way)),
                                   "--image_path",
                                   argument(photos_.folder),
                                   "--output_path",
                                   argument(folder)};
    if (!glomap) {
        words.insert(words.end(), kMapping.begin(), kMapping.end());
        const auto* ratio = std::ranges::find_if(
            kRatioOfImages, [&](const char* name) { return colmap_.has_option("mapper", name); });
        if (ratio != kRatioOfImages.end())
            words.insert(words.end(), {"--" + std::string(*ratio), kGlobalRatio});
        if (!views_ && photos_.names.size() <= kSameEachTime)
            words.insert(words.end(), {"--Mapper.num_threads", "1"});
        if (views_) words.insert(words.end(), kLensOfExif.begin(), kLensOfExif.end());
        words.insert(words.end(), way.words.begin(), way.words.end());
        words.insert(words.end(), more.begin(), more.end());
    }
    static const std::regex pattern(R"(Registering image #\d+ \((\d+)\)|num_reg_frames=(\d+))");
    colmap_.run(
        std::move(words),
        {CapturePhase::cameras, "placed", views_ ? "views" : "photos", 0, int(photos_.names.size()), {}},
        [](const std::string& line) -> std::optional<int> {
            const auto numbers = numbers_in(line, pattern);
            return numbers ? std::optional(std::max(numbers->first, numbers->second)) : std::nullopt;
        });
}

Placing Mapping::place(const Way& way, const fs::path& folder) const {
    const auto start = std::chrono::steady_clock::now();
    fs::remove_all(folder);
    core::make_folder(folder);
    try {
        map(way, folder, {});
    } catch (const RunError&) {
        // COLMAP's mapper takes it for a failure that it finds no first pair.
        if (!core::is_folder(folder) || !models_in(folder).empty()) throw;
    }
    Placing placing = placed_in(way, folder);
    placing.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return placing;
}

void Mapping::say(const Placing& placing) const {
    const int seconds = int(placing.seconds + 0.5);
    std::string text = "placed " + std::to_string(placing.grade.placed) + " of " +
                       std::to_string(photos_.names.size()) + " photos";
    text += placing.way.name.empty() ? "" : " " + placing.way.name;
    text += " in " + std::to_string(seconds) + " s";
    if (placing.grade.sound < placing.grade.placed)
        text += "; " + std::to_string(placing.grade.placed - placing.grade.sound) + " cannot be right";
    if (placing.grade.parted > 0)
        text += "; " + std::to_string(placing.grade.parted) + " beyond a jump of the path";
    colmap_.say(text);
}

double Mapping::try_way(Placing& best, const Way& way) const {
    const fs::path folder = work_ / "models_tried", kept = work_ / "models";
    double seconds = 0;
    try {
        Placing tried = place(way, folder);
        seconds = tried.seconds;
        say(tried);
        if (is_better(tried.grade, best.grade)) {
            fs::remove_all(kept);
            fs::rename(folder, kept);
            tried.models = models_in(kept);
            best = std::move(tried);
        }
    } catch (const RunError&) {
        // The log has its reason, and there are models without it.
        if (best.models.empty()) throw;
    }
    fs::remove_all(folder);
    return seconds;
}

std::string Mapping::seed_option() const {
    for (const char* name : {"random_seed", "default_random_seed"})  // until COLMAP 3.11, and later
        if (colmap_.has_option("mapper", name)) return std::string("--") + name;
    return {};
}

Placing Mapping::place_enough(const Way& first, double seconds) const {
    Placing best = place(first, work_ / "models");
    const size_t photos = photos_.names.size();
    if (views_ || is_enough(best.grade, photos)) return best;
    say(best);
    const double most = seconds + best.seconds;
    double taken = 0;
    size_t tries = 0;
    const auto goes_on = [&] {
        return !is_enough(best.grade, photos) && (tries++ < kTriedAnyway || taken < most);
    };
    std::vector<Way> ways = other_ways(facts_);
    if (!is_same(first, {})) ways.insert(ways.begin(), Way{});
    for (const Way& way : ways)
        if (!is_same(first, way) && goes_on()) taken += try_way(best, way);
    if (is_enough(best.grade, photos)) return best;
    const std::string option = seed_option();
    const Way way = best.way;
    for (int seed = 1; !option.empty() && seed <= kSeeds && goes_on(); ++seed)
        taken += try_way(best, with(way, {.name = "with random numbers of seed " + std::to_string(seed),
                                          .words = {option, std::to_string(seed)}}));
    return best;
}

void Mapping::join(Placing& placing) const {
    if (views_ || placing.models.size() < 2) return;
    std::set<std::string> names = names_of(placing.models.front().folder);
    for (size_t i = 1; i < placing.models.size(); ++i) {
        const std::set<std::string> others = names_of(placing.models[i].folder);
        const auto shared =
            std::ranges::count_if(others, [&](const std::string& name) { return names.contains(name); });
        if (shared < kLeastJoining || size_t(shared) == others.size()) continue;
        const fs::path joined = work_ / "joined", filtered = work_ / "joined_points";
        for (const fs::path& folder : {joined, filtered}) {
            fs::remove_all(folder);
            core::make_folder(folder);
        }
        const CaptureProgress now{CapturePhase::cameras,      "joined", "models", int(i),
                                  int(placing.models.size()), {}};
        const auto nothing = [](const std::string&) { return std::nullopt; };
        const fs::path& largest = placing.models.front().folder;
        try {
            colmap_.run({"colmap", "model_merger", "--input_path1", argument(largest), "--input_path2",
                         argument(placing.models[i].folder), "--output_path", argument(joined)},
                        now, nothing);
            colmap_.run({"colmap", "point_filtering", "--input_path", argument(joined), "--output_path",
                         argument(filtered)},
                        now, nothing);
            const Grade grade = grade_in(filtered);
            if (!is_better(grade, placing.grade)) continue;
            fs::remove_all(largest);
            fs::rename(filtered, largest);
            placing.grade = grade;
            placing.models.front().images = uint64_t(grade.placed);
            names = names_of(largest);
        } catch (const RunError&) {
            continue;  // COLMAP could not align them
        } catch (const InputError&) {
            continue;
        }
    }
}

void Mapping::extend(Placing& placing) const {
    if (views_ || placing.models.empty() || size_t(placing.grade.placed) >= photos_.names.size()) return;
    const auto start = std::chrono::steady_clock::now();
    const fs::path extended = work_ / "extended", &largest = placing.models.front().folder;
    fs::remove_all(extended);
    core::make_folder(extended);
    try {
        map(placing.way, extended,
            {"--input_path", argument(largest), "--Mapper.abs_pose_min_num_inliers", kFewMatches});
    } catch (const RunError&) {
        return;  // the model is one without them
    }
    if (!core::is_file(extended / "images.bin")) return;
    Placing more{.way = {.name = "with fewer matches"}, .grade = grade_in(extended)};
    more.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    say(more);
    const bool worse = more.grade.contradictions > placing.grade.contradictions;
    if (more.grade.credible() <= placing.grade.credible() || worse) return;
    fs::remove_all(largest);
    fs::rename(extended, largest);
    placing.grade = more.grade;
    placing.models.front().images = uint64_t(more.grade.placed);
}

}  // namespace ewa::capture
