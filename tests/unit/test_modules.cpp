// SPDX-License-Identifier: Apache-2.0
// Each module of the program may include only what the table of docs/ARCHITECTURE.md allows.
#include <algorithm>
#include <fstream>
#include <map>
#include <set>

#include "support/temp_folder.h"

namespace {

namespace fs = std::filesystem;
using Modules = std::set<std::string>;

/// The words of a text that stand between backticks, without a slash at the end.
std::vector<std::string> quoted(const std::string& text) {
    std::vector<std::string> words;
    for (size_t begin = text.find('`'); begin != std::string::npos; begin = text.find('`', begin)) {
        const size_t end = text.find('`', ++begin);
        words.push_back(text.substr(begin, end - begin));
        if (words.back().ends_with('/')) words.back().pop_back();
        begin = end + 1;
    }
    return words;
}

/// What each module may include directly: the table of modules in docs/ARCHITECTURE.md. A module that may include everything may
/// include no other such module, and none of check/.
std::map<std::string, Modules> read_table() {
    std::ifstream file(EWA_SOURCE_DIR "/docs/ARCHITECTURE.md");
    std::map<std::string, Modules> table;
    Modules open;
    for (std::string line; std::getline(file, line) && line != "## Data flow";) {
        if (!line.starts_with("| `") || line.starts_with("| `python/ewa/")) continue;
        const std::string allowed = line.substr(line.rfind('|', line.size() - 2));
        const bool all = allowed.find("everything") != std::string::npos;
        for (const std::string& module : quoted(line.substr(0, line.find('|', 1)))) {
            Modules& may = table[module];
            if (all) open.insert(module);
            for (const std::string& other : quoted(all ? "" : allowed))
                may.insert(other.starts_with("shaders/") || other.starts_with("check/") ? other
                                                                                        : "src/" + other);
        }
    }
    for (auto& [module, may] : table) {
        const bool has_all_of_io = may.erase("src/io") > 0;
        for (const auto& [other, unused] : table)
            if (open.contains(module) ? !open.contains(other) && !other.starts_with("check/")
                                      : has_all_of_io && other.starts_with("src/io/"))
                may.insert(other);
    }
    return table;
}

const std::map<std::string, Modules>& allowed() {
    static const std::map<std::string, Modules> table = read_table();
    return table;
}

/// Modules whose files have no order yet. In the others, each includes only files before it.
const Modules kUnordered = {"src/gpu", "src/capture", "check/bench"};

/// The module whose promises a public header declares; those not named here are plain values that any module may
/// use.
const std::map<std::string, std::string> kOwners = {
    {"image.h", "src/image"},       {"metrics.h", "src/image"},     {"camera.h", "src/scene"},
    {"gaussians.h", "src/scene"},   {"dataset.h", "src/scene"},     {"splat_files.h", "src/io/splats"},
    {"device.h", "src/gpu"},        {"gpu_interop.h", "src/gpu"},   {"log.h", "src/core"},
    {"splat_edit.h", "src/scene"},  {"renderer.h", "src/pipeline"}, {"operators.h", "src/operators"},
    {"ranks.h", "src/ranks"},       {"trainer.h", "src/train"},     {"training_needs.h", "src/train"},
    {"step_report.h", "src/train"}, {"evaluation.h", "src/run"},    {"run_options.h", "src/run"},
    {"run.h", "src/run"},           {"run_observer.h", "src/run"},  {"synthetic_dataset.h", "src/pathtracer"},
    {"capture.h", "src/capture"}};

/// Libraries that only some modules or headers may know.
const std::vector<std::pair<std::string, Modules>> kLibraries = {
    {"OpenImageIO/", {"src/openimageio"}},
    {"mpi.h", {"src/mpi"}},
    {"openvdb/", {"src/meshing"}},
    {"meshoptimizer", {"src/meshing"}},
    {"png.h", {"src/image"}},
    {"jpeglib.h", {"src/image"}},
    {"jerror.h", {"src/image"}},
    {"vulkan/",
     {"src/gpu", "src/passes", "src/pipeline", "src/viewer", "python/bindings", "include/ewa/gpu_interop.h"}},
    {"GLFW/", {"src/viewer"}},
    {"imgui", {"src/viewer"}},
    {"httplib.h", {"src/live"}},
    {"nanoflann", {"src/scene"}},
    {"tiny_gltf", {"src/io/gltf"}},
    {"pugixml", {"src/io/datasets"}},
    {"sqlite3.h", {"src/capture"}},
    {"zstd", {"src/io/splats"}},
    {"zlib", {"src/edit", "src/image", "src/io/splats", "src/portions", "src/train"}},
    {"nlohmann/",
     {"src/core", "src/edit", "src/folders", "src/image", "src/capture", "src/io/splats", "src/io/datasets",
      "src/io/gltf", "src/pathtracer", "src/run", "src/report", "src/live", "check/bench", "src/cli",
      "src/viewer", "python/bindings"}},
    {"CLI/", {"src/options", "src/cli", "src/viewer", "check/bench"}}};

Modules reached_from(const std::string& module) {
    Modules reached = {module}, next = {module};
    while (!next.empty()) {
        Modules found;
        for (const std::string& from : next)
            for (const std::string& to : allowed().at(from))
                if (reached.insert(to).second) found.insert(to);
        next = found;
    }
    return reached;
}

/// The folder whose dependencies count for a path in the source tree: its first two parts, e.g. "src/core", or
/// three below src/io, e.g. "src/io/splats"; "include/ewa" for a public header.
std::string module_of(const fs::path& path) {
    auto part = path.begin();
    std::string module = part->string() + "/" + std::next(part)->string();
    if (module == "src/io") module += "/" + std::next(part, 2)->string();
    return module;
}

/// What the include names, as a path in the source tree; empty for a file of a library.
fs::path resolve(const fs::path& root, const fs::path& from, const std::string& included) {
    for (const fs::path& folder :
         {from.parent_path(), fs::path("src"), fs::path("check"), fs::path("include"), fs::path("shaders")}) {
        const fs::path candidate = (folder / included).lexically_normal();
        if (fs::is_regular_file(root / candidate)) return candidate;
    }
    return {};
}

/// Why `from` may not include it, or nothing.
std::string complaint(const fs::path& root, const fs::path& from, const std::string& included) {
    const std::string module = module_of(from);
    const fs::path target = resolve(root, from, included);
    if (target.empty()) {
        for (const auto& [library, modules] : kLibraries)
            if (included.starts_with(library) && !modules.contains(module) &&
                !modules.contains(from.string()))
                return module + " may not use " + included;
        return {};
    }
    std::string other = module_of(target);
    if (module == "include/ewa")
        return other == module ? "" : "a public header may not include " + target.string();
    if (!allowed().contains(module)) return "docs/ARCHITECTURE.md lacks the module " + module;
    if (other == "include/ewa") {
        const auto owner = kOwners.find(target.filename().string());
        if (owner == kOwners.end()) return {};
        other = owner->second;
    }
    return reached_from(module).contains(other) ? "" : module + " may not include " + target.string();
}

/// The file that a line includes; empty if it includes none.
std::string included_by(const std::string& line) {
    const size_t word = line.find_first_not_of(" \t");
    if (word == std::string::npos || line[word] != '#' || line.find("include", word) == std::string::npos)
        return {};
    const size_t begin = line.find_first_of("\"<", word);
    const size_t end = begin == std::string::npos ? begin : line.find_first_of("\">", begin + 1);
    return end == std::string::npos ? std::string() : line.substr(begin + 1, end - begin - 1);
}

/// A source file, its header and its public header are one unit. Empty for a file of a module that needs no order.
std::string ordered_unit(const fs::path& path) {
    std::string module = module_of(path);
    const auto owner = kOwners.find(path.filename().string());
    if (module == "include/ewa" && owner != kOwners.end()) module = owner->second;
    return module == "include/ewa" || kUnordered.contains(module) ? "" : module + "/" + path.stem().string();
}

using Units = std::map<std::string, std::set<std::string>>;

/// A unit on a circle of includes, or nothing.
std::string on_a_circle(Units includes) {
    const auto is_last = [&](const auto& unit) {
        return std::ranges::none_of(unit.second, [&](const std::string& u) { return includes.contains(u); });
    };
    while (!includes.empty()) {
        const auto last = std::ranges::find_if(includes, is_last);
        if (last == includes.end()) return includes.begin()->first;
        includes.erase(last);
    }
    return {};
}

std::vector<std::string> complaints(const fs::path& root, size_t& files) {
    std::vector<std::string> found;
    Units units;
    for (const char* top : {"src", "check", "include", "shaders", "python/bindings"}) {
        if (!fs::is_directory(root / top)) continue;
        for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
            if (!entry.is_regular_file()) continue;
            ++files;
            const fs::path from = fs::relative(entry.path(), root);
            std::ifstream file(entry.path());
            int number = 0;
            for (std::string line; std::getline(file, line);) {
                ++number;
                const std::string included = included_by(line);
                if (included.empty()) continue;
                const std::string text = complaint(root, from, included);
                if (!text.empty())
                    found.push_back(from.string() + ":" + std::to_string(number) + ": " + text);
                const fs::path target = resolve(root, from, included);
                const std::string unit = ordered_unit(from),
                                  other = target.empty() ? "" : ordered_unit(target);
                if (!unit.empty() && !other.empty() && other != unit && module_of(from) != "include/ewa")
                    units[unit].insert(other);
            }
        }
    }
    const std::string circle = on_a_circle(std::move(units));
    if (!circle.empty()) found.push_back(circle + " is on a circle of includes, or includes one");
    return found;
}

TEST(Modules, IncludeOnlyWhatTheyMay) {
    size_t files = 0;
    for (const std::string& text : complaints(EWA_SOURCE_DIR, files)) ADD_FAILURE() << text;
    EXPECT_GT(files, 30u);
}

TEST(Modules, TheTableIsRead) {
    EXPECT_GT(allowed().size(), 25u);
    EXPECT_EQ(allowed().at("src/core"), Modules{"src/platform"});
    EXPECT_EQ(allowed().at("src/platform"), Modules());
    EXPECT_EQ(allowed().at("src/run"), (Modules{"src/train", "src/io/splats", "src/io/datasets",
                                                "src/io/gltf", "src/io/meshes", "src/report"}));
    EXPECT_TRUE(allowed().at("python/bindings").contains("src/run"));
    EXPECT_FALSE(allowed().at("src/viewer").contains("src/cli"));
    EXPECT_FALSE(allowed().at("src/cli").contains("check/bench"));
    EXPECT_TRUE(allowed().at("check/bench").contains("check/reference"));
}

TEST(Modules, CirclesOfIncludesAreFound) {
    EXPECT_EQ(on_a_circle({{"a", {"b"}}, {"b", {"c"}}, {"d", {"a", "c"}}}), "");
    EXPECT_EQ(on_a_circle({{"b", {"c"}}, {"c", {"d"}}, {"d", {"b"}}}), "b");
}

TEST(Modules, ForbiddenIncludesAreFound) {
    const ewa::test::TempFolder folder;
    folder.write("include/ewa/image.h", "#include <vector>\n");
    folder.write("include/ewa/trainer.h", "#include \"ewa/image.h\"\n");
    folder.write("include/ewa/wrong.h", "#include \"core/a.h\"\n");
    folder.write("src/core/a.h", "#include <string>\n");
    folder.write("src/core/wrong.h", "#  include \"io/splats/a.h\"\n");
    folder.write("src/core/wrong_public.h", "#include \"ewa/image.h\"\n");
    folder.write("src/io/splats/a.h", "#include \"core/a.h\"\n#include \"ewa/image.h\"\n");
    folder.write("src/io/splats/wrong.cpp", "#include \"../../run/a.h\"\n");
    folder.write("src/io/splats/wrong_library.cpp", "#include <vulkan/vulkan.h>\n");
    folder.write("src/run/a.h", "#include \"io/splats/a.h\"\n");
    folder.write("src/train/wrong.h", "#include \"run/a.h\"\n");
    folder.write("src/ranks/a.h", "");
    folder.write("src/portions/a.h", "#include \"ranks/a.h\"\n");
    folder.write("src/pipeline/wrong.h", "#include \"ranks/a.h\"\n");
    folder.write("src/cellar/wrong.h", "#include \"core/a.h\"\n");
    folder.write("src/cli/main.cpp", "#include \"run/a.h\"\n#include \"io/splats/a.h\"\n");
    folder.write("src/cli/wrong.cpp", "#include <GLFW/glfw3.h>\n");
    folder.write("src/cli/a.h", "#include \"run/a.h\"\n");
    folder.write("src/cli/wrong_bench.cpp", "#include \"bench/a.h\"\n");
    folder.write("check/bench/a.h", "#include \"reference/a.h\"\n");
    folder.write("check/reference/a.h", "#include \"core/a.h\"\n");
    folder.write("check/reference/wrong.h", "#include \"bench/a.h\"\n");
    folder.write("src/viewer/wrong.cpp", "#include \"cli/a.h\"\n");
    folder.write("src/train/wrong_circle.h", "#include \"train/wrong_end.h\"\n");
    folder.write("src/train/wrong_end.cpp", "#include \"train/wrong_circle.h\"\n");
    folder.write("src/train/wrong_end.h", "");
    folder.write("python/bindings/png.h", "#include \"run/a.h\"\n");
    folder.write("python/bindings/a.cpp", "#include \"png.h\"\n");
    folder.write("python/bindings/wrong.cpp", "#include \"cli/a.h\"\n");
    folder.write("shaders/shared/a.h", "");
    folder.write("shaders/lib/a.glsl", "#include \"../shared/a.h\"\n");
    folder.write("shaders/lib/wrong.glsl", "#include \"passes/a.comp\"\n");
    folder.write("shaders/passes/a.comp", "#include \"lib/a.glsl\"\n");
    size_t files = 0;
    const std::vector<std::string> found = complaints(folder.path(), files);
    EXPECT_EQ(files, 33u);
    for (const std::string& text : found) EXPECT_NE(text.find("wrong"), std::string::npos) << text;
    EXPECT_EQ(found.size(), 15u);
}

}  // namespace
