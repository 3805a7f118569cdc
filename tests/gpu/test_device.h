// SPDX-License-Identifier: Apache-2.0
// The device of the GPU tests: opened once, with the validation layer listening, so that every test also
// fails on what the layer says. EWA_TEST_DEVICE chooses another than the default. With EWA_TEST_KERNELS=gpu it runs the
// kernels and buffers that a GPU gets; EWA_TEST_LANES is then its subgroup size, for shaders that emulate subgroups.
#pragma once
#include <cstdlib>
#include <memory>
#include <string_view>

#include "ewa/device.h"
#include "gpu/device.h"
#include "support/shared_by_tests.h"
#include "support/validation.h"

namespace ewa::test {

using SharedDevice = SharedByTests<std::shared_ptr<gpu::Device>>;
inline SharedDevice* const checked_device_of_all = SharedDevice::add();
inline SharedDevice* const unchecked_device_of_all = SharedDevice::add();

/// From now on, this device gets what a GPU with separate memory gets. Call it before anything is made on the device.
inline void pretend_gpu(gpu::Device& device) {
    gpu::Limits limits = device.limits();
    limits.cpu = limits.texel_buffers = false;
    limits.exact_floats = true;
    limits.max_storage_range = ~0u;
    if (const char* lanes = std::getenv("EWA_TEST_LANES")) {
        limits.subgroup_size = uint32_t(std::atoi(lanes));
        limits.ballots = false;  // not emulated
    }
    device.pretend(limits);
    device.limit_host_access(gpu::HostAccess::none);
}

inline std::shared_ptr<gpu::Device> open_test_device(bool validation) {
    DeviceOptions options;
    if (const char* name = std::getenv("EWA_TEST_DEVICE")) options.selector = name;
    options.validation = validation && with_validation();
    std::shared_ptr<gpu::Device> opened = open_device(options);
    const char* kernels = std::getenv("EWA_TEST_KERNELS");
    if (kernels && std::string_view(kernels) == "gpu") pretend_gpu(*opened);
    return opened;
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
