// SPDX-License-Identifier: Apache-2.0
// What the cases of the stability suite are made of.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <glm/mat3x3.hpp>
#include <string>
#include <vector>

#include "bench/stability/stability.h"

namespace ewa::bench {

/// Four numbers in [0, 1), equal on all machines. i: of a splat.
std::array<double, 4> numbers_of(uint32_t i, uint32_t stream);
double between(double u, double low, double high);

/// About x, then y; radians.
glm::dmat3 turned(double angle_x, double angle_y);

/// A small image from a generic position.
Camera usual_camera();

struct Sketch {
    glm::dvec3 view{0, 0, 4};  // camera coordinates
    glm::dvec3 scale{0.2};     // world units
    std::array<double, 4> quaternion{1, 0, 0, 0};
    double logit = 0;
};

/// A splat at a random position in the image of a pinhole, 2 to 12 % of the image's size wide.
Sketch usual_sketch(uint32_t i, const Camera& camera, double z);
/// From 2 to 8.
double usual_depth(uint32_t i);

using Change = std::function<void(Sketch&, uint32_t index)>;

class Builder {
  public:
    explicit Builder(const Camera& camera, int sh_degree = 1);
    void add(const Sketch& sketch);
    /// Adds splats at the usual depths times `depth`.
    void add_usual(uint32_t count, const Change& change = {}, double depth = 1);
    Gaussians take() { return std::move(out_); }

  private:
    Camera camera_;
    Gaussians out_;
};

struct Table {
    std::vector<StabilityCase> cases;

    /// Over a background of a colour.
    void add(std::string name, std::string what, Gaussians gaussians, const Camera& camera = usual_camera(),
             Footprint kernel = Footprint::peak);
};

/// Cameras with other lenses than a pinhole.
void add_lenses(Table& table);

/// Cameras that move while a rolling shutter reads the image.
void add_readouts(Table& table);

}  // namespace ewa::bench
