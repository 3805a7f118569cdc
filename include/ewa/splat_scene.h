// SPDX-License-Identifier: Apache-2.0
// A splat scene with the other contents of its file, and the options of saving one.
#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "ewa/gaussians.h"

namespace ewa {

/// The sources in src/io/splats describe the layouts. sog is one file, sog_meta a meta.json with images beside it, and sog_levels a
/// lod-meta.json with folders of those beside it.
enum class SplatFormat {
    ply,
    compressed_ply,
    splat,
    spz,
    glb,
    gltf,
    sog,
    sog_meta,
    sog_levels,
    usda,
    usdz,
    ksplat
};

struct SplatScene {
    Gaussians gaussians;  // in the frame of an INRIA PLY (x right, y down, z forward), whatever the file uses
    SplatFormat format = SplatFormat::ply;
    std::string variant;     // of the format, e.g. "version 3", "ascii"; may be empty
    int file_sh_degree = 0;  // may exceed 3; gaussians holds at most degree 3
    bool antialiased =
        false;  // the file states that the scene was trained with --kernel antialias (Mip-Splatting)
    std::vector<std::string> comments;
    std::vector<std::string> remarks;  // one line for each kind of content that is skipped
};

struct SaveOptions {
    std::vector<std::string> comments = {};  // one line each; kept by the formats that can store them
    bool antialiased = false;
    int spz_version = 3;    // of an .spz: 2, 3 or 4
    bool gltf_spz = false;  // a glTF holds an SPZ of version 2, by KHR_gaussian_splatting_compression_spz_2
    int levels = 0;         // of a lod-meta.json; 0: until one has a million splats
    std::function<void(uint64_t, uint64_t)> progress = {};  // splats written, all splats
};

}  // namespace ewa
