// SPDX-License-Identifier: Apache-2.0
// ewa-view: reads the arguments, opens the scene in a window, and turns every failure into one line and an
// exit status.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <new>

#include "core/text.h"
#include "ewa/error.h"
#include "ewa/splat_files.h"
#include "viewer/app.h"

namespace {

using namespace ewa;
using namespace ewa::viewer;

enum ExitStatus { kDone = 0, kFailed = 1, kWrongUse = 2 };
constexpr int kLargestSide = 16384;  // px

struct Arguments {
    std::filesystem::path file, cameras, picture;
    std::optional<int> frame;
    std::string size;
    DeviceOptions device;
};

int fail(const std::string& what, int status) {
    std::fprintf(stderr, "ewa-view: %s\n", core::one_line(what).c_str());
    return status;
}

Size parse_size(const std::string& text) {
    const size_t cross = text.find('x');
    const auto side = [&](size_t from, size_t count) {
        return core::parse_integer<int>(std::string_view(text).substr(std::min(from, text.size()), count))
            .value_or(0);
    };
    const Size size{side(0, cross), cross == std::string::npos ? 0 : side(cross + 1, std::string::npos)};
    if (size.width < 1 || size.height < 1 || size.width > kLargestSide || size.height > kLargestSide)
        throw InputError("--size: '" + text + "' is not a size such as 1280x720, of at most " +
                         std::to_string(kLargestSide) + " a side");
    return size;
}

Opened open(const Arguments& arguments) {
    Opened opened;
    opened.file = arguments.file;
    if (!arguments.size.empty()) opened.size = parse_size(arguments.size);
    if (!arguments.picture.empty()) {
        if (core::lower(arguments.picture.extension().string()) != ".png")
            throw InputError("--screenshot " + arguments.picture.string() + ": the name must end in .png");
        opened.picture = arguments.picture;
    }
    if (arguments.frame && arguments.cameras.empty())
        throw InputError("--frame needs --cameras DATASET, whose frame it is");
    opened.gaussians = load_splats(arguments.file);
    if (!arguments.cameras.empty()) {
        opened.dataset = load_dataset(arguments.cameras, {.need_images = false});
        const int count = int(opened.dataset->frames.size());
        opened.frame = arguments.frame.value_or(0);
        if (count == 0) throw InputError(arguments.cameras.string() + " has no frames");
        if (opened.frame < 0 || opened.frame >= count)
            throw InputError("there is no frame " + std::to_string(opened.frame) + ": " +
                             arguments.cameras.string() + " has " + std::to_string(count) +
                             " frames, numbered from 0 in name order");
    }
    return opened;
}

void add_options(CLI::App& app, Arguments& arguments) {
    app.add_option("FILE", arguments.file, "The splat scene (.ply .compressed.ply .splat .spz .glb .gltf)")->required();
    app.add_option("--cameras", arguments.cameras, "A dataset whose cameras to look through");
    app.add_option("--frame", arguments.frame, "Which of its cameras to start from, in name order (0)");
    app.add_option("--size", arguments.size,
                   "Of the window, WxH in px; otherwise the camera's, or what there is room for");
    app.add_option("--screenshot", arguments.picture,
                   "Write what the window shows as a PNG, without the panel, and end");
    app.add_option("--device", arguments.device.selector,
                   "Number or part of the name of the device that draws (see ewa devices)");
}

int run(const Arguments& arguments) {
    try {
        Opened opened = open(arguments);
        opened.device = open_device(arguments.device);
        App(opened).run();
        return kDone;
    } catch (const InputError& error) {
        return fail(error.what(), kWrongUse);
    } catch (const RunError& error) {
        return fail(error.what(), kFailed);
    } catch (const vk::SystemError& error) {
        return fail(std::string("the device that shows the window failed: ") + error.what(), kFailed);
    } catch (const std::bad_alloc&) {
        return fail("out of host memory; a smaller scene or window needs less", kFailed);
    } catch (const std::exception& error) {
        return fail(std::string("unexpected failure: ") + error.what(), kFailed);
    }
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{"Shows a 3D Gaussian splat scene in a window. F1 in the window lists its keys."};
    app.name("ewa-view");
    app.set_version_flag("--version", "ewa-view " EWA_VERSION);
    app.get_formatter()->column_width(34);
    Arguments arguments;
    add_options(app, arguments);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) return app.exit(error);
        return fail(std::string(error.what()) + " (see ewa-view --help)", kWrongUse);
    }
    return run(arguments);
}
