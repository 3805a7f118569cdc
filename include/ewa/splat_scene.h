// SPDX-License-Identifier: Apache-2.0
// A splat scene with the other contents of its file, and the options of saving one.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <glm/mat4x4.hpp>
#include <optional>
#include <string>
#include <vector>

#include "ewa/camera.h"
#include "ewa/gaussians.h"

namespace ewa {

/// Formats of splat files. The sources in src/io/splats describe the layouts. sog is one file, sog_meta a meta.json with images beside it, and sog_levels a
/// lod-meta.json with folders of those beside it. tileset is a tileset.json of 3D Tiles with the tiles beside it, and page an .html that
/// shows the scene in a browser.
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
    ksplat,
    tileset,
    page
};

/// The contents of a splat file.
struct SplatScene {
    Gaussians gaussians;  // in the frame of an INRIA PLY (x right, y down, z forward), whatever the file uses
    SplatFormat format = SplatFormat::ply;
    std::string variant;     // of the format, e.g. "version 3", "ascii"; may be empty
    int file_sh_degree = 0;  // may exceed 3; gaussians holds at most degree 3
    /// The file states that the scene was trained with --kernel antialias (Mip-Splatting).
    bool antialiased = false;
    std::vector<std::string> comments;
    std::vector<std::string> remarks;  // one line for each kind of content that is skipped
};

struct Dataset;

/// A camera that a film passes, and when (s).
struct FilmKey {
    Camera camera;
    double time = 0;
};

/// The contents of a page besides the scene.
struct PageOptions {
    std::string title = {};  // empty: the name of the file
    bool unbundled = false;  // the scene is not in the page but beside it, in NAME-levels/lod-meta.json
    const Dataset* cameras = nullptr;  // the page offers these views, by name; null: none
    std::array<float, 3> background{};
    std::vector<FilmKey> film =
        {};  // that the page plays, in the order of times; empty: the views, or once round the scene
};

/// Options of save_splats. Each format uses its own.
struct SaveOptions {
    std::vector<std::string> comments = {};  // one line each; kept by the formats that can store them
    bool antialiased = false;
    int spz_version = 3;    // of an .spz: 2, 3 or 4
    bool gltf_spz = false;  // a glTF holds an SPZ of version 2, by KHR_gaussian_splatting_compression_spz_2
    /// Number of levels of a lod-meta.json or tileset.json. 0: until a level has at most a million splats, or a tile 100,000.
    int levels = 0;
    /// For a tileset.json: maps world coordinates of the scene to earth-centred, earth-fixed ones (EPSG 4978, metres). Empty: the
    /// position that the comments state, if any.
    std::optional<glm::dmat4> earth = {};
    PageOptions page = {};
    std::function<void(uint64_t, uint64_t)> progress = {};  // splats written, all splats
};

}  // namespace ewa
