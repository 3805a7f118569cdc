// SPDX-License-Identifier: Apache-2.0
#include "report/run_file_names.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "core/typing.h"

namespace ewa::report {

std::optional<int> step_of_kept_splats(std::string_view name) {
    constexpr std::string_view kBegin = "splats_", kEnd = ".ply";
    if (name.size() <= kBegin.size() + kEnd.size() || !name.starts_with(kBegin) || !name.ends_with(kEnd))
        return std::nullopt;
    const auto step =
        core::parse_integer<int>(name.substr(kBegin.size(), name.size() - kBegin.size() - kEnd.size()));
    // Another file of the user's may have a similar name.
    return step && *step >= 0 && name_of_kept_splats(*step) == name ? step : std::nullopt;
}

std::string name_of_kept_splats(int step) {
    return fmt::format("splats_{:06}.ply", step);
}

bool is_run_file(std::string_view name) {
    return std::ranges::find(kRunFiles, name) != kRunFiles.end() || step_of_kept_splats(name);
}

}  // namespace ewa::report
