// SPDX-License-Identifier: Apache-2.0
// The parts of the module ewa._native. Each adds its functions and classes.
#pragma once
#include <nanobind/nanobind.h>

#include <string>
#include <vector>

#include "ewa/gaussians.h"

namespace ewa::python {

void bind_device(nanobind::module_& module);
void bind_splats(nanobind::module_& module);
void bind_images(nanobind::module_& module);
void bind_render(nanobind::module_& module);
void bind_dataset(nanobind::module_& module);
void bind_metrics(nanobind::module_& module);
void bind_capture(nanobind::module_& module);
void bind_mesh(nanobind::module_& module);
void bind_train(nanobind::module_& module);
void bind_operators(nanobind::module_& module);

/// ewa.Splats.
struct Splats {
    Gaussians gaussians;
    bool antialiased = false;  // trained for antialiased renders
    std::vector<std::string> comments = {};
};

}  // namespace ewa::python
