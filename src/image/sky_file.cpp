// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>
#include <string>

#include "core/json.h"
#include "core/json_field.h"
#include "core/text.h"
#include "ewa/sky_map.h"

namespace ewa {

SkyMap load_sky(const std::filesystem::path& path) {
    const auto top = core::JsonField::of_file(path);
    SkyMap sky;
    sky.size = int(top.whole("size", kMostSkyTexels, 1));
    sky.texels = top.floats("texels", size_t(3) * size_t(sky.size) * size_t(sky.size));
    return sky;
}

void save_sky(const std::filesystem::path& path, const SkyMap& sky) {
    check(sky);
    core::write_json(path, {{"size", sky.size}, {"texels", sky.texels}});
}

}  // namespace ewa
