// SPDX-License-Identifier: Apache-2.0
// Vulkan devices: listing and opening them.
#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace ewa {

namespace gpu {
class Device;
}

/// A Vulkan device of this machine.
struct DeviceInfo {
    int index = 0;                   // the N of --device N
    std::string name;                // as the driver names it
    std::string type;                // "cpu", "integrated", "discrete", "virtual", "other"
    std::string driver;              // driver name and version text
    std::string api_version;         // "1.3.230"
    uint32_t subgroup_size = 0;      // lanes
    uint64_t memory_bytes = 0;       // of the largest device-local heap
    std::string unusable;            // why ewa cannot use it; empty: it can
    std::vector<std::string> lacks;  // features that a usable device lacks, with the consequence of each
};

/// Every Vulkan device of this machine, in the loader's order. Throws RunError when there is no Vulkan
/// loader/driver.
std::vector<DeviceInfo> list_devices();

/// Options of open_device.
struct DeviceOptions {
    /// Empty: the first usable discrete, integrated, virtual, then CPU device. A number: that index. Else a case-insensitive part
    /// of the name.
    std::string selector;
    /// Turns the Khronos validation layer on. Its messages become a RunError at the next submission.
    bool validation = false;
    /// Takes a compute queue without graphics if the device has one. Then ewa's work and the desktop's do not wait for each other.
    bool own_queue = true;
};

/// Opens a device. Renderers and trainers on one device share its compiled shaders, so the second one starts faster. Throws
/// InputError when the selector names no usable device (the text lists those there are), RunError when the driver fails.
std::shared_ptr<gpu::Device> open_device(const DeviceOptions& options);
/// The entry of list_devices for an open device.
DeviceInfo device_info(const gpu::Device& device);

/// Device memory that the device's buffers take now, and the most that they took so far, in bytes.
uint64_t device_bytes(const gpu::Device& device);
uint64_t peak_device_bytes(const gpu::Device& device);

/// The time of a pass on the device.
struct PassTime {
    std::string pass;
    double milliseconds = 0;
};

}  // namespace ewa
