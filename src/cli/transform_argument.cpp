// SPDX-License-Identifier: Apache-2.0
#include "cli/transform_argument.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "core/text.h"
#include "ewa/error.h"

namespace ewa::cli {
namespace {

[[noreturn]] void refuse(const std::string& step) {
    throw InputError(
        "--transform: '" + step +
        "' is not move=x,y,z, turn=x,y,z,degrees (round that axis), scale=s, or 12 or 16 numbers of a "
        "matrix, row after row");
}

glm::dmat4 parse_matrix(const std::string& step) {
    const std::vector<double> numbers = parse_numbers("--transform", step);
    if (numbers.size() != 12 && numbers.size() != 16) refuse(step);
    glm::dmat4 matrix(1.0);
    for (size_t i = 0; i < numbers.size(); ++i) matrix[int(i % 4)][int(i / 4)] = numbers[i];
    return matrix;
}

/// Whole quarter turns are exact: their sine and cosine are.
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

glm::dmat4 parse_step(const std::string& step) {
    const size_t equals = step.find('=');
    if (equals == std::string::npos) return parse_matrix(step);
    const std::string name = step.substr(0, equals);
    const std::vector<double> n = parse_numbers("--transform", step.substr(equals + 1));
    if (name == "move" && n.size() == 3) return glm::translate(glm::dmat4(1.0), glm::dvec3(n[0], n[1], n[2]));
    if (name == "scale" && n.size() == 1) return glm::scale(glm::dmat4(1.0), glm::dvec3(n[0]));
    if (name == "turn" && n.size() == 4 && std::hypot(n[0], n[1], n[2]) > 0)
        return turn({n[0], n[1], n[2]}, n[3]);
    refuse(step);
}

}  // namespace

std::vector<double> parse_numbers(const std::string& option, const std::string& text) {
    std::vector<double> numbers;
    size_t begin = 0;
    while (true) {
        const size_t end = std::min(text.find(',', begin), text.size());
        const std::optional<double> number =
            core::parse_number(core::trim(std::string_view(text).substr(begin, end - begin)));
        if (!number || !std::isfinite(*number))
            throw InputError(option + ": '" + text + "' is not a list of numbers separated by commas");
        numbers.push_back(*number);
        if (end == text.size()) return numbers;
        begin = end + 1;
    }
}

glm::dmat4 parse_transform(const std::vector<std::string>& steps) {
    glm::dmat4 matrix(1.0);
    for (const std::string& step : steps) matrix = parse_step(step) * matrix;
    return matrix;
}

}  // namespace ewa::cli
