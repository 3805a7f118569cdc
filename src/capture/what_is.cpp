// SPDX-License-Identifier: Apache-2.0
#include "capture/what_is.h"

#include <algorithm>
#include <cstdint>
#include <string>

#include "core/file_reader.h"
#include "core/folders.h"
#include "core/text.h"
#include "ewa/capture.h"
#include "folders/run.h"
#include "image/image_files.h"
#include "io/datasets/dataset_folders.h"
#include "io/datasets/importers/importer.h"
#include "io/gltf/mesh.h"
#include "io/splats/formats.h"

namespace ewa {
namespace {

namespace fs = std::filesystem;

/// Splats in JSON, by the usual name or by the content.
bool is_splat_json(const fs::path& path) {
    const std::string name = core::lower(path.filename().string());
    return name == "meta.json" || name == "lod-meta.json" || io::is_sog_meta(path);
}

bool is_file_of_cameras(const fs::path& path) {
    const bool json = core::lower(path.extension().string()) == ".json";
    return (json && !is_splat_json(path)) || io::find_importer(path).has_value();
}

/// A file that is no glTF of splats counts by its name: the reader of meshes then says what is wrong with it.
bool is_mesh_file(const fs::path& path) {
    const std::string extension = core::lower(path.extension().string());
    const bool named = extension == ".gltf" || extension == ".glb";
    return io::is_gltf_mesh(path) || (named && !io::has_gltf_splats(path));
}

struct Kind {
    What what;
    bool (*is)(const fs::path&);
};

constexpr Kind kFolders[] = {
    {What::dataset, [](const fs::path& path) { return io::is_dataset_folder(path); }},
    {What::run, [](const fs::path& path) { return folders::find_run(path).has_value(); }},
    {What::video, has_videos},
    {What::photos, is_capture}};

constexpr Kind kFiles[] = {{What::video, has_videos},
                           {What::archive, is_archive},
                           {What::dataset, is_file_of_cameras},
                           {What::image, [](const fs::path& path) { return !image_format(path).empty(); }},
                           {What::mesh, is_mesh_file},
                           {What::splats, core::is_file}};

}  // namespace

What what_is(const fs::path& path) {
    const auto first_of = [&](const auto& kinds) {
        const auto found = std::ranges::find_if(kinds, [&](const Kind& kind) { return kind.is(path); });
        return found == std::ranges::end(kinds) ? What::nothing : found->what;
    };
    if (core::is_folder(path)) return first_of(kFolders);
    std::error_code error;
    if (!fs::exists(path, error)) return What::nothing;
    return core::is_file(path) ? first_of(kFiles) : What::splats;
}

bool is_searched(What what) {
    return what == What::photos || what == What::video || what == What::archive;
}

std::string_view image_format(const fs::path& path) {
    if (core::lower(path.extension().string()) == ".splat" || !core::is_file(path)) return {};
    constexpr uint64_t kHeadBytes = 16;
    core::FileReader reader(path);
    const size_t size = size_t(std::min(reader.size(), kHeadBytes));
    const image::Format* format =
        image::format_of({reinterpret_cast<const char*>(reader.take(size, "the header")), size});
    return format ? format->name : std::string_view();
}

}  // namespace ewa
