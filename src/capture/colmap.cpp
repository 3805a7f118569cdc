// SPDX-License-Identifier: Apache-2.0
// Cameras by COLMAP: features, matches, then a model. Each program's output is in log.txt, and gives the progress.
#include <algorithm>
#include <array>
#include <chrono>
#include <optional>
#include <regex>
#include <set>

#include "capture/colmap_program.h"
#include "capture/comparing.h"
#include "capture/doubts.h"
#include "capture/feature_database.h"
#include "capture/lens_refinement.h"
#include "capture/mapping.h"
#include "capture/panoramas.h"
#include "capture/steps.h"
#include "capture/world_axes.h"
#include "core/atomic_file.h"
#include "core/file_reader.h"
#include "core/folders.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "ewa/image.h"

namespace ewa::capture {
namespace {

namespace fs = std::filesystem;

constexpr int kBlock = 1225;  // pairs that COLMAP verifies before it says so
constexpr int kMostCompared =
    200;  // photos, the rest of which are compared with all where looks have not placed them
constexpr int kMostPanoramas = 50;  // 360° photos, all pairs of which are compared
constexpr int kNext = 2;            // photos that follow, which are compared whatever they look like
constexpr const char* kMostFeatures = "3000";  // of a view; a 360° photo has six
constexpr int kRigRounds = 2;                  // of a rig's bundle adjustment, each with new points
constexpr std::array kKnownLens{"--Mapper.ba_refine_focal_length", "0", "--Mapper.ba_refine_extra_params",
                                "0"};
constexpr size_t kSamePairs = 2000;  // that one thread verifies, so that the same ones pass each time
constexpr double kNearlyAll = 0.9;   // of the photos that a surer way places
constexpr const char* kOverlap =
    "photos need two thirds of their content in common with a neighbour, from another place";

/// A part of the search, whose file says that it is done, and how long it took.
class Part {
  public:
    explicit Part(fs::path file) : file_(std::move(file)) {}
    bool is_done() const { return core::is_file(file_); }
    void mark() const {
        const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start_;
        core::write_text_file(file_, std::to_string(taken.count()) + "\n");
    }
    /// 0 where it is not known.
    double seconds() const {
        return is_done() ? core::parse_number(core::trim(core::read_text_file(file_))).value_or(0) : 0;
    }

  private:
    fs::path file_;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

const char* units(const PanoramaViews* views) {
    return views ? "views" : "photos";
}

/// The options of COLMAP for a group of photos.
struct LensWords {
    std::vector<fs::path> photos;
    std::vector<std::string> words;
};

/// Whether the photos have so many pixels that COLMAP finds all the features that it keeps without enlarging them. Enlarged, they
/// take three times as long.
bool are_large(const fs::path& folder, const std::vector<fs::path>& names) {
    constexpr double kMostSide = 3200;     // px; COLMAP reduces longer ones
    constexpr double kEnoughPixels = 3e6;  // pixels: 2,600 features each million, of 8,192
    return std::ranges::all_of(names, [&](const fs::path& name) {
        const ImageSize size = read_image_size(folder / name);
        const double reduced = std::min(1.0, kMostSide / std::max({1, size.width, size.height}));
        return size.width * reduced * (size.height * reduced) >= kEnoughPixels;
    });
}

std::vector<LensWords> lens_words(const Photos& photos, const PanoramaViews* views) {
    std::vector<LensWords> all;
    if (views)
        for (const auto& [width_and_k, names] : views->cameras) {
            const std::string half = std::to_string(0.5 * width_and_k.first);
            all.push_back({names,
                           {"--ImageReader.single_camera", "1", "--ImageReader.camera_model", "PINHOLE",
                            "--ImageReader.camera_params", half + "," + half + "," + half + "," + half,
                            "--SiftExtraction.max_num_features", kMostFeatures}});
        }
    else
        for (LensGroup& group : lenses_of(photos.folder, photos.names)) {
            std::vector<std::string> words{"--ImageReader.single_camera", group.shared ? "1" : "0",
                                           "--ImageReader.camera_model", "SIMPLE_RADIAL"};
            if (are_large(photos.folder, group.photos))
                words.insert(words.end(), {"--SiftExtraction.first_octave", "0"});
            all.push_back({std::move(group.photos), std::move(words)});
        }
    return all;
}

/// A run for each lens: the option that lets photos share a camera holds for a whole run. views: those that the photos are; null:
/// they are none.
void extract_features(const Colmap& colmap, const Photos& photos, const PanoramaViews* views,
                      const fs::path& work) {
    const Part part(work / "features.done");
    if (part.is_done()) return;
    // COLMAP 3.13 has moved the option.
    const std::string gpu = colmap.has_option("feature_extractor", "FeatureExtraction.use_gpu")
                                ? "--FeatureExtraction.use_gpu"
                                : "--SiftExtraction.use_gpu";
    static const std::regex pattern(R"(Processed file \[(\d+)/(\d+)\])");
    int before = 0;
    // COLMAP passes over those that an interrupted search has done.
    std::set<fs::path> known;
    if (core::is_file(work / "database.db"))
        if (const FeatureDatabase database(work / "database.db"); database.is_known())
            for (const auto& [name, number] : database.images()) known.insert(name);
    for (const LensWords& group : lens_words(photos, views)) {
        const auto done =
            std::ranges::count_if(group.photos, [&](const fs::path& name) { return known.contains(name); });
        std::string list;
        for (const fs::path& name : group.photos) list += name.string() + "\n";
        core::write_text_file(work / "photos.txt", list);
        std::vector<std::string> words{
            "colmap",       "feature_extractor",     "--database_path",   argument(work / "database.db"),
            "--image_path", argument(photos.folder), "--image_list_path", argument(work / "photos.txt")};
        words.insert(words.end(), group.words.begin(), group.words.end());
        if (!photos.masks.empty())
            words.insert(words.end(), {"--ImageReader.mask_path", argument(photos.masks)});
        words.insert(words.end(), {gpu, "0"});
        colmap.run(std::move(words),
                   {CapturePhase::features,
                    "searched",
                    units(views),
                    before + int(done),
                    int(photos.names.size()),
                    {}},
                   [before](const std::string& line) -> std::optional<int> {
                       const auto numbers = numbers_in(line, pattern);
                       return numbers ? std::optional(before + numbers->first) : std::nullopt;
                   });
        before += int(group.photos.size());
    }
    if (FeatureDatabase database(work / "database.db"); photos.names.size() <= kSameEachTime &&
                                                        database.is_known() && database.has_cameras() &&
                                                        !database.has_rigs()) {
        database.clear_unwritten_descriptors();
        database.number_by_name();
        database.commit();
    }
    part.mark();
}

/// A list of COLMAP separates names by spaces.
bool has_white_space(const fs::path& name) {
    return name.string().find_first_of(" \t\r\n\v\f") != std::string::npos;
}

/// COLMAP verifies the matches of these pairs. listed: no name has white space; otherwise all others are passed over.
void verify(const Colmap& colmap, const Photos& photos, const std::vector<ImagePair>& pairs, bool listed,
            const fs::path& work) {
    const std::string command = listed ? "matches_importer" : "exhaustive_matcher",
                      option = colmap.options_of_matching(command);
    std::vector<std::string> words{
        "colmap", command, "--database_path", argument(work / "database.db"), option + "use_gpu", "0"};
    // Several threads share the pairs, and so the random numbers, in another way each time.
    if (pairs.size() <= kSamePairs) words.insert(words.end(), {option + "num_threads", "1"});
    if (listed) {
        std::string text;
        for (const auto& [a, b] : pairs)
            text += photos.names[size_t(a)].string() + " " + photos.names[size_t(b)].string() + "\n";
        core::write_text_file(work / "pairs.txt", text);
        words.insert(words.end(),
                     {"--match_list_path", argument(work / "pairs.txt"), "--match_type", "pairs"});
    }
    // COLMAP says the first at the end of a block, and COLMAP 4 the second at its start.
    static const std::regex pattern(R"(Matching block \[(\d+)/|Processing block \[(\d+)/)");
    colmap.run(std::move(words), {CapturePhase::matches, "verified", "pairs", 0, int(pairs.size()), {}},
               [](const std::string& line) -> std::optional<int> {
                   const auto numbers = numbers_in(line, pattern);
                   return numbers ? std::optional(std::max(numbers->first, numbers->second - 1) * kBlock)
                                  : std::nullopt;
               });
}

/// What is compared at first. The views of two 360° photos are all compared: few photos with each other, and many in sequence.
Comparison first_comparison(const Photos& photos, bool panoramas) {
    const int count = int(photos.names.size());
    if (panoramas) {
        Pairing pairing = photos.pairing;
        if (pairing == Pairing::by_look)
            pairing = count > kMostPanoramas ? Pairing::in_sequence : Pairing::all;
        return {.pairs = pairs_of_views(pairs_of(count, pairing))};
    }
    Comparison comparison{.pairs = pairs_of(count, photos.pairing),
                          .by_look = photos.pairing == Pairing::by_look};
    if (comparison.by_look)
        for (int i = 0; i < count; ++i)
            for (int k = i + 1; k <= std::min(i + kNext, count - 1); ++k)
                comparison.always.emplace_back(i, k);
    return comparison;
}

/// done: the file that says so.
void match(const Colmap& colmap, const Photos& photos, Comparison comparison, const fs::path& work,
           const fs::path& done, const ProgressFunction& progress) {
    const Part part(done);
    if (part.is_done()) return;
    comparison.pass_over_others = std::ranges::any_of(photos.names, has_white_space);
    const auto compared = compare_photos(work / "database.db", photos.names, comparison, progress);
    verify(colmap, photos, compared.value_or(comparison.pairs), !comparison.pass_over_others, work);
    part.mark();
}

std::string sizes_text(const std::vector<MappedModel>& models) {
    std::string text;
    for (size_t i = 0; i < models.size(); ++i) {
        if (i > 0) text += i + 1 == models.size() ? " and " : ", ";
        text += std::to_string(models[i].images);
    }
    return text;
}

/// Moves the views of each photo together. `model`: a folder for the model of all views; its points are new. Returns the poses.
RigPoses adjust_rig(const Colmap& colmap, const PanoramaViews& views, RigPoses poses, const fs::path& work,
                    const fs::path& model) {
    const fs::path start = work / "rig", rig = work / "rig.json", points = work / "rig_points";
    const bool adjusts = colmap.has_option("rig_bundle_adjuster", "rig_config_path");
    for (int round = 0; round < kRigRounds; ++round) {
        write_rig(poses.photos, views, start, rig);
        for (const fs::path& folder : {points, model}) {
            fs::remove_all(folder);
            core::make_folder(folder);
        }
        const CaptureProgress now{CapturePhase::cameras, "adjusted", "rounds", round, kRigRounds, {}};
        const auto nothing = [](const std::string&) { return std::nullopt; };
        std::vector<std::string> words{"colmap",          "point_triangulator",
                                       "--database_path", argument(work / "database.db"),
                                       "--image_path",    argument(views.photos.folder),
                                       "--input_path",    argument(start),
                                       "--output_path",   argument(adjusts ? points : model),
                                       "--clear_points",  "1"};
        words.insert(words.end(), kKnownLens.begin(), kKnownLens.end());
        colmap.run(std::move(words), now, nothing);
        if (!adjusts) break;
        colmap.run(
            {"colmap", "rig_bundle_adjuster", "--input_path", argument(points), "--output_path",
             argument(model), "--rig_config_path", argument(rig), "--estimate_rig_relative_poses", "0",
             "--RigBundleAdjustment.refine_relative_poses", "0", "--BundleAdjustment.refine_focal_length",
             "0", "--BundleAdjustment.refine_extra_params", "0"},
            now, nothing);
        poses.photos = rig_poses(model).photos;
    }
    return poses;
}

void copy_model(const fs::path& from, const fs::path& to) {
    for (const char* file : {"cameras.bin", "images.bin", "points3D.bin"})
        fs::copy_file(from / file, to / file);
}

/// The model of the photos, from that of their views. Returns remarks.
std::vector<std::string> model_of_panoramas(const Colmap& colmap, const Photos& photos,
                                            const PanoramaViews& views, const fs::path& views_model,
                                            const fs::path& work, const fs::path& model) {
    RigPoses poses = rig_poses(views_model);
    std::vector<std::string> remarks{"the photos show all directions: COLMAP has placed " +
                                     std::to_string(poses.views) + " of their " +
                                     std::to_string(views.photos.names.size()) + " views"};
    if (poses.photos.size() < 2)
        throw InputError("COLMAP has placed the views of the 360° photos inconsistently; " +
                         std::string(kOverlap) + " (" + colmap.log_name() + ")");
    if (poses.dropped > 0)
        remarks.push_back(std::to_string(poses.dropped) +
                          (poses.dropped == 1 ? " view disagrees" : " views disagree") +
                          " with others of the same photo");
    const fs::path adjusted = work / "rig_model";
    poses = adjust_rig(colmap, views, std::move(poses), work, adjusted);
    join_views(poses.photos, adjusted, photos, model);
    return remarks;
}

/// A way as a file keeps it: its name, what it changes, and a word in each line.
void write_way(const fs::path& file, const Way& way) {
    std::string text = way.name + "\n" + (way.own_lenses ? "own lenses" : "") + "\n";
    for (const std::string& word : way.words) text += word + "\n";
    core::write_text_file(file, text);
}

Way read_way(const fs::path& file) {
    Way way;
    if (!core::is_file(file)) return way;  // of an older search
    constexpr size_t kLongestWord = 4096;
    core::FileReader reader(file);
    std::string line;
    reader.read_line(way.name, kLongestWord);
    reader.read_line(line, kLongestWord);
    way.own_lenses = !line.empty();
    while (reader.read_line(line, kLongestWord)) way.words.push_back(line);
    return way;
}

/// Whether it takes little time to compare all photos.
bool are_few(const Photos& photos) {
    return photos.names.size() * (photos.names.size() - 1) / 2 <= kSamePairs;
}

/// The pairs of photos that may have been compared by looks alone: those with a photo that has no camera. All of few photos where not
/// enough are placed, since weak matches steady the cameras that hold the others.
Comparison other_pairs(const Photos& photos, const Placing& placing) {
    const size_t count = photos.names.size();
    const bool all = !is_enough(placing.grade, count) && are_few(photos);
    std::set<std::string> placed;
    if (!placing.models.empty() && !all)
        for (const auto& [id, image] : read_sparse(placing.models.front().folder).images)
            placed.insert(image.name);
    Comparison others;
    for (const ImagePair& pair : pairs_of(int(count), Pairing::all))
        if (!placed.contains(photos.names[size_t(pair.first)].string()) ||
            !placed.contains(photos.names[size_t(pair.second)].string()))
            others.pairs.push_back(pair);
    return others;
}

/// Places the photos by the first comparisons, then by those that seemed needless if these left some out. Where these take little
/// time, they come before other ways.
Placing place_by_matches(const Colmap& colmap, const Mapping& mapping, const Photos& photos, bool views,
                         const fs::path& work, const ProgressFunction& progress) {
    const double seconds = Part(work / "features.done").seconds() + Part(work / "matches.done").seconds();
    // Models from before a search was interrupted in the other comparisons.
    const fs::path before = work / "models_by_look";
    const bool resumed = core::is_folder(before);
    const bool by_look =
        !views && photos.pairing == Pairing::by_look && int(photos.names.size()) <= kMostCompared;
    Placing placing = resumed                      ? mapping.placed_in(read_way(before / "way"), before)
                      : by_look && are_few(photos) ? mapping.place({}, work / "models")
                                                   : mapping.place_enough({}, seconds);
    if (!by_look) return placing;
    const Comparison others = other_pairs(photos, placing);
    if (others.pairs.empty()) return placing;
    if (!resumed) {
        if (are_few(photos) && !is_enough(placing.grade, photos.names.size())) mapping.say(placing);
        write_way(work / "models" / "way", placing.way);
        fs::rename(work / "models", before);
    }
    match(colmap, photos, others, work, work / "other_matches.done", progress);
    Placing again = is_enough(placing.grade, photos.names.size())
                        ? mapping.place(placing.way, work / "models")
                        : mapping.place_enough(placing.way, seconds);
    return is_better(placing.grade, again.grade) ? mapping.placed_in(placing.way, before) : again;
}

/// Whether photos that follow each other are among those whose matches contradict their cameras.
bool neighbours_contradict(const std::vector<Contradiction>& contradictions) {
    return std::ranges::any_of(contradictions, &Contradiction::follows);
}

/// Things that look alike have matches, too. Where these have parted photos that follow each other, the matches of neighbours alone
/// are tried.
void part_lookalikes(const Mapping& mapping, Placing& placing, const FeatureDatabase& database,
                     const fs::path& work) {
    if (!neighbours_contradict(contradictions_in(read_sparse(placing.models.front().folder), database)))
        return;
    const Way way{.name = "by the matches of neighbours", .neighbours = true};
    Placing tried = mapping.place(with(placing.way, way), work / "models_of_neighbours");
    mapping.say(tried);
    if (tried.models.empty() || double(tried.grade.sound) < kNearlyAll * placing.grade.sound) return;
    if (!neighbours_contradict(contradictions_in(read_sparse(tried.models.front().folder), database)))
        placing = std::move(tried);
}

/// Completes the model of photos: a full lens where the photos determine it. Returns remarks on what may be wrong.
std::vector<std::string> complete(const Colmap& colmap, const Mapping& mapping, const Placing& placing,
                                  const FeatureDatabase& database, const fs::path& work,
                                  const fs::path& model) {
    std::vector<std::string> remarks;
    Grade grade = placing.grade;
    if (placing.way.own_lenses && grade.sound >= int(kLeastPhotos) && !grade.is_sound()) {
        std::set<std::string> names;
        for (const auto& [name, fault] : grade.faults) names.insert(name);
        remove_views(model, names);
        remarks.push_back(core::counted(names.size(), "photo") + " of " + std::to_string(grade.placed) +
                          " got a camera that cannot be right, and " +
                          std::string(core::is_or_are(names.size())) + " not used");
    }
    refine_lens(colmap, model, mapping.expected(), work);
    const SparseModel found = read_sparse(model);
    const std::vector<Station> stations = stations_of(found);
    std::vector<std::string> jumps;
    for (const size_t at : jumps_among(stations, matches_along(stations, database)))
        jumps.push_back(core::one_line(stations[at].name) + " to " + core::one_line(stations[at + 1].name));
    const std::vector<std::string> doubts =
        doubts_of(grade_of(found, mapping.expected()), contradictions_in(found, database),
                  strays_among(stations), jumps);
    remarks.insert(remarks.end(), doubts.begin(), doubts.end());
    return remarks;
}

}  // namespace

Found place_photos(const Photos& given, const fs::path& work, const fs::path& model, const fs::path& place,
                   const ProgressFunction& progress) {
    const Colmap colmap(work, given.python, progress);
    const fs::path views_folder = work / "views";
    // A search that has begun continues with the same images.
    std::optional<PanoramaViews> cut;
    if (core::is_folder(views_folder) ||
        (!core::is_file(work / "database.db") && are_panoramas(given.folder, given.names)))
        cut = views_of_panoramas(given, views_folder, progress);
    const PanoramaViews* views = cut ? &*cut : nullptr;
    const Photos& photos = views ? views->photos : given;
    extract_features(colmap, photos, views, work);
    match(colmap, photos, first_comparison(given, views != nullptr), work, work / "matches.done", progress);
    const Mapping mapping(colmap, photos, views, work);
    Placing placing = place_by_matches(colmap, mapping, given, views != nullptr, work, progress);
    if (placing.models.empty() || placing.models.front().images < 2)
        throw InputError("COLMAP could not place the " + std::to_string(given.names.size()) +
                         " photos: too few of their details match; " + kOverlap + " (" + colmap.log_name() +
                         ")");
    const FeatureDatabase database(work / "database.db");
    const bool checked = !views && database.is_known();
    if (checked) part_lookalikes(mapping, placing, database, work);
    mapping.join(placing);
    mapping.extend(placing);
    const std::vector<MappedModel>& models = placing.models;
    std::vector<std::string> remarks;
    if (models.size() > 1 && models.front().images < photos.names.size())
        remarks.push_back(std::string("the ") + units(views) + " fall into " + std::to_string(models.size()) +
                          " separate models of " + sizes_text(models) + " " + units(views) +
                          ". The largest is used. Photos between them would join them");
    fs::path partial = model;
    partial += ".partial";
    fs::remove_all(partial);
    core::make_folder(partial);
    std::vector<std::string> more;
    if (views) {
        more = model_of_panoramas(colmap, given, *views, models.front().folder, work, partial);
    } else {
        copy_model(models.front().folder, partial);
        if (checked) more = complete(colmap, mapping, placing, database, work, partial);
    }
    remarks.insert(remarks.end(), more.begin(), more.end());
    fs::remove(place);  // of an earlier model
    Found found{std::move(remarks),
                given.level ? set_world_axes(partial, given.folder, place) : std::string()};
    fs::rename(partial, model);
    return found;
}

}  // namespace ewa::capture
