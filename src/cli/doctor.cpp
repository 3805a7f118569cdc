// SPDX-License-Identifier: Apache-2.0
// ewa doctor: what works on this machine, and what to install for the rest.
#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "capture/found_colmap.h"
#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/output.h"
#include "cli/status.h"
#include "core/folders.h"
#include "core/messages.h"
#include "core/packages.h"
#include "core/process.h"
#include "core/text.h"
#include "ewa/device.h"
#include "ewa/error.h"
#include "ewa/trainer.h"
#include "image/image_files.h"
#include "platform/file.h"
#include "platform/folders.h"
#include "platform/system.h"
#include "ranks/plugin.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;
using core::Thing;

struct DoctorArguments {
    DeviceOptions device;
    fs::path output = "out";
    bool json = false;
};

struct Check {
    std::string name;
    bool works = false, needed = false;  // needed: for training
    std::string detail, remedy;          // remedy: empty where it works
};

/// Carries out the work, which returns the detail.
template <class Work>
Check checked(const char* name, bool needed, const std::string& remedy, const Work& work) {
    Check check{name, false, needed, {}, remedy};
    try {
        check.detail = work();
        check.works = true;
        check.remedy.clear();
    } catch (const std::exception& error) {
        check.detail = core::one_line(error.what());
    }
    return check;
}

std::string device_text(const DeviceInfo& device) {
    return fmt::format("{}: {} ({}, {}, Vulkan {}, {}){}", device.index, device.name, device.type,
                       device.driver, device.api_version, core::bytes_text(device.memory_bytes),
                       device.unusable.empty() ? "" : ", unusable: " + device.unusable);
}

/// One check for each device. The driver works if there is one.
void add_devices_to(std::vector<Check>& checks) {
    std::vector<DeviceInfo> devices;
    checks.push_back(checked("Vulkan driver", true, core::how_to_install(Thing::driver), [&] {
        devices = list_devices();
        return core::counted(devices.size(), "device");
    }));
    for (const DeviceInfo& device : devices)
        checks.push_back({"device", device.unusable.empty(), false, device_text(device), {}});
}

/// A training step of one image of 32 x 32 pixels.
std::string train_once(const DeviceOptions& options) {
    constexpr int kSide = 32;
    const core::TemporaryFolder folder("ewa-doctor-");
    Frame frame;
    frame.name = "image.png";
    frame.image_path = folder.path() / frame.name;
    frame.image_exists = true;
    frame.camera = {
        .width = kSide, .height = kSide, .fx = kSide, .fy = kSide, .cx = kSide / 2.0, .cy = kSide / 2.0};
    frame.source = frame.pinhole = frame.camera;
    save_image(frame.image_path, Image(kSide, kSide, 3));
    Dataset dataset;
    dataset.frames = {frame};
    Gaussians splats;
    splats.resize(1);
    splats.means = {0, 0, 2};
    splats.quaternions = {1, 0, 0, 0};
    splats.log_scales = {-2, -2, -2};
    const auto device = open_device(options);
    TrainOptions train;
    train.steps = 1;
    train.strategy = Strategy::none;
    train.sh_degree = 0;
    Trainer trainer(device, dataset, {0}, splats, train);
    trainer.step();
    trainer.report();  // waits for the device
    return "a step on " + device_info(*device).name;
}

std::string memory_text() {
    constexpr uint64_t kLeast = uint64_t(1) << 30;
    const std::optional<uint64_t> free = platform::free_memory();
    if (!free) return "the system does not say how much is free";
    const std::string text = core::bytes_text(*free) + " free";
    if (*free < kLeast) throw RunError(text + "; trainings need 1 GB and more");
    return text;
}

/// A folder that does not exist is made where its first parent is.
std::string folder_text(fs::path folder) {
    constexpr uint64_t kLeast = uint64_t(1) << 30;
    const std::string name = core::one_line(folder.string());
    folder = fs::absolute(folder);
    while (!fs::exists(folder) && folder.has_relative_path()) folder = folder.parent_path();
    if (!fs::is_directory(folder)) throw RunError(core::one_line(folder.string()) + " is no folder");
    if (platform::refuses_files(folder))
        throw RunError(core::one_line(folder.string()) + " cannot be written");
    const uint64_t room = fs::space(folder).available;
    const std::string text = name + ", " + core::bytes_text(room) + " free";
    if (room < kLeast) throw RunError(text + "; a run may take 1 GB and more");
    return text;
}

std::string program_path(const std::vector<const char*>& names) {
    std::string found;
    for (const char* name : names) {
        const fs::path path = core::find_program(name);
        if (path.empty()) throw RunError(std::string("the program ") + name + " is not there");
        found += (found.empty() ? "" : ", ") + core::one_line(path.string());
    }
    return found;
}

std::string python_version() {
    std::string without;
    for (const fs::path& python : platform::find_pythons()) {
        if (!core::is_file(python)) continue;
        // The current folder may hold another package of this name.
        const core::Answer answer =
            core::ask_program({.command = {python.string(), "-c",
                                           "import sys; sys.path.pop(0); import ewa; print(ewa.__version__)"},
                               .environment = {},
                               .log = platform::kNullFile});
        const std::string name = core::one_line(python.string());
        if (answer.ended == core::Ended::done) return core::one_line(core::trim(answer.text)) + ", " + name;
        without = name;
    }
    throw RunError(without.empty() ? "there is no Python 3 here" : without + " has no package ewa");
}

std::vector<Check> all_checks(const DoctorArguments& arguments) {
    std::vector<Check> checks;
    add_devices_to(checks);
    checks.push_back(checked("training", true,
                             checks[0].works ? "ewa devices says what each device lacks" : "see above",
                             [&] { return train_once(arguments.device); }));
    checks.push_back(
        checked("memory", false, "close other programs, or train with a larger --downscale", memory_text));
    checks.push_back(checked("output folder", true, "name another folder with -o",
                             [&] { return folder_text(arguments.output); }));
    if (const fs::path cache = platform::shader_cache_folder(); !cache.empty())
        checks.push_back(checked("shader cache", false, "set MESA_SHADER_CACHE_DIR to a folder with room",
                                 [&] { return folder_text(cache); }));
    checks.push_back(checked("videos and films", false, core::how_to_install(Thing::ffmpeg), [] {
        return program_path({"ffmpeg", "ffprobe"});
    }));
    checks.push_back(checked("cameras of photos", false, core::how_to_install(Thing::colmap), [] {
        if (const auto colmap = capture::find_colmap()) return colmap->name;
        throw RunError("there is neither the program colmap nor Python's package pycolmap");
    }));
    checks.push_back(
        checked("other image formats", false, core::how_to_install_module(Thing::openimageio), [] {
            image::openimageio();
            return std::string("TIFF, EXR, WebP, BMP, HDR, PNM");
        }));
    if (ranks::has_mpi())
        checks.push_back(checked("several processes", false, core::how_to_install_module(Thing::mpi), [] {
            ranks::load_mpi();
            return program_path({"mpirun"});
        }));
    checks.push_back(checked("Python package", false, "pip install a wheel of ewa, or . in a clone of it",
                             python_version));
    return checks;
}

void print(const std::vector<Check>& checks, bool trains) {
    size_t width = 0;
    for (const Check& check : checks) width = std::max(width, check.name.size());
    for (const Check& check : checks) {
        fmt::print("{:<4} {:<{}}  {}\n", check.works ? "yes" : "no", check.name, width, check.detail);
        if (!check.remedy.empty()) fmt::print("     {:<{}}  -> {}\n", "", width, check.remedy);
    }
    fmt::print("{}\n", trains ? "ewa can train on this machine" : "ewa cannot train on this machine");
}

int run(const DoctorArguments& arguments) {
    const std::vector<Check> checks = all_checks(arguments);
    const bool trains = std::all_of(checks.begin(), checks.end(),
                                    [](const Check& check) { return check.works || !check.needed; });
    if (arguments.json) {
        report::Json list = report::Json::array();
        for (const Check& check : checks)
            list.push_back({{"name", check.name},
                            {"works", check.works},
                            {"needed", check.needed},
                            {"detail", check.detail},
                            {"remedy", check.remedy}});
        print_json({{"version", EWA_VERSION}, {"trains", trains}, {"checks", list}});
    } else {
        print(checks, trains);
    }
    return trains ? kDone : kFailed;
}

}  // namespace

Action add_doctor(CLI::App& app) {
    const auto arguments = std::make_shared<DoctorArguments>();
    options::add(app, "output", arguments->output);
    options::add(app, "json", arguments->json);
    add_device_options(app, arguments->device);
    return [arguments] { return run(*arguments); };
}

}  // namespace ewa::cli
