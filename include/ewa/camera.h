// SPDX-License-Identifier: Apache-2.0
// A camera in the OpenCV convention: x right, y down, z forward, pixel centres at +0.5.
#pragma once
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <optional>

namespace ewa {

/// Lens models. src/scene/lens.h has the formulas.
enum class Lens {
    brown,       // radial (a quotient of polynomials) and tangential: OpenCV's perspective model
    fisheye,     // radial in the angle, tangential, thin prism: OpenCV's fisheye, COLMAP's THIN_PRISM_FISHEYE
    fisheye624,  // six radial terms, then tangential and thin prism: COLMAP's RAD_TAN_THIN_PRISM_FISHEYE
    fov,         // Devernay and Faugeras 2001; k1 is omega (radians)
    division,    // Fitzgibbon 2001; k1
    unified,     // enhanced unified camera model, Khomutenko et al. 2016; k1 is alpha, k2 is beta
    // The next two are no distortions of a pinhole.
    equirectangular,  // all directions: u = fx atan2(x, z) + cx, v = fy atan2(y, |(x, z)|) + cy (COLMAP's EQUIRECTANGULAR)
    orthographic,  // parallel rays along z: u = fx x + cx, v = fy y + cy; fx and fy are px per world unit
    radial4        // four radial terms and tangential: Metashape, RealityScan
};

/// The distortion of a lens relative to a pinhole. Names and signs are OpenCV's (calib3d, "Detailed
/// Description"). Parameters that a lens does not have are zero.
struct Distortion {
    double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0, k4 = 0, k5 = 0, k6 = 0;
    /// Thin prism: s1 and s3 are coefficients of the radius to the power of 2, s2 and s4 of that to the power of 4.
    double s1 = 0, s2 = 0, s3 = 0, s4 = 0;
    Lens lens = Lens::brown;
    double skew = 0;  // shears the image: x grows by skew times y, in focal lengths
    bool operator==(const Distortion&) const = default;
    /// Whether the lens is a pinhole.
    bool none() const { return *this == Distortion{}; }
};

/// Where the sensor of a rolling shutter begins to read the image.
enum class ReadoutFrom { top, bottom, left, right };

/// A rolling shutter, which reads one row or column after another. Camera::rotation and Camera::translation are the pose at the
/// start of the readout. From there to the pose at its end, the camera turns at a constant rate about one axis, and its centre
/// moves along a line.
struct Readout {
    ReadoutFrom from = ReadoutFrom::top;
    // The pose at the end of the readout, at the opposite border: world to camera, as in Camera.
    glm::dmat3 rotation{1.0};
    glm::dvec3 translation{0.0};
};

/// A view: pose, intrinsics, lens and shutter.
struct Camera {
    int width = 0, height = 0;              // px
    double fx = 0, fy = 0, cx = 0, cy = 0;  // px; (cx, cy) from the image's top left corner
    glm::dmat3 rotation{1.0};               // world to camera: p_camera = rotation * p_world + translation
    glm::dvec3 translation{0.0};            // world units
    Distortion distortion{};                // of the lens that images are rendered through; none: a pinhole
    std::optional<Readout> readout{};       // empty: a global shutter

    /// The camera's centre in world coordinates, -R^T t.
    glm::dvec3 position() const { return -(glm::transpose(rotation) * translation); }
};

/// The same view at 1/factor of the resolution, to match downscale(Image, factor). Sizes are rounded down, to
/// at least 1 px. Focal lengths and principal point are scaled by the exact ratio of sizes per axis. Throws
/// InputError for a factor below 1.
Camera downscale(const Camera& camera, int factor);

/// The same view at another image size, in px. Focal lengths and principal point scale with the image's width and height.
Camera resized(const Camera& camera, int width, int height);

}  // namespace ewa
