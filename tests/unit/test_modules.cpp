// SPDX-License-Identifier: Apache-2.0
// Each module of the program may include only what its entry below allows (docs/ARCHITECTURE.md).
#include <algorithm>
#include <fstream>
#include <map>
#include <set>

#include "support/temp_folder.h"

namespace {

namespace fs = std::filesystem;
using Modules = std::set<std::string>;

/// What each module may include directly. It may also include what those may include.
const std::map<std::string, Modules> kAllowed = {
    {"shaders/shared", {}},
    {"shaders/lib", {"shaders/shared"}},
    {"shaders/passes", {"shaders/lib", "shaders/shared"}},
    {"src/core", {}},
    {"src/image", {"src/core", "shaders/shared"}},
    {"src/openimageio", {"src/image"}},
    {"src/scene", {"src/core", "src/image", "shaders/shared"}},
    {"src/io/gltf", {"src/scene", "src/image"}},
    {"src/io/splats", {"src/scene", "src/io/gltf", "shaders/shared"}},
    {"src/io/datasets", {"src/scene", "src/image", "src/io/splats"}},
    {"src/capture", {"src/image", "src/io/datasets"}},
    {"src/gpu", {"src/core"}},
    {"src/passes", {"src/gpu", "shaders/shared"}},
    {"src/ranks", {"src/core"}},
    {"src/mpi", {"src/ranks"}},
    {"src/pipeline", {"src/passes", "src/scene"}},
    {"src/portions", {"src/pipeline", "src/ranks"}},
    {"src/operators", {"src/pipeline"}},
    {"src/pathtracer", {"src/passes", "src/scene", "src/io/gltf", "src/io/datasets"}},
    {"src/train", {"src/portions", "src/scene"}},
    {"src/run", {"src/train", "src/io/splats", "src/io/datasets", "src/report"}},
    {"src/report", {"src/scene", "src/image"}},
    {"src/live", {"src/report", "src/io/splats"}},
    {"src/reference", {"src/scene", "src/pathtracer"}},
    {"src/bench", {"src/pipeline", "src/reference", "src/report", "src/scene"}},
};
const Modules kLeaves = {"src/cli", "src/viewer"};

/// The module whose promises a public header declares; those not named here are plain values that any module may
/// use.
const std::map<std::string, std::string> kOwners = {
    {"image.h", "src/image"},       {"metrics.h", "src/image"},
    {"camera.h", "src/scene"},      {"gaussians.h", "src/scene"},
    {"dataset.h", "src/scene"},     {"splat_files.h", "src/io/splats"},
    {"device.h", "src/gpu"},        {"splat_edit.h", "src/scene"},
    {"renderer.h", "src/pipeline"}, {"operators.h", "src/operators"},
    {"ranks.h", "src/ranks"},       {"trainer.h", "src/train"},
    {"evaluation.h", "src/run"},    {"run_options.h", "src/run"},
    {"run.h", "src/run"},           {"synthetic_dataset.h", "src/pathtracer"},
    {"capture.h", "src/capture"}};

/// Libraries that only some modules may know.
const std::vector<std::pair<std::string, Modules>> kLibraries = {
    {"OpenImageIO/", {"src/openimageio"}},
    {"mpi.h", {"src/mpi"}},
    {"png.h", {"src/image"}},
    {"jpeglib.h", {"src/image"}},
    {"jerror.h", {"src/image"}},
    {"vulkan/", {"src/gpu", "src/passes", "src/pipeline", "src/viewer"}},
    {"GLFW/", {"src/viewer"}},
    {"imgui", {"src/viewer"}},
    {"httplib.h", {"src/live"}},
    {"nanoflann", {"src/scene"}},
    {"tiny_gltf", {"src/io/gltf"}},
    {"zstd", {"src/io/splats"}},
    {"zlib", {"src/io/splats", "src/portions", "src/train"}},
    {"nlohmann/",
     {"src/core", "src/image", "src/capture", "src/io/splats", "src/io/datasets", "src/io/gltf",
      "src/pathtracer", "src/run", "src/report", "src/live", "src/bench", "src/cli", "src/viewer"}},
    {"CLI/", {"src/cli", "src/viewer", "src/bench"}}};

Modules reached_from(const std::string& module) {
    Modules reached = {module}, next = {module};
    while (!next.empty()) {
        Modules found;
        for (const std::string& from : next)
            for (const std::string& to : kAllowed.at(from))
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
         {from.parent_path(), fs::path("src"), fs::path("include"), fs::path("shaders")}) {
        const fs::path candidate = (folder / included).lexically_normal();
        if (fs::is_regular_file(root / candidate)) return candidate;
    }
    return {};
}

/// Why `from` may not include it, or nothing.
std::string complaint(const fs::path& root, const fs::path& from, const std::string& included) {
    const std::string module = module_of(from);
    for (const auto& [library, modules] : kLibraries)
        if (included.starts_with(library) && !modules.contains(module))
            return module + " may not use " + included;
    const fs::path target = resolve(root, from, included);
    if (target.empty()) return {};
    std::string other = module_of(target);
    if (kLeaves.contains(module))
        return kLeaves.contains(other) && other != module ? module + " may not include " + target.string()
                                                          : "";
    if (module == "include/ewa")
        return other == module ? "" : "a public header may not include " + target.string();
    if (!kAllowed.contains(module)) return "the module " + module + " has no entry in kAllowed";
    if (other == "include/ewa") {
        const auto owner = kOwners.find(target.filename().string());
        if (owner == kOwners.end()) return {};
        other = owner->second;
    }
    return reached_from(module).contains(other) ? "" : module + " may not include " + target.string();
}

std::vector<std::string> complaints(const fs::path& root, size_t& files) {
    std::vector<std::string> found;
    for (const char* top : {"src", "include", "shaders"}) {
        if (!fs::is_directory(root / top)) continue;
        for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
            if (!entry.is_regular_file()) continue;
            ++files;
            const fs::path from = fs::relative(entry.path(), root);
            std::ifstream file(entry.path());
            int number = 0;
            for (std::string line; std::getline(file, line);) {
                ++number;
                const size_t word = line.find_first_not_of(" \t");
                if (word == std::string::npos || line[word] != '#' ||
                    line.find("include", word) == std::string::npos)
                    continue;
                const size_t begin = line.find_first_of("\"<", word);
                const size_t end = begin == std::string::npos ? begin : line.find_first_of("\">", begin + 1);
                if (end == std::string::npos) continue;
                const std::string text = complaint(root, from, line.substr(begin + 1, end - begin - 1));
                if (!text.empty())
                    found.push_back(from.string() + ":" + std::to_string(number) + ": " + text);
            }
        }
    }
    return found;
}

TEST(Modules, IncludeOnlyWhatTheyMay) {
    size_t files = 0;
    for (const std::string& text : complaints(EWA_SOURCE_DIR, files)) ADD_FAILURE() << text;
    EXPECT_GT(files, 30u);
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
    folder.write("src/viewer/wrong.cpp", "#include \"cli/a.h\"\n");
    folder.write("shaders/shared/a.h", "");
    folder.write("shaders/lib/a.glsl", "#include \"../shared/a.h\"\n");
    folder.write("shaders/lib/wrong.glsl", "#include \"passes/a.comp\"\n");
    folder.write("shaders/passes/a.comp", "#include \"lib/a.glsl\"\n");
    size_t files = 0;
    const std::vector<std::string> found = complaints(folder.path(), files);
    EXPECT_EQ(files, 23u);
    for (const std::string& text : found) EXPECT_NE(text.find("wrong"), std::string::npos) << text;
    EXPECT_EQ(found.size(), 11u);
}

}  // namespace
