// SPDX-License-Identifier: Apache-2.0
// Any bytes as the depth map of an image: finite depths of the camera's size, or an error of one line.
#include <cmath>
#include <fstream>
#include <stdexcept>

#include "ewa/dataset.h"
#include "ewa/error.h"
#include "input.h"
#include "png.h"
#include "scene/depth_map.h"

namespace {

using namespace ewa;

Frame make_frame() {
    Frame frame;
    frame.name = "a.png";
    frame.depth_path = fuzz::make_folder() / "a.png";
    frame.depth_unit = 0.001;
    frame.camera.width = 24;
    frame.camera.height = 18;
    frame.camera.fx = frame.camera.fy = 20;
    frame.camera.cx = 12;
    frame.camera.cy = 9;
    frame.pinhole = frame.source = frame.camera;
    return frame;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const Frame frame = make_frame();
    std::string bytes(reinterpret_cast<const char*>(data), size);
    fuzz::sum_png_chunks(bytes);
    std::ofstream(frame.depth_path, std::ios::binary) << bytes;
    std::string text = "a depth map of " + std::to_string(size) + " bytes";
    try {
        const Image depth = load_depth_map(frame);
        EWA_REQUIRE(depth.width == frame.camera.width && depth.height == frame.camera.height &&
                    depth.channels == 1);
        for (const float z : depth.pixels) EWA_REQUIRE(std::isfinite(z) && z >= 0);
    } catch (const std::runtime_error& error) {  // also that a format's module is missing
        text = error.what();
        EWA_REQUIRE(text.find('\n') == std::string::npos && text.size() < 2000);
    }
    return 0;
}
