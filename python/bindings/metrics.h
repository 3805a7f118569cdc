// SPDX-License-Identifier: Apache-2.0
// Metrics of images, as arguments and as results.
#pragma once
#include <nanobind/nanobind.h>

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ewa/metrics.h"

namespace ewa::python {

/// names: a list of them, or a text of names with commas. Throws InputError, also for LPIPS without its weights.
Meter meter_of(nanobind::handle names, const std::optional<std::filesystem::path>& lpips_weights);

/// psnr, ssim and the others under their names.
nanobind::dict figures_dict(double psnr, double ssim, const std::vector<Figure>& figures);

// For pickles.
using FigureState = std::vector<std::pair<std::string, double>>;
FigureState pickled(const std::vector<Figure>& figures);
std::vector<Figure> figures_of(const FigureState& state);

}  // namespace ewa::python
