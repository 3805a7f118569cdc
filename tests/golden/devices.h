// SPDX-License-Identifier: Apache-2.0
// Every Vulkan device that ewa can use, each opened once with the validation layer listening. EWA_TEST_DEVICE
// names one.
#pragma once
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "ewa/device.h"
#include "support/shared_by_tests.h"
#include "support/validation.h"

namespace ewa::test {

using Devices = std::vector<std::shared_ptr<gpu::Device>>;
inline SharedByTests<Devices>* const devices_of_all = SharedByTests<Devices>::add();

inline const Devices& all_devices() {
    return devices_of_all->get([] {
        Devices devices;
        if (const char* name = std::getenv("EWA_TEST_DEVICE")) {
            devices.push_back(open_device({.selector = name, .validation = with_validation()}));
            return devices;
        }
        for (const DeviceInfo& info : list_devices())
            if (info.unusable.empty())
                devices.push_back(
                    open_device({.selector = std::to_string(info.index), .validation = with_validation()}));
        return devices;
    });
}

}  // namespace ewa::test
