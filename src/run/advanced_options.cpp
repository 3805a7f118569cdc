// SPDX-License-Identifier: Apache-2.0
#include "run/advanced_options.h"

#include <algorithm>
#include <type_traits>

#include "run/option_rows.h"

namespace ewa::train {
namespace {

constexpr double kMostUsually = 1e9;

template <auto member>
auto& advanced_member(RunOptions& options) {
    return options.train.*member;
}

/// Runs from before the row existed had the usual value.
template <auto member>
RunOption advanced(const char* name, const char* help, double low = 0, double high = kMostUsually) {
    using T = std::decay_t<decltype(TrainOptions().*member)>;
    RunOption option{};
    if constexpr (std::is_same_v<T, double>)
        option = real(name, "X", help, &advanced_member<member>, low, high);
    else
        option = number<T>(name, "N", help, kDecides, &advanced_member<member>, T(low), T(high));
    option.before = option.get(RunOptions()).dump();
    option.python = name;
    std::ranges::replace(option.python, '-', '_');
    return option;
}

}  // namespace

std::vector<RunOption> advanced_options() {
    using O = TrainOptions;
    constexpr double kLeastOpacity = 1e-6, kMostOpacity = 0.999, kMostNoise = 1e18, kMostGrowth = 1000;
    return {
        advanced<&O::means_rate>("means-rate", "Learning rate of the means, per unit of scene extent"),
        advanced<&O::means_rate_final>("means-rate-final", "The same at the end of the run"),
        advanced<&O::sh0_rate>("sh0-rate", "Learning rate of the colours of SH degree 0"),
        advanced<&O::sh_rest_rate>("sh-rest-rate", "Learning rate of the colours of higher degrees"),
        advanced<&O::opacity_rate>("opacity-rate", "Learning rate of the opacities"),
        advanced<&O::scale_rate>("scale-rate", "Learning rate of the scales"),
        advanced<&O::quaternion_rate>("quaternion-rate", "Learning rate of the rotations"),
        advanced<&O::short_run_power>("short-run-power",
                                      "Rates grow with 30,000 / steps to this power. 0: they do not"),
        advanced<&O::few_photos>("few-photos",
                                 "With so many training images or fewer, adc and none are regularised"),
        advanced<&O::exposure_rate>("exposure-rate", "Learning rate of the exposures"),
        advanced<&O::exposure_rate_final>("exposure-rate-final", "The same at the end of the run"),
        advanced<&O::background_noise>(
            "background-noise", "Width of the noise that each step adds to each channel of the background"),
        advanced<&O::sky_rate>("sky-rate", "Learning rate of the sky"),
        advanced<&O::sky_rate_final>("sky-rate-final", "The same at the end of the run"),
        advanced<&O::appearance_rate>("appearance-rate", "Learning rate of --appearance ppisp and grid"),
        advanced<&O::pose_rate>("pose-rate", "Learning rate of the cameras"),
        advanced<&O::pose_rate_final>("pose-rate-final", "The same at the end of the run"),
        advanced<&O::refine_start>("refine-start", "The number of splats changes after this step"),
        advanced<&O::refine_stop>("refine-stop", "adc: the number of splats changes before this step"),
        advanced<&O::refine_every>("refine-every", "Steps between two changes of the number of splats", 1),
        advanced<&O::opacity_reset_every>("opacity-reset-every",
                                          "adc: steps between two resets of the opacities. 0: none"),
        advanced<&O::sh_degree_every>("sh-degree-every", "Steps after which the SH degree rises by one", 1),
        advanced<&O::resolution_every>(
            "resolution-every", "With --resolution-schedule: steps after which the images' sides double", 1),
        advanced<&O::grow_gradient>("grow-gradient",
                                    "adc: mean gradient above which a splat is cloned or split"),
        advanced<&O::grow_gradient_absolute>("grow-gradient-absolute", "The same with --absgrad"),
        advanced<&O::split_scale>("split-scale",
                                  "adc: larger splats are split, others cloned. A share of the scene extent"),
        advanced<&O::prune_opacity>("prune-opacity", "adc: splats of less opacity are removed", kLeastOpacity,
                                    kMostOpacity),
        advanced<&O::prune_scale>("prune-scale",
                                  "adc: larger splats are removed. A share of the scene extent"),
        advanced<&O::relocate_stop>("relocate-stop", "mcmc: the number of splats changes before this step"),
        advanced<&O::growth>("growth", "mcmc: factor of the number of splats at each change", 1, kMostGrowth),
        advanced<&O::copy_spread>("copy-spread",
                                  "mcmc: distance of a copy from its source, in standard deviations"),
        advanced<&O::dead_opacity>("dead-opacity", "mcmc: splats of less opacity are relocated",
                                   kLeastOpacity, kMostOpacity),
        advanced<&O::noise_rate>("noise-rate", "mcmc: noise of the means, times their learning rate", 0,
                                 kMostNoise),
        advanced<&O::opacity_weight>("opacity-weight", "mcmc: weight of the mean opacity in the loss"),
        advanced<&O::scale_weight>("scale-weight", "mcmc: weight of the mean scale in the loss"),
    };
}

}  // namespace ewa::train
