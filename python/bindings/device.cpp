// SPDX-License-Identifier: Apache-2.0
#include "device.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <string>
#include <thread>
#include <variant>

#include "bindings.h"
#include "ewa/error.h"
#include "platform/process.h"

namespace ewa::python {
namespace {

/// Never destroyed: the driver may be gone before it.
struct DefaultDevice {
    std::recursive_mutex mutex;
    std::string selector;
    std::shared_ptr<gpu::Device> device;
    std::atomic<int> opened_by = 0;
    std::atomic<int> present = 0;  // DeviceWorks
    std::atomic<bool> ending = false;
    std::thread::id ended_by;
};

DefaultDevice& default_device() {
    static auto* const one = [] {
        auto* made = new DefaultDevice;
        if (const char* named = std::getenv("EWA_DEVICE")) made->selector = named;
        return made;
    }();
    return *one;
}

/// Called before Python ends. A thread that asks for the interpreter after that would be ended in the middle of a C++
/// function, which ends the process with an abort. So those that use the device finish, and others stay where they are.
void end_use() {
    DefaultDevice& one = default_device();
    {
        const DeviceWork work;
        one.ended_by = std::this_thread::get_id();
        one.ending = true;
    }
    const nb::gil_scoped_release released;
    while (one.present > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

std::vector<DeviceInfo> devices() {
    const DeviceWork work;
    return list_devices();
}

void set_device(const std::variant<int, std::string>& device) {
    const std::string selector =
        device.index() == 0 ? std::to_string(std::get<int>(device)) : std::get<std::string>(device);
    const DeviceWork work;
    DefaultDevice& one = default_device();
    const std::string before = std::exchange(one.selector, selector);
    const std::shared_ptr<gpu::Device> open = std::exchange(one.device, nullptr);
    try {
        // Kernels that are compiled stay with an open device.
        const auto opened = work.device();
        if (open && device_info(*open).index == device_info(*opened).index) one.device = open;
    } catch (...) {
        one.selector = before;
        one.device = open;
        throw;
    }
}

DeviceInfo current_device() {
    const DeviceWork work;
    return device_info(*work.device());
}

std::string device_text(const DeviceInfo& info) {
    return "DeviceInfo(index=" + std::to_string(info.index) + ", name='" + info.name + "', type='" +
           info.type + "')";
}

}  // namespace

bool was_forked() {
    const int opened_by = default_device().opened_by;
    return opened_by != 0 && opened_by != platform::process_id();
}

DeviceWork::DeviceWork()
    : lock_([]() -> std::recursive_mutex& {
          if (was_forked())
              throw RunError(
                  "this process was forked from one that uses a Vulkan device, which a fork cannot share; "
                  "start processes with multiprocessing.get_context(\"spawn\")");
          return default_device().mutex;
      }()) {
    stay_while_python_ends();
}

DeviceWork::Presence::Presence() {
    ++default_device().present;
}
DeviceWork::Presence::~Presence() {
    --default_device().present;
}

void DeviceWork::stay_while_python_ends() {
    DefaultDevice& one = default_device();
    if (!one.ending || one.ended_by == std::this_thread::get_id()) return;
    lock_.unlock();
    --one.present;
    for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
}

std::shared_ptr<gpu::Device> DeviceWork::device() const {
    DefaultDevice& one = default_device();
    if (!one.device) {
        try {
            one.device = open_device({.selector = one.selector});
        } catch (const InputError& error) {
            throw RunError(error.what());  // a device that is missing is a DeviceError
        }
        one.opened_by = platform::process_id();
    }
    return one.device;
}

void check_signals() {
    const nb::gil_scoped_acquire interpreter;
    if (PyErr_CheckSignals() != 0) throw nb::python_error();
}

void bind_device(nb::module_& module) {
    nb::class_<DeviceInfo>(module, "DeviceInfo", "A Vulkan device of this machine.")
        .def_ro("index", &DeviceInfo::index, "The number that set_device takes.")
        .def_ro("name", &DeviceInfo::name)
        .def_ro("type", &DeviceInfo::type, "\"cpu\", \"integrated\", \"discrete\", \"virtual\" or \"other\".")
        .def_ro("driver", &DeviceInfo::driver)
        .def_ro("api_version", &DeviceInfo::api_version)
        .def_ro("memory_bytes", &DeviceInfo::memory_bytes)
        .def_ro("unusable", &DeviceInfo::unusable, "What it lacks; empty if ewa can use it.")
        .def_ro("lacks", &DeviceInfo::lacks, "What ewa does without on this device.")
        .def("__repr__", device_text);
    nb::module_::import_("atexit").attr("register")(nb::cpp_function([] {
        if (!was_forked()) end_use();
    }));
    module.def("devices", devices,
               "Lists the Vulkan devices of this machine. Raises DeviceError if there is none.");
    module.def("set_device", set_device, nb::arg("device"),
               "Opens the device that later calls use: an index, a part of a name, or \"\" for ewa's own "
               "choice. The "
               "environment variable EWA_DEVICE names the first one. Renderers and trainers keep theirs.");
    module.def("current_device", current_device, "The device that calls use. Opens it if none is open.");
}

}  // namespace ewa::python
