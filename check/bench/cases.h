// SPDX-License-Identifier: Apache-2.0
// The fixed set of cases and their synthetic scenes. The name of a case describes it completely: results of
// two machines or commits are compared by name.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "ewa/camera.h"
#include "ewa/gaussians.h"
#include "ewa/image.h"

namespace ewa::bench {

enum class Kind {
    forward,     // render one image
    train,       // forward, loss, backward, update
    sort,        // stable radix sort of random 32-bit keys with 32-bit values
    update,      // backward projection and Adam only, on the gradient slots of one training frame
    first_step,  // a new process up to the end of its first training step
};

enum class Layout {
    capture,  // a few large objects before a backdrop, as in a capture of a table or a room
    cloud,    // many small objects at many depths
    sparse,   // cloud with small opaque splats: few per pixel
    dense,    // cloud with large faint splats: many per pixel, none of which saturates it
};

struct Case {
    std::string name;
    Kind kind = Kind::forward;
    Layout layout = Layout::cloud;
    uint32_t splats = 0;  // of a sort: pairs
    int width = 0, height = 0;
    int sh_degree = 0;
    bool large = false;  // only with --large: takes gigabytes or many seconds on a CPU
};

const char* name_of(Kind kind);

std::vector<Case> all_cases();

/// Whether a name matches patterns in the form of select_cases.
bool name_matches(const std::string& name, const std::string& patterns);

/// Selects by patterns separated by commas. A pattern with * or ? must match the whole name, any other a part
/// of it; large cases too. Empty: all cases, the large ones only if `large`. Throws InputError if none match.
std::vector<Case> select_cases(const std::string& patterns, bool large);

struct BenchScene {
    Gaussians gaussians;
    Camera camera;
    Image image;  // RGB in 256 levels; only for cases that train
};

/// A pure function of the case, equal on all machines up to the last bits of log, cos and exp. Splats lie
/// flat on ellipsoids before a backdrop. Their sizes are log-normal around their spacing on these surfaces.
/// So more splats make the surfaces finer, not thicker.
BenchScene make_scene(const Case& one);

}  // namespace ewa::bench
