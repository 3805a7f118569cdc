// SPDX-License-Identifier: Apache-2.0
// Vulkan devices: what is there, and opening one.
#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace ewa {

namespace gpu {
class Device;
}

struct DeviceInfo {
    int index = 0;                   // the N of --device N
    std::string name;                // as the driver names it
    std::string type;                // "cpu", "integrated", "discrete", "virtual", "other"
    std::string driver;              // driver name and version text
    std::string api_version;         // "1.3.230"
    uint32_t subgroup_size = 0;      // lanes
    uint64_t memory_bytes = 0;       // of the largest device-local heap
    std::string unusable;            // empty, or what it lacks
    std::vector<std::string> lacks;  // of a usable device: what ewa does without, and what follows from it
};

/// Every Vulkan device of this machine, in the loader's order. Throws RunError when there is no Vulkan
/// loader/driver.
std::vector<DeviceInfo> list_devices();

struct DeviceOptions {
    std::string selector;  // empty: the first usable discrete, integrated, virtual, then CPU device;
                           // a number: that index; else a case-insensitive part of the name
    bool validation =
        false;  // turn the Khronos validation layer on; its messages become RunError at the next submit
    bool own_queue = true;  // take a queue without graphics where there is one: work and desktop do not
                            // wait for each other
};

/// Renderers and trainers of one device share the shaders that it has compiled: the second starts faster.
/// Throws InputError when the selector names no usable device (the text lists those there are), RunError when
/// the driver fails.
std::shared_ptr<gpu::Device> open_device(const DeviceOptions& options);
DeviceInfo device_info(const gpu::Device& device);

/// Device memory held now and at most so far, in bytes.
uint64_t device_bytes(const gpu::Device& device);
uint64_t peak_device_bytes(const gpu::Device& device);

/// The time that a device took for the commands of one name.
struct PassTime {
    std::string pass;
    double milliseconds = 0;
};

}  // namespace ewa
