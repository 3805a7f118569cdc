// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "ewa/gaussians.h"

namespace ewa::viewer {

/// A scene with fewer splats, which is shown while the view changes.
struct Draft {
    std::shared_ptr<const Gaussians> splats;  // null: no draft
    std::shared_ptr<const std::vector<uint32_t>>
        rows;  // where they are in the scene; null: they are other splats, without marks
};

}  // namespace ewa::viewer
