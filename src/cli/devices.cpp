// SPDX-License-Identifier: Apache-2.0
// ewa devices: the devices that --device can name.
#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include <memory>

#include "cli/command.h"
#include "cli/output.h"
#include "core/messages.h"
#include "core/text.h"
#include "ewa/device.h"
#include "options/command_options.h"

namespace ewa::cli {
namespace {

report::Json to_json(const DeviceInfo& device) {
    return {{"index", device.index},
            {"name", device.name},
            {"type", device.type},
            {"driver", device.driver},
            {"api_version", device.api_version},
            {"subgroup_size", device.subgroup_size},
            {"memory_bytes", device.memory_bytes},
            {"unusable", device.unusable},
            {"lacks", device.lacks}};
}

int run(bool json) {
    const auto devices = list_devices();
    if (json) {
        report::Json list = report::Json::array();
        for (const DeviceInfo& device : devices) list.push_back(to_json(device));
        print_json(list);
        return 0;
    }
    if (devices.empty())
        fmt::print("no Vulkan device; the package mesa-vulkan-drivers contains one for the CPU\n");
    for (const DeviceInfo& device : devices) {
        fmt::print("{}  {} ({}, {}, Vulkan {}, {} lanes, {}){}\n", device.index, device.name, device.type,
                   device.driver, device.api_version, device.subgroup_size,
                   core::bytes_text(device.memory_bytes),
                   device.unusable.empty() ? "" : "  unusable: " + device.unusable);
        if (!device.lacks.empty()) fmt::print("   lacks: {}\n", fmt::join(device.lacks, "; "));
    }
    return 0;
}

}  // namespace

Action add_devices(CLI::App& app) {
    const auto json = std::make_shared<bool>(false);
    options::add(app, "json", *json);
    return [json] { return run(*json); };
}

}  // namespace ewa::cli
