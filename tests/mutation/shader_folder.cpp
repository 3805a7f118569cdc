// SPDX-License-Identifier: Apache-2.0
// The SPIR-V modules of the folder $EWA_SHADER_FOLDER, <name>.spv and <name>.storage.spv, in the place of the embedded ones.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>

#include "passes/shader_code.h"

namespace {

using Words = std::vector<std::uint32_t>;

const std::map<std::string, Words, std::less<>>& modules() {
    static const auto loaded = [] {
        const char* folder = std::getenv("EWA_SHADER_FOLDER");
        if (!folder) throw std::runtime_error("EWA_SHADER_FOLDER is not set");
        std::map<std::string, Words, std::less<>> found;
        for (const auto& entry : std::filesystem::directory_iterator(folder)) {
            if (entry.path().extension() != ".spv") continue;
            Words words(entry.file_size() / sizeof(std::uint32_t));
            std::ifstream(entry.path(), std::ios::binary)
                .read(reinterpret_cast<char*>(words.data()), std::streamsize(entry.file_size()));
            found.emplace(entry.path().stem().string(), std::move(words));
        }
        return found;
    }();
    return loaded;
}

}  // namespace

std::span<const std::uint32_t> ewa::passes::shader_code(std::string_view name, bool texel_buffers) {
    const auto found = modules().find(std::string(name) + (texel_buffers ? "" : ".storage"));
    if (found == modules().end()) throw std::logic_error("no shader of the name " + std::string(name));
    return found->second;
}

// A mutant is one of the whole module.
std::span<const std::uint32_t> ewa::passes::optimised_code(std::string_view) {
    return {};
}
std::span<const std::uint32_t> ewa::passes::pinhole_code(std::string_view, bool) {
    return {};
}

std::vector<std::string_view> ewa::passes::shader_names() {
    std::vector<std::string_view> names;
    for (const auto& [name, words] : modules())
        if (!name.ends_with(".storage")) names.push_back(name);
    return names;
}
