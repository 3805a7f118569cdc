// SPDX-License-Identifier: Apache-2.0
#include "run/region_option.h"

#include <nlohmann/json.hpp>

#include "core/typing.h"
#include "ewa/error.h"
#include "run/option_rows.h"

namespace ewa::train {

RunOption region_option() {
    RunOption option{
        "region", "x,y,z,X,Y,Z",
        "Add splats only in this box: the lower corner, then the upper one. Splats outside stay and learn",
        kDecides};
    option.get = [](const RunOptions& options) {
        std::string text;
        if (options.train.region)
            for (const double side : *options.train.region)
                text += fmt::format("{}{}", text.empty() ? "" : ",", side);
        return text;
    };
    option.set = [](RunOptions& options, const std::string& text) {
        options.train.region = core::parse_box(text);
        if (!options.train.region && !text.empty()) throw InputError(core::not_a_box(text));
    };
    option.before = "";
    return option;
}

bool in_region(const TrainOptions& options, const glm::dvec3& point) {
    if (!options.region) return true;
    const std::array<double, 6>& box = *options.region;
    for (size_t axis = 0; axis < 3; ++axis) {
        const double value = point[int(axis)];
        if (!(value >= box[axis] && value <= box[3 + axis])) return false;
    }
    return true;
}

void check_region(const TrainOptions& options, const Gaussians& start) {
    for (size_t i = 0; i < start.size(); ++i)
        if (in_region(options, start.world_mean(i))) return;
    throw InputError(
        "--region: none of the first splats is in this box; ewa info shows the bounds of a splat file");
}

}  // namespace ewa::train
