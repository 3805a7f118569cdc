// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "core/json.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/sky_map.h"

namespace ewa {

SkyMap load_sky(const std::filesystem::path& path) {
    const auto all = core::read_json_file<nlohmann::json>(path);
    const std::string file = core::one_line(path.string());
    SkyMap sky;
    const auto size = all.is_object() ? all.find("size") : all.end();
    if (!all.is_object() || size == all.end() || !size->is_number_unsigned() || *size < 1 ||
        *size > kMostSkyTexels)
        throw InputError(file + ": \"size\" is not a number from 1 to " + std::to_string(kMostSkyTexels));
    sky.size = size->get<int>();
    const size_t count = size_t(3) * size_t(sky.size) * size_t(sky.size);
    const auto texels = all.find("texels");
    bool right = texels != all.end() && texels->is_array() && texels->size() == count;
    for (size_t i = 0; right && i < count; ++i) {
        const auto& value = (*texels)[i];
        sky.texels.push_back(value.is_number() ? value.get<float>() : NAN);
        right = std::isfinite(sky.texels.back());
    }
    if (!right)
        throw InputError(file + ": \"texels\" are not " + std::to_string(count) +
                         " finite numbers, three for each texel");
    return sky;
}

void save_sky(const std::filesystem::path& path, const SkyMap& sky) {
    check(sky);
    core::write_json(path, {{"size", sky.size}, {"texels", sky.texels}});
}

}  // namespace ewa
