// SPDX-License-Identifier: Apache-2.0
// A way through a few cameras.
#pragma once
#include <span>

#include "ewa/camera.h"

namespace ewa {

/// The camera at `time` along the keys, of which there is at least one: key i at time i, held before the
/// first and after the last. Positions follow a uniform Catmull-Rom spline (Catmull and Rom 1974), whose ends
/// go on straight; rotations the shortest great arc; focal lengths are geometric means, in shares of the
/// first key's width. Size and relative principal point are the first key's.
Camera along_path(std::span<const Camera> keys, double time);

}  // namespace ewa
