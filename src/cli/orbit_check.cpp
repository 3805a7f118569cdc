// SPDX-License-Identifier: Apache-2.0
#include "cli/orbit_check.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/text.h"
#include "ewa/error.h"
#include "ewa/renderer.h"
#include "scene/framing.h"

namespace ewa::cli {
namespace {

constexpr int kSides = 8, kSidePixels = 512;

struct OrbitPsnr {
    double mean = 0, worst = std::numeric_limits<double>::infinity();  // dB
};

OrbitPsnr orbit_psnr(const Gaussians& written, const SplatScene& read) {
    RenderOptions options;
    if (read.antialiased) options.kernel = Footprint::antialias;
    if (written.density) options.kernel = Footprint::density;
    scene::FramingHints hints;
    hints.all_round = true;
    const scene::Framing framing = scene::frame_scene(written, kSidePixels, kSidePixels, hints);
    const auto side = [&](int i) {
        return scene::orbited(framing.camera, framing.target, framing.up, 2 * std::numbers::pi * i / kSides);
    };
    // One scene after the other: a device may have memory for one.
    std::vector<Image> images;
    Renderer renderer(open_device({}), written, options);
    for (int i = 0; i < kSides; ++i) images.push_back(renderer.render(side(i)).color);
    renderer.replace(read.gaussians);
    OrbitPsnr result;
    for (int i = 0; i < kSides; ++i) {
        const double db = psnr(renderer.render(side(i)).color, images[size_t(i)]);
        result.mean += db / kSides;
        result.worst = std::min(result.worst, db);
    }
    return result;
}

}  // namespace

report::Json check_renders(const Gaussians& written, const SplatScene& read, bool quiet) {
    const auto number = [](double db) { return std::isfinite(db) ? report::Json(db) : report::Json(); };
    if (written.size() == 0) return report::Json::object();
    try {
        const OrbitPsnr found = orbit_psnr(written, read);
        if (!quiet && std::isinf(found.worst))
            fmt::print("  renders from {} sides are equal\n", kSides);
        else if (!quiet)
            fmt::print(
                "  renders from {} sides: PSNR {:.1f} dB, {:.1f} dB from the worst side; a difference is "
                "hard to see over 40 dB\n",
                kSides, found.mean, found.worst);
        return {{"views", kSides}, {"psnr", number(found.mean)}, {"worst_psnr", number(found.worst)}};
    } catch (const RunError& error) {
        if (!quiet) fmt::print("  no renders to compare: {}\n", core::one_line(error.what()));
        return {{"error", core::one_line(error.what())}};
    }
}

}  // namespace ewa::cli
