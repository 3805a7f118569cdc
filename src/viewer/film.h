// SPDX-License-Identifier: Apache-2.0
// A film in the making: pictures along a path through saved views, each written as a file.
#pragma once
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <vector>

#include "scene/camera.h"
#include "viewer/size.h"

namespace ewa::viewer {

inline constexpr int kFilmRate = 30;  // pictures a second

struct Film {
    std::filesystem::path folder;
    std::vector<Camera> keys;  // at least one
    Size size;                 // of every picture, whatever the window does meanwhile
    int frames = 0, next = 0;
    uint64_t waits_for = 0;  // serial of the picture that is being written; 0: none

    bool finished() const { return next >= frames; }
    /// Keys are kFilmRate * seconds frames apart; the first and the last are among the frames.
    static int frames_for(size_t keys, double seconds) {
        return int((double(keys) - 1) * kFilmRate * seconds + 0.5) + 1;
    }
    Camera camera() const {
        return along_path(keys, frames > 1 ? double(next) * double(keys.size() - 1) / (frames - 1) : 0);
    }
    std::filesystem::path file() const {
        char name[32];
        std::snprintf(name, sizeof(name), "%05d.png", next);
        return folder / name;
    }
};

}  // namespace ewa::viewer
