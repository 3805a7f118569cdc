// SPDX-License-Identifier: Apache-2.0
// The device of the GPU tests: opened once, with the validation layer listening, so that every test also
// fails on what the layer says. EWA_TEST_DEVICE chooses another than the default.
#pragma once
#include <cstdlib>
#include <memory>

#include "ewa/device.h"
#include "gpu/device.h"

namespace ewa::test {

inline std::shared_ptr<gpu::Device> device() {
    static const std::shared_ptr<gpu::Device> opened = [] {
        DeviceOptions options;
        if (const char* name = std::getenv("EWA_TEST_DEVICE")) options.selector = name;
        options.validation = true;
        return open_device(options);
    }();
    return opened;
}

/// The same without the layer, for sizes that a software driver binds and the layer, by the driver's own
/// numbers, objects to.
inline std::shared_ptr<gpu::Device> unchecked_device() {
    static const std::shared_ptr<gpu::Device> opened = [] {
        DeviceOptions options;
        if (const char* name = std::getenv("EWA_TEST_DEVICE")) options.selector = name;
        return open_device(options);
    }();
    return opened;
}

}  // namespace ewa::test
