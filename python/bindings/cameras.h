// SPDX-License-Identifier: Apache-2.0
// Cameras as arrays: world-to-camera matrices and intrinsics, in the OpenCV convention.
#pragma once
#include <string>
#include <vector>

#include "arrays.h"
#include "ewa/camera.h"

namespace ewa::python {

struct Cameras {
    std::vector<Camera> all;
    bool batch = true;  // false: viewmats is one matrix
};

/// The lens of all cameras. model: pinhole, opencv, fisheye, equirectangular or orthographic. distortion: terms in OpenCV's order.
struct LensArguments {
    std::string model = "pinhole";
    nb::object distortion = nb::none();
};

/// A rolling shutter of all cameras. order: "global", or a direction. ends: as viewmats, when the readout reaches its last border.
struct ReadoutArguments {
    std::string order = "global";
    nb::object ends = nb::none();
};

#define EWA_LENS_TYPES                                                                                   \
    "camera_model: typing.Literal['pinhole', 'opencv', 'fisheye', 'equirectangular', 'orthographic'] = " \
    "'pinhole', "                                                                                        \
    "distortion: numpy.typing.ArrayLike | None = None"

#define EWA_READOUT_TYPES                                                                           \
    "rolling_shutter: typing.Literal['global', 'top-to-bottom', 'bottom-to-top', 'left-to-right', " \
    "'right-to-left'] "                                                                             \
    "= 'global', viewmats_end: numpy.typing.ArrayLike | None = None"

/// viewmats: [C, 4, 4] or [4, 4]. Ks: [C, 3, 3] or [3, 3] for all; None for an equirectangular image of all directions. Throws
/// ValueError that names the argument.
Cameras cameras_of(nb::handle viewmats, nb::handle intrinsics, int width, int height,
                   const LensArguments& lens, const ReadoutArguments& readout);

/// One lens a camera. terms: None, or [cameras..., 12] in OpenCV's order k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4. count: of the cameras.
std::vector<Distortion> distortions_of(const std::string& model, nb::handle terms, const Shape& cameras,
                                       size_t count);

/// What cameras_of takes for this camera's lens; distortion is None without one.
std::string model_of(const Distortion& lens);
nb::object terms_of(const Distortion& lens);

/// [n, 4, 4] and [n, 3, 3].
nb::ndarray<nb::numpy, double> viewmats_of(const std::vector<Camera>& cameras);
/// "global", or the order of the readout.
std::string order_of(const Camera& camera);
/// The cameras when their readouts end.
std::vector<Camera> ends_of(const std::vector<Camera>& cameras);
nb::ndarray<nb::numpy, double> intrinsics_of(const std::vector<Camera>& cameras);

}  // namespace ewa::python
