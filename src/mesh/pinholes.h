// SPDX-License-Identifier: Apache-2.0
// Pinholes that together see the views of a dataset's cameras.
#pragma once
#include <span>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/image.h"

namespace ewa::mesh {

class Pinholes {
  public:
    explicit Pinholes(std::vector<Camera> cameras) : cameras_(std::move(cameras)) {}
    /// 360° images and fisheyes become sides of cubes, with the pixels per degree in the middle of the image. Other lenses are
    /// undistorted. through_fisheyes: also what undistortion has cut off the images of fisheyes. Throws InputError that names a frame
    /// which no pinhole shows.
    Pinholes(const Dataset& dataset, bool through_fisheyes);

    std::span<const Camera> cameras() const { return cameras_; }

    /// Sets pixels to 0 that the fisheye of view i does not show.
    void cut(size_t i, Image& image) const;

  private:
    struct Fisheye {
        Camera camera;
        double limit = 0;  // lens_limit
        /// Whether it shows what `side`, at the same place, has at these px.
        bool shows(const Camera& side, double x, double y) const;
    };
    void add_cube(const Camera& around, const Fisheye* fisheye);

    std::vector<Camera> cameras_;
    std::vector<Fisheye> fisheyes_;
    std::vector<int> fisheye_of_;  // of each camera; -1: none. Empty: of none
};

}  // namespace ewa::mesh
