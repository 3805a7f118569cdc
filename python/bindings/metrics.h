// SPDX-License-Identifier: Apache-2.0
// Metrics of images, as arguments and as results.
#pragma once
#include <nanobind/nanobind.h>

#include <string>
#include <utility>
#include <vector>

#include "ewa/metrics.h"

namespace ewa::python {

/// The metrics of a call beside PSNR and SSIM.
struct AskedMetrics {
    Meter meter;
    std::vector<std::string> lpips;  // those that the Python package lpips measures
};

/// names: a list of them, or a text of names with commas. Throws InputError, and what ewa._lpips raises where a network is missing.
AskedMetrics asked_metrics(nanobind::handle names);

/// The figures with these names of AskedMetrics::lpips. Arguments as in Meter::measure. Takes the interpreter. Throws what Python raises.
std::vector<Figure> lpips_figures(const std::vector<std::string>& names, const Image& image,
                                  const Image& reference, const Image& weights);

/// psnr, ssim and the others under their names.
nanobind::dict figures_dict(double psnr, double ssim, const std::vector<Figure>& figures);

// For pickles.
using FigureState = std::vector<std::pair<std::string, double>>;
FigureState pickled(const std::vector<Figure>& figures);
std::vector<Figure> figures_of(const FigureState& state);

}  // namespace ewa::python
