// SPDX-License-Identifier: Apache-2.0
#include "io/datasets/rotation.h"

#include <algorithm>
#include <cmath>
#include <glm/matrix.hpp>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/json_field.h"

namespace ewa::io {

namespace {

// Deviation of a rotation's columns from unit length and right angles. Files with four decimals stay below it.
constexpr double kMaxRotationError = 1e-2;

glm::dmat3 of_unit_volume(const glm::dmat3& m) {
    return m / std::cbrt(glm::determinant(m));
}

double rotation_error(const glm::dmat3& m) {
    const glm::dmat3 product = glm::transpose(m) * m;
    double error = 0;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) error = std::max(error, std::abs(product[i][j] - (i == j ? 1.0 : 0.0)));
    return error;
}

}  // namespace

std::string rotation_fault(const glm::dmat3& matrix) {
    const double determinant = glm::determinant(matrix);
    if (!(determinant > 0) || !std::isfinite(determinant)) return "it mirrors or is degenerate";
    if (!(rotation_error(of_unit_volume(matrix)) <= kMaxRotationError))
        return "its columns differ in length or are not at right angles";
    return {};
}

glm::dmat3 nearest_rotation(const glm::dmat3& matrix) {
    // The orthogonal factor of the polar decomposition, by Higham's iteration.
    glm::dmat3 m = of_unit_volume(matrix);
    for (int i = 0; i < 30; ++i) m = 0.5 * (m + glm::transpose(glm::inverse(m)));
    return m;
}

void set_pose(Camera& camera, const glm::dmat3& axes, const glm::dvec3& center) {
    camera.rotation = glm::transpose(axes);
    camera.translation = -(camera.rotation * center);
}

void read_opengl_pose(const core::JsonField& field, const char* key, Camera& camera) {
    const size_t parts = field.at(key).value().size(), count = parts == 3 ? 12 : 16;
    const char* form = "3 or 4 rows of 4 finite numbers";
    const std::vector<double> m = field.numbers(key, count, count, form);
    // A list of 16 numbers may go row by row or column by column. Its last row then has the translation.
    const bool by_columns = parts == 16 && (m[12] != 0 || m[13] != 0 || m[14] != 0);
    if (by_columns || (parts != 3 && parts != 4 && parts != 16))
        field.fail(std::string("\"") + key + "\" is not " + form);
    const glm::dmat3 axes(m[0], m[4], m[8], m[1], m[5], m[9], m[2], m[6], m[10]);
    if (const std::string fault = rotation_fault(axes); !fault.empty())
        field.fail(std::string("\"") + key + "\" is not a rotation: " + fault);
    set_pose(camera, from_opengl(nearest_rotation(axes)), {m[3], m[7], m[11]});
}

}  // namespace ewa::io
