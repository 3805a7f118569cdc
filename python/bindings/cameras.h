// SPDX-License-Identifier: Apache-2.0
// Cameras as arrays: world-to-camera matrices and intrinsics, in the OpenCV convention.
#pragma once
#include <vector>

#include "arrays.h"
#include "ewa/camera.h"

namespace ewa::python {

struct Cameras {
    std::vector<Camera> all;
    bool batch = true;  // false: viewmats is one matrix
};

/// viewmats: [C, 4, 4] or [4, 4]. Ks: [C, 3, 3] or [3, 3] for all. Throws ValueError that names the argument.
Cameras cameras_of(nb::handle viewmats, nb::handle intrinsics, int width, int height);

/// [n, 4, 4] and [n, 3, 3].
nb::ndarray<nb::numpy, double> viewmats_of(const std::vector<Camera>& cameras);
nb::ndarray<nb::numpy, double> intrinsics_of(const std::vector<Camera>& cameras);

}  // namespace ewa::python
