// SPDX-License-Identifier: Apache-2.0
// Every Vulkan device that ewa can use, each opened once with the validation layer listening. EWA_TEST_DEVICE
// names one.
#pragma once
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "ewa/device.h"

namespace ewa::test {

inline const std::vector<std::shared_ptr<gpu::Device>>& all_devices() {
    static const auto opened = [] {
        std::vector<std::shared_ptr<gpu::Device>> devices;
        if (const char* name = std::getenv("EWA_TEST_DEVICE")) {
            devices.push_back(open_device({.selector = name, .validation = true}));
            return devices;
        }
        for (const DeviceInfo& info : list_devices())
            if (info.unusable.empty())
                devices.push_back(open_device({.selector = std::to_string(info.index), .validation = true}));
        return devices;
    }();
    return opened;
}

}  // namespace ewa::test
