// SPDX-License-Identifier: Apache-2.0
// The device of the GPU tests: opened once, with the validation layer listening, so that every test also
// fails on what the layer says. EWA_TEST_DEVICE chooses another than the default.
#pragma once
#include <cstdlib>
#include <memory>

#include "ewa/device.h"
#include "gpu/device.h"
#include "support/shared_by_tests.h"

namespace ewa::test {

using SharedDevice = SharedByTests<std::shared_ptr<gpu::Device>>;
inline SharedDevice* const checked_device_of_all = SharedDevice::add();
inline SharedDevice* const unchecked_device_of_all = SharedDevice::add();

inline std::shared_ptr<gpu::Device> open_test_device(bool validation) {
    DeviceOptions options;
    if (const char* name = std::getenv("EWA_TEST_DEVICE")) options.selector = name;
    options.validation = validation;
    return open_device(options);
}

inline std::shared_ptr<gpu::Device> device() {
    return checked_device_of_all->get([] { return open_test_device(true); });
}

/// The same without the layer, for sizes that a software driver binds and the layer, by the driver's own
/// numbers, objects to.
inline std::shared_ptr<gpu::Device> unchecked_device() {
    return unchecked_device_of_all->get([] { return open_test_device(false); });
}

}  // namespace ewa::test
