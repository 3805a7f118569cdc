// SPDX-License-Identifier: Apache-2.0
// Which of the devices of a machine is used.
#pragma once
#include <string>
#include <vector>

#include "ewa/device.h"

namespace ewa::gpu {

/// The device that a selector of DeviceOptions names. number: where there are several of its name and driver, the one of
/// this number modulo their count. Processes of one machine thus get different ones. Throws InputError as open_device
/// does.
const DeviceInfo& choose_device(const std::vector<DeviceInfo>& infos, const std::string& selector,
                                int number = 0);

}  // namespace ewa::gpu
