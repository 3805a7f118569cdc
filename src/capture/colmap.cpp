// SPDX-License-Identifier: Apache-2.0
// Cameras by COLMAP: features, matches, then a model. Each program's output is in log.txt, and gives the progress.
#include <algorithm>
#include <optional>
#include <regex>

#include "capture/steps.h"
#include "core/atomic_file.h"
#include "core/file_reader.h"
#include "core/folders.h"
#include "core/process.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::capture {
namespace {

namespace fs = std::filesystem;

constexpr int kLeastBlock = 4;  // photos
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
        std::string help;
        core::run_program(
            {.command = {"colmap", command, "--help"}, .environment = {kNoDisplay}, .log = log()},
            [&](std::string_view piece) {
                help += piece;
                return true;
            });
        return help.find("--" + option + " ") != std::string::npos;
    }

    /// Runs a program. done(line): the number of finished units after this line of the output, if it says so.
    void run(std::vector<std::string> command, const CaptureProgress& start,
             const std::function<std::optional<int>(const std::string&)>& done) const {
        CaptureProgress now = start;
        std::string rest;
        const std::string name = command[0] + (command[0] == "colmap" ? " " + command[1] : "");
        const core::Ended ended = core::run_program(
            {.command = std::move(command), .environment = {kNoDisplay}, .log = log(), .output_to_log = true},
            [&](std::string_view piece) {
                rest += piece;
                for (size_t end; (end = rest.find('\n')) != std::string::npos; rest.erase(0, end + 1))
                    now.done = std::max(now.done, std::min(done(rest.substr(0, end)).value_or(0), now.total));
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

/// A run for each lens: the option that lets photos share a camera holds for a whole run.
void extract_features(const Colmap& colmap, const Photos& photos, const fs::path& work) {
    if (core::is_file(work / "features.done")) return;
    // COLMAP 3.13 has moved the option.
    const std::string gpu = colmap.has_option("feature_extractor", "FeatureExtraction.use_gpu")
                                ? "--FeatureExtraction.use_gpu"
                                : "--SiftExtraction.use_gpu";
    static const std::regex pattern(R"(Processed file \[(\d+)/(\d+)\])");
    int before = 0;
    for (const LensGroup& group : lenses_of(photos.folder, photos.names)) {
        std::string list;
        for (const fs::path& name : group.photos) list += name.string() + "\n";
        core::write_text_file(work / "photos.txt", list);
        colmap.run({"colmap", "feature_extractor", "--database_path", argument(work / "database.db"),
                    "--image_path", argument(photos.folder), "--image_list_path",
                    argument(work / "photos.txt"), "--ImageReader.single_camera", group.shared ? "1" : "0",
                    "--ImageReader.camera_model", group.tangential ? "OPENCV" : "SIMPLE_RADIAL", gpu, "0"},
                   {CapturePhase::features, "searched", "photos", before, int(photos.names.size()), {}},
                   [before](const std::string& line) -> std::optional<int> {
                       const auto numbers = numbers_in(line, pattern);
                       return numbers ? std::optional(before + numbers->first) : std::nullopt;
                   });
        before += int(group.photos.size());
    }
    mark(work / "features.done");
}

/// The pairs of photos that COLMAP has compared after some of its steps. A step compares a block of photos with a block;
/// the blocks have `block` photos, the last one maybe fewer. Pairs that another step has are not among them.
std::vector<int> pairs_after_steps(int count, int block) {
    const int blocks = (count + block - 1) / block;
    std::vector<int> pairs{0};
    for (int i = 0; i < blocks; ++i)
        for (int j = 0; j < blocks; ++j) {
            int now = pairs.back();
            for (int a = i * block; a < std::min(count, (i + 1) * block); ++a)
                for (int b = j * block; b < std::min(count, (j + 1) * block); ++b)
                    now += (a > b && a % block <= b % block) || (a < b && a % block < b % block);
            pairs.push_back(now);
        }
    return pairs;
}

void match(const Colmap& colmap, const Photos& photos, const fs::path& work) {
    const fs::path done = work / "matches.done";
    if (core::is_file(done)) return;
    const std::string command = photos.in_sequence ? "sequential_matcher" : "exhaustive_matcher";
    const std::string gpu = colmap.has_option(command, "FeatureMatching.use_gpu")
                                ? "--FeatureMatching.use_gpu"
                                : "--SiftMatching.use_gpu";
    std::vector<std::string> words{"colmap", command, "--database_path", argument(work / "database.db"),
                                   gpu,      "0"};
    const int count = int(photos.names.size());
    if (photos.in_sequence) {
        // Neighbours, and images 2, 4, 8 ... 512 later, which close the loop of a walk round an object.
        for (const char* word :
             {"--SequentialMatching.overlap", "10", "--SequentialMatching.quadratic_overlap", "1"})
            words.emplace_back(word);
        static const std::regex pattern(R"(\[(\d+)/(\d+)\])");
        colmap.run(std::move(words), {CapturePhase::matches, "matched", "photos", 0, count, {}},
                   [](const std::string& line) -> std::optional<int> {
                       const auto numbers = numbers_in(line, pattern);
                       return numbers ? std::optional(numbers->first) : std::nullopt;
                   });
    } else {
        // Small blocks show the progress. COLMAP compares each block with each, and keeps five in memory.
        const int block = std::max(kLeastBlock, (count + 9) / 10), blocks = (count + block - 1) / block;
        words.insert(words.end(), {"--ExhaustiveMatching.block_size", std::to_string(block)});
        const std::vector<int> pairs = pairs_after_steps(count, block);
        static const std::regex pattern(R"(\[(\d+)/\d+, (\d+)/\d+\])");
        colmap.run(std::move(words), {CapturePhase::matches, "matched", "pairs", 0, pairs.back(), {}},
                   [&pairs, blocks](const std::string& line) -> std::optional<int> {
                       const auto numbers = numbers_in(line, pattern);
                       if (!numbers) return {};
                       // Newer releases print the line at the beginning of a step.
                       const bool over = line.find("] in ") != std::string::npos;
                       const int steps = (numbers->first - 1) * blocks + numbers->second - (over ? 0 : 1);
                       return pairs[size_t(std::clamp(steps, 0, int(pairs.size()) - 1))];
                   });
    }
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

std::vector<Model> map(const Colmap& colmap, const Photos& photos, const fs::path& work) {
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
    // By default COLMAP throws models of fewer than 10 images away.
    if (!glomap) words.insert(words.end(), {"--Mapper.min_model_size", "3"});
    static const std::regex pattern(R"(Registering image #\d+ \((\d+)\)|num_reg_frames=(\d+))");
    colmap.run(std::move(words), {CapturePhase::cameras, "placed", "photos", 0, int(photos.names.size()), {}},
               [](const std::string& line) -> std::optional<int> {
                   const auto numbers = numbers_in(line, pattern);
                   return numbers ? std::optional(std::max(numbers->first, numbers->second)) : std::nullopt;
               });
    return models_in(folder);
}

std::string sizes_text(const std::vector<Model>& models) {
    std::string text;
    for (size_t i = 0; i < models.size(); ++i) {
        if (i > 0) text += i + 1 == models.size() ? " and " : ", ";
        text += std::to_string(models[i].images);
    }
    return text;
}

}  // namespace

void require_colmap() {
    if (core::find_program("colmap").empty())
        throw RunError(
            "photos without cameras need COLMAP, which is not installed (Debian: apt install colmap)");
}

std::vector<std::string> place_photos(const Photos& photos, const fs::path& work, const fs::path& model,
                                      const ProgressFunction& progress) {
    const Colmap colmap(work, progress);
    extract_features(colmap, photos, work);
    match(colmap, photos, work);
    std::vector<Model> models;
    try {
        models = map(colmap, photos, work);
    } catch (const RunError&) {
        // COLMAP's mapper fails, too, where it finds no pair of images to begin with.
        if (!core::is_folder(work / "models") || !models_in(work / "models").empty()) throw;
    }
    if (models.empty() || models.front().images < 2)
        throw InputError("COLMAP could not place the " + std::to_string(photos.names.size()) +
                         " photos: too few of their details match; " + kOverlap + " (" + colmap.log_name() +
                         ")");
    std::vector<std::string> remarks;
    if (models.size() > 1 && models.front().images < photos.names.size())
        remarks.push_back("the photos fall into " + std::to_string(models.size()) + " separate models of " +
                          sizes_text(models) +
                          " photos. The largest is used. Photos between them would join them");
    fs::path partial = model;
    partial += ".partial";
    fs::remove_all(partial);
    core::make_folder(partial);
    for (const char* file : {"cameras.bin", "images.bin", "points3D.bin"})
        fs::copy_file(models.front().folder / file, partial / file);
    fs::rename(partial, model);
    return remarks;
}

}  // namespace ewa::capture
