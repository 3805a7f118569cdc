// SPDX-License-Identifier: Apache-2.0
#include "edit/steps.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "core/typing.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"

namespace ewa::edit {
namespace {

/// what: the option or the file that has the step.
[[noreturn]] void refuse(const std::string& what, const std::string& step) {
    throw InputError(
        what + ": '" + step +
        "' is not move=x,y,z, turn=x,y,z,degrees (about that axis), scale=s, or the 12 or 16 numbers of "
        "a matrix, row by row");
}

/// Numbers separated by commas, all finite. Throws InputError that names the option.
std::vector<double> parse_numbers(const std::string& option, const std::string& text) {
    const auto numbers = core::parse_list(text);
    if (!numbers) throw InputError(option + ": '" + text + "' is not a list of numbers separated by commas");
    return *numbers;
}

glm::dmat4 parse_matrix(const std::string& what, const std::string& step) {
    const std::vector<double> numbers = parse_numbers(what, step);
    if (numbers.size() != 12 && numbers.size() != 16) refuse(what, step);
    glm::dmat4 matrix(1.0);
    for (size_t i = 0; i < numbers.size(); ++i) matrix[int(i % 4)][int(i / 4)] = numbers[i];
    return matrix;
}

/// Quarter turns are exact, because their sine and cosine are set exactly.
glm::dmat4 turn(const glm::dvec3& axis, double degrees) {
    const double quarter = std::remainder(degrees, 360.0) / 90;
    double sine = std::sin(quarter * std::acos(0.0)), cosine = std::cos(quarter * std::acos(0.0));
    if (quarter == std::round(quarter)) {
        sine = std::round(sine);
        cosine = std::round(cosine);
    }
    const glm::dvec3 n = glm::normalize(axis);
    glm::dmat4 matrix(1.0);
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row)
            matrix[column][row] = (1 - cosine) * n[column] * n[row] + (column == row ? cosine : 0);
    matrix[0][1] += sine * n.z, matrix[1][0] -= sine * n.z;
    matrix[2][0] += sine * n.y, matrix[0][2] -= sine * n.y;
    matrix[1][2] += sine * n.x, matrix[2][1] -= sine * n.x;
    return matrix;
}

glm::dmat4 parse_step(const std::string& what, const std::string& step) {
    if (step.empty()) refuse(what, step);
    const size_t equals = step.find('=');
    if (equals == std::string::npos) return parse_matrix(what, step);
    const std::string name = step.substr(0, equals);
    const std::vector<double> n = parse_numbers(what, step.substr(equals + 1));
    if (name == "move" && n.size() == 3) return glm::translate(glm::dmat4(1.0), glm::dvec3(n[0], n[1], n[2]));
    if (name == "scale" && n.size() == 1) return glm::scale(glm::dmat4(1.0), glm::dvec3(n[0]));
    if (name == "turn" && n.size() == 4) {
        const glm::dvec3 axis(n[0], n[1], n[2]);
        if (std::isnormal(glm::dot(axis, axis))) return turn(axis, n[3]);
    }
    refuse(what, step);
}

size_t drawable_count(const Gaussians& gaussians) {
    size_t count = 0;
    for (size_t i = 0; i < gaussians.size(); ++i) count += drawable(gaussians, i);
    return count;
}

}  // namespace

glm::dmat4 parse_transform(const std::vector<std::string>& steps, const std::string& what) {
    glm::dmat4 matrix(1.0);
    for (const std::string& step : steps) matrix = parse_step(what, step) * matrix;
    return matrix;
}

double parse_scale_to(const std::string& text, const glm::dmat4& transform) {
    const std::vector<double> n = parse_numbers("--scale-to", text);
    if (n.size() != 7)
        throw InputError("--scale-to: '" + text +
                         "' is not x,y,z,X,Y,Z,LENGTH: two points, and how far they are apart");
    const glm::dvec4 between(n[3] - n[0], n[4] - n[1], n[5] - n[2], 0);
    const double factor = n[6] / glm::length(glm::dvec3(transform * between));
    if (!(n[6] > 0 && std::isfinite(factor) && factor > 0))
        throw InputError("--scale-to: '" + text + "' needs two points that differ, and a length above 0");
    return factor;
}

void change_splats(Gaussians& gaussians, const std::string& what,
                   const std::function<void(Gaussians&)>& change) {
    const size_t before = drawable_count(gaussians);
    try {
        change(gaussians);
    } catch (const InputError& error) {
        throw InputError(what + ": " + error.what());
    }
    const size_t after = drawable_count(gaussians);
    if (after < before)
        throw InputError(fmt::format(
            "{}: {} of {} splats could not be drawn afterwards: a value would exceed the range of "
            "float32 (3.4e38); use a smaller step, or remove them first with convert --crop",
            what, before - after, before));
}

void place_splats(Gaussians& gaussians, const glm::dmat4& matrix, const std::string& what) {
    if (matrix == glm::dmat4(1.0)) return;
    change_splats(gaussians, what, [&](Gaussians& g) { transform_splats(g, matrix); });
}

}  // namespace ewa::edit
