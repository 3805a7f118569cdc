// SPDX-License-Identifier: Apache-2.0
// Rotations as files have them: with a uniform factor, or rounded to a few decimals.
#pragma once
#include <glm/mat3x3.hpp>
#include <string>

#include "ewa/camera.h"

namespace ewa::core {
class JsonField;
}

namespace ewa::io {

/// Why the matrix is no rotation times a positive factor; empty if it is one, up to rounding to four decimals.
std::string rotation_fault(const glm::dmat3& matrix);

/// The nearest rotation. The matrix must have no fault.
glm::dmat3 nearest_rotation(const glm::dmat3& matrix);

/// Puts the camera at `center`. axes: its x (right), y (down) and z (forward) in the world, as columns.
void set_pose(Camera& camera, const glm::dmat3& axes, const glm::dvec3& center);

/// Converts camera axes of OpenGL and ARKit (x right, y up, z back) to OpenCV's (x right, y down, z forward). Columns are axes.
inline glm::dmat3 from_opengl(const glm::dmat3& axes) {
    return {axes[0], -axes[1], -axes[2]};
}

/// Sets the camera's pose from a 4 x 4 matrix in JSON, row by row. The matrix maps a camera with OpenGL's axes to the world. Its
/// last row may be missing, and all numbers may be in one list.
/// Throws InputError.
void read_opengl_pose(const core::JsonField& field, const char* key, Camera& camera);

}  // namespace ewa::io
