// SPDX-License-Identifier: Apache-2.0
#include "gpu/choose.h"

#include <algorithm>
#include <array>

#include "core/text.h"
#include "ewa/error.h"

namespace ewa::gpu {
namespace {

bool matches(const DeviceInfo& info, const std::string& selector) {
    const bool number = selector.find_first_not_of("0123456789") == std::string::npos;
    return number ? selector == std::to_string(info.index)
                  : core::lower(info.name).find(core::lower(selector)) != std::string::npos;
}

}  // namespace

const DeviceInfo& choose_device(const std::vector<DeviceInfo>& infos, const std::string& selector,
                                int number) {
    const std::array<std::string, 5> preference{"discrete", "integrated", "virtual", "cpu", "other"};
    std::vector<const DeviceInfo*> chosen;  // of one name and driver
    size_t best_rank = preference.size();
    std::string present;
    for (const auto& info : infos) {
        present += (present.empty() ? "" : "; ") + std::to_string(info.index) + " " + info.name +
                   (info.unusable.empty() ? "" : " (lacks " + info.unusable + ")");
        if (!info.unusable.empty() || (!selector.empty() && !matches(info, selector))) continue;
        const size_t rank =
            size_t(std::find(preference.begin(), preference.end(), info.type) - preference.begin());
        if (rank < best_rank || chosen.empty()) chosen.clear(), best_rank = rank;
        if (chosen.empty() || (info.name == chosen.front()->name && info.driver == chosen.front()->driver))
            chosen.push_back(&info);
    }
    if (chosen.empty())
        throw InputError((selector.empty() ? "no usable Vulkan device"
                                           : "no usable Vulkan device matches '" + selector + "'") +
                         "; present: " + present);
    return *chosen[size_t(number) % chosen.size()];
}

}  // namespace ewa::gpu
