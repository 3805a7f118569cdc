// SPDX-License-Identifier: Apache-2.0
// Any text as a tileset.json, and as a .json beside one: files in its folder that exist, and no other is removed by a new tileset.
#include <fstream>

#include "ewa/gaussians.h"
#include "input.h"
#include "io/splats/tileset.h"

namespace {

using namespace ewa;
namespace fs = std::filesystem;

const std::vector<std::string> kOfOthers = {"tiles/0_0.glb", "tiles/5_7.glb", "tiles-2/0_1.glb", "0_0.glb"};

fs::path make_tileset_folder() {
    const fs::path folder = fuzz::make_folder();
    for (const std::string& name : kOfOthers) {
        fs::create_directories((folder / name).parent_path());
        std::ofstream(folder / name) << "somebody's";
    }
    return folder;
}

Gaussians one_splat() {
    Gaussians g;
    g.resize(1);
    g.quaternions = {1, 0, 0, 0};
    return g;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const fs::path folder = make_tileset_folder();
    const std::string bytes(reinterpret_cast<const char*>(data), size);
    for (const char* name : {"tileset.json", "other.json"})
        std::ofstream(folder / name, std::ios::binary) << bytes;
    fuzz::read_within(size, 1, [&] {
        for (const fs::path& file : io::tile_files(folder / "tileset.json")) {
            const std::string text = file.string();
            EWA_REQUIRE(file.lexically_normal().string().starts_with(folder.string() + "/"));
            EWA_REQUIRE(fs::is_regular_file(file));
        }
    });
    if (size % 16 == 0) io::write_tileset(folder / "tileset.json", one_splat(), {});
    for (const std::string& text : kOfOthers) EWA_REQUIRE(fs::exists(folder / text));
    return 0;
}
