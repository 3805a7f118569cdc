// SPDX-License-Identifier: Apache-2.0
// Cameras by COLMAP: features, matches, then a model. Each program's output is in log.txt, and gives the progress.
#include <algorithm>
#include <array>
#include <optional>
#include <regex>
#include <set>

#include "capture/comparing.h"
#include "capture/feature_database.h"
#include "capture/panoramas.h"
#include "capture/steps.h"
#include "core/atomic_file.h"
#include "core/file_reader.h"
#include "core/folders.h"
#include "core/process.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/image.h"
#include "io/datasets/image_records.h"

namespace ewa::capture {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostLine = 4096;  // bytes; COLMAP's own are shorter
constexpr int kBlock = 1225;        // pairs that COLMAP verifies before it says so
constexpr int kMostCompared =
    200;  // photos, the rest of which are compared with all where looks have not placed them
constexpr int kMostPanoramas = 50;  // 360° photos, all pairs of which are compared
constexpr int kNext = 2;            // photos that follow, which are compared whatever they look like
constexpr const char* kMostFeatures = "3000";  // of a view; a 360° photo has six
constexpr int kRounds = 2;                     // of a rig's bundle adjustment, each with new points
// COLMAP adjusts all cameras and points after each growth to 1.4 times, not to 1.1 times. The last adjustment gives as small
// errors: docs/capture.md has the figures. Models of few images count.
constexpr const char* kGlobalRatio = "1.4";
constexpr const char* kImagesRatio = "Mapper.ba_global_images_ratio";  // COLMAP 3.12 has frames
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
constexpr std::array kKnownLens{"--Mapper.ba_refine_focal_length", "0", "--Mapper.ba_refine_extra_params",
                                "0"};
constexpr const char* kOverlap =
    "photos need two thirds of their content in common with a neighbour, from another place";

/// COLMAP with its log and the meaning of its lines.
class Colmap {
  public:
    Colmap(const fs::path& work, const ProgressFunction& progress) : work_(work), progress_(progress) {}

    fs::path log() const { return work_ / "log.txt"; }
    std::string log_name() const { return core::one_line(log().string()); }

    /// The help of a command: names of options differ between releases.
    bool has_option(const std::string& command, const std::string& option) const {
        const core::Answer help = core::ask_program(
            {.command = {"colmap", command, "--help"}, .environment = {kNoDisplay}, .log = log()},
            [&] { return progress_({}); });
        if (help.ended == core::Ended::stopped) throw Stopped();
        if (help.cut && help.text.empty()) throw RunError("colmap " + command + " --help gives no answer");
        return help.text.find("--" + option + " ") != std::string::npos;
    }

    /// The option that has a matcher use a GPU, which COLMAP 3.13 has renamed.
    std::string gpu_of_matching(const std::string& command) const {
        return has_option(command, "FeatureMatching.use_gpu") ? "--FeatureMatching.use_gpu"
                                                              : "--SiftMatching.use_gpu";
    }

    /// Runs a program. done(line): the number of finished units after this line of the output, if it says so.
    void run(std::vector<std::string> command, const CaptureProgress& start,
             const std::function<std::optional<int>(const std::string&)>& done) const {
        CaptureProgress now = start;
        std::string rest;
        const std::string name = command[0] + (command[0] == "colmap" ? " " + command[1] : "");
        const core::Ended ended = core::run_program(
            {.command = std::move(command),
             .environment = {kNoDisplay},
             .log = log(),
             .output_to_log = true,
             .joined = true},  // COLMAP 3.9 reports on standard error
            [&](std::string_view piece) {
                for (size_t end; (end = piece.find('\n')) != std::string::npos;
                     piece.remove_prefix(end + 1)) {
                    rest += piece.substr(0, end);
                    now.done = std::max(now.done, std::min(done(rest).value_or(0), now.total));
                    rest.clear();
                }
                if (rest.size() < kMostLine) rest += piece;
                return progress_(now);
            });
        if (ended == core::Ended::stopped) throw Stopped();
        if (ended == core::Ended::failed) throw RunError(name + " failed; " + log_name() + " has its reason");
    }

  private:
    static constexpr const char* kNoDisplay = "QT_QPA_PLATFORM=offscreen";
    fs::path work_;
    const ProgressFunction& progress_;
};

/// Reads two numbers of a line, such as those of "Matching image [3/50]".
std::optional<std::pair<int, int>> numbers_in(const std::string& line, const std::regex& pattern) {
    std::smatch found;
    if (!std::regex_search(line, found, pattern)) return {};
    const auto number = [&](size_t i) {
        return found[i].matched ? core::parse_integer<int>(found[i].str()).value_or(0) : 0;
    };
    return std::pair(number(1), number(2));
}

void mark(const fs::path& file) {
    core::write_text_file(file, "");
}

/// A path that no program takes for an option.
std::string argument(const fs::path& path) {
    return fs::absolute(path).string();
}

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
    constexpr double kMostSide = 3200;  // px; COLMAP reduces longer ones
    constexpr double kEnough = 3e6;     // pixels: 2,600 features each million, of 8,192
    return std::ranges::all_of(names, [&](const fs::path& name) {
        const ImageSize size = read_image_size(folder / name);
        const double reduced = std::min(1.0, kMostSide / std::max({1, size.width, size.height}));
        return size.width * reduced * (size.height * reduced) >= kEnough;
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
                                           "--ImageReader.camera_model",
                                           group.tangential ? "OPENCV" : "SIMPLE_RADIAL"};
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
    if (core::is_file(work / "features.done")) return;
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
    mark(work / "features.done");
}

/// A list of COLMAP separates names by spaces.
bool has_white_space(const fs::path& name) {
    return name.string().find_first_of(" \t\r\n\v\f") != std::string::npos;
}

/// COLMAP verifies the matches of these pairs. listed: no name has white space; otherwise all others are passed over.
void verify(const Colmap& colmap, const Photos& photos, const std::vector<ImagePair>& pairs, bool listed,
            const fs::path& work) {
    const std::string command = listed ? "matches_importer" : "exhaustive_matcher";
    std::vector<std::string> words{
        "colmap", command, "--database_path", argument(work / "database.db"), colmap.gpu_of_matching(command),
        "0"};
    if (listed) {
        std::string text;
        for (const auto& [a, b] : pairs)
            text += photos.names[size_t(a)].string() + " " + photos.names[size_t(b)].string() + "\n";
        core::write_text_file(work / "pairs.txt", text);
        words.insert(words.end(),
                     {"--match_list_path", argument(work / "pairs.txt"), "--match_type", "pairs"});
    }
    static const std::regex pattern(R"(Matching block \[(\d+)/(\d+)\])");
    colmap.run(std::move(words), {CapturePhase::matches, "verified", "pairs", 0, int(pairs.size()), {}},
               [](const std::string& line) -> std::optional<int> {
                   const auto numbers = numbers_in(line, pattern);
                   return numbers ? std::optional(numbers->first * kBlock) : std::nullopt;
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
    if (core::is_file(done)) return;
    comparison.pass_over_others = std::ranges::any_of(photos.names, has_white_space);
    const auto compared = compare_photos(work / "database.db", photos.names, comparison, progress);
    verify(colmap, photos, compared.value_or(comparison.pairs), !comparison.pass_over_others, work);
    mark(done);
}

struct Model {
    fs::path folder;
    uint64_t images = 0;
};

/// The models that a mapper has written, the largest first.
std::vector<Model> models_in(const fs::path& folder) {
    std::vector<Model> models;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
        const fs::path images = entry.path() / "images.bin";
        if (!core::is_file(images)) continue;
        core::FileReader reader(images);
        models.push_back({entry.path(), reader.read<uint64_t>("number of images")});
    }
    std::sort(models.begin(), models.end(), [](const Model& a, const Model& b) {
        return a.images != b.images ? a.images > b.images : a.folder < b.folder;
    });
    return models;
}

/// views: the photos are such, whose lens is known.
std::vector<Model> map(const Colmap& colmap, const Photos& photos, const PanoramaViews* views,
                       const fs::path& work) {
    const fs::path folder = work / "models";
    fs::remove_all(folder);
    core::make_folder(folder);
    const bool glomap = !core::find_program("glomap").empty();
    std::vector<std::string> words{glomap ? "glomap" : "colmap",
                                   "mapper",
                                   "--database_path",
                                   argument(work / "database.db"),
                                   "--image_path",
                                   argument(photos.folder),
                                   "--output_path",
                                   argument(folder)};
    if (!glomap) words.insert(words.end(), kMapping.begin(), kMapping.end());
    if (!glomap && colmap.has_option("mapper", kImagesRatio))
        words.insert(words.end(), {"--" + std::string(kImagesRatio), kGlobalRatio});
    if (!glomap && views) words.insert(words.end(), kKnownLens.begin(), kKnownLens.end());
    static const std::regex pattern(R"(Registering image #\d+ \((\d+)\)|num_reg_frames=(\d+))");
    colmap.run(std::move(words),
               {CapturePhase::cameras, "placed", units(views), 0, int(photos.names.size()), {}},
               [](const std::string& line) -> std::optional<int> {
                   const auto numbers = numbers_in(line, pattern);
                   return numbers ? std::optional(std::max(numbers->first, numbers->second)) : std::nullopt;
               });
    return models_in(folder);
}

/// The models that a mapper makes. None where it finds no pair of images to begin with, which COLMAP's takes for a failure.
std::vector<Model> map_if_possible(const Colmap& colmap, const Photos& photos, const PanoramaViews* views,
                                   const fs::path& work) try {
    return map(colmap, photos, views, work);
} catch (const RunError&) {
    if (!core::is_folder(work / "models") || !models_in(work / "models").empty()) throw;
    return {};
}

/// The images in the largest model.
std::set<std::string> names_in(const std::vector<Model>& models) {
    std::set<std::string> names;
    if (!models.empty())
        for (const io::ImageRecord& image :
             io::read_colmap(io::colmap_model_in(models.front().folder)).images)
            names.insert(image.name);
    return names;
}

std::string sizes_text(const std::vector<Model>& models) {
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
    for (int round = 0; round < kRounds; ++round) {
        write_rig(poses.photos, views, start, rig);
        for (const fs::path& folder : {points, model}) {
            fs::remove_all(folder);
            core::make_folder(folder);
        }
        const CaptureProgress now{CapturePhase::cameras, "adjusted", "rounds", round, kRounds, {}};
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

}  // namespace

void require_colmap() {
    if (core::find_program("colmap").empty())
        throw RunError(
            "photos without cameras need COLMAP, which is not installed (Debian: apt install colmap)");
}

std::vector<std::string> place_photos(const Photos& given, const fs::path& work, const fs::path& model,
                                      const ProgressFunction& progress) {
    const Colmap colmap(work, progress);
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
    // Models from before a search was interrupted in the other comparisons.
    const fs::path before = work / "models_by_look";
    const bool resumed = core::is_folder(before);
    std::vector<Model> models = resumed ? models_in(before) : map_if_possible(colmap, photos, views, work);
    const std::set<std::string> placed = names_in(models);
    if (!views && given.pairing == Pairing::by_look && int(given.names.size()) <= kMostCompared) {
        // The comparisons that seemed needless may place the others.
        Comparison others;
        for (const ImagePair& pair : pairs_of(int(given.names.size()), Pairing::all))
            if (!placed.contains(given.names[size_t(pair.first)].string()) ||
                !placed.contains(given.names[size_t(pair.second)].string()))
                others.pairs.push_back(pair);
        if (!others.pairs.empty()) {
            if (!resumed) fs::rename(work / "models", before);
            match(colmap, photos, others, work, work / "other_matches.done", progress);
            models = map_if_possible(colmap, photos, views, work);
            if (names_in(models).size() < placed.size()) models = models_in(before);
        }
    }
    if (models.empty() || models.front().images < 2)
        throw InputError("COLMAP could not place the " + std::to_string(given.names.size()) +
                         " photos: too few of their details match; " + kOverlap + " (" + colmap.log_name() +
                         ")");
    std::vector<std::string> remarks;
    if (models.size() > 1 && models.front().images < photos.names.size())
        remarks.push_back(std::string("the ") + units(views) + " fall into " + std::to_string(models.size()) +
                          " separate models of " + sizes_text(models) + " " + units(views) +
                          ". The largest is used. Photos between them would join them");
    fs::path partial = model;
    partial += ".partial";
    fs::remove_all(partial);
    core::make_folder(partial);
    if (views) {
        const std::vector<std::string> more =
            model_of_panoramas(colmap, given, *views, models.front().folder, work, partial);
        remarks.insert(remarks.end(), more.begin(), more.end());
    } else {
        copy_model(models.front().folder, partial);
    }
    fs::rename(partial, model);
    return remarks;
}

}  // namespace ewa::capture
