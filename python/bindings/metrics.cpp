// SPDX-License-Identifier: Apache-2.0
#include "metrics.h"

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <algorithm>

#include "bindings.h"
#include "errors.h"
#include "ewa/error.h"
#include "images.h"

namespace ewa::python {
namespace {

nb::dict measure(nb::handle image, nb::handle reference, nb::handle names, nb::handle weights,
                 const std::optional<std::filesystem::path>& lpips_weights) {
    const Meter meter = meter_of(names, lpips_weights);
    const Image judged = image_of(image, "image"), wanted = image_of(reference, "reference");
    const Image counts = weights.is_none() ? Image() : weights_of(weights);
    double psnr = 0, ssim = 0;
    std::vector<Figure> figures;
    {
        const nb::gil_scoped_release released;
        psnr = ewa::psnr(judged, wanted, counts);
        ssim = ewa::ssim(judged, wanted, counts);
        if (!meter.empty()) figures = meter.measure(judged, wanted, counts);
    }
    return figures_dict(psnr, ssim, figures);
}

}  // namespace

Meter meter_of(nb::handle names, const std::optional<std::filesystem::path>& lpips_weights) {
    std::string list;
    if (nb::isinstance<nb::str>(names))
        list = nb::cast<std::string>(names);
    else
        for (const nb::handle name : names)
            list.append(list.empty() ? "" : ",").append(nb::cast<std::string>(name));
    if (list.empty()) return {};
    std::vector<std::string> all = metrics_named(list);
    const auto is_lpips = [](const std::string& name) { return name.starts_with("lpips"); };
    if (!lpips_weights) {
        // "all" is what can be measured.
        if (list != "all" && std::ranges::any_of(all, is_lpips))
            throw InputError("metrics: lpips needs lpips_weights, a file that scripts/lpips-weights writes");
        std::erase_if(all, is_lpips);
    }
    return Meter(all, lpips_weights.value_or(std::filesystem::path()));
}

nb::dict figures_dict(double psnr, double ssim, const std::vector<Figure>& figures) {
    nb::dict all;
    all["psnr"] = psnr;
    all["ssim"] = ssim;
    for (const Figure& figure : figures) all[figure.name.c_str()] = figure.value;
    return all;
}

FigureState pickled(const std::vector<Figure>& figures) {
    FigureState state;
    for (const Figure& figure : figures) state.emplace_back(figure.name, figure.value);
    return state;
}

std::vector<Figure> figures_of(const FigureState& state) {
    std::vector<Figure> figures;
    for (const auto& [name, value] : state) figures.push_back({name, value});
    return figures;
}

void bind_metrics(nb::module_& module) {
    module.def(
        "metrics", measure, nb::arg("image"), nb::arg("reference"), nb::arg("metrics") = nb::tuple(),
        nb::kw_only(), nb::arg("weights") = nb::none(), nb::arg("lpips_weights") = nb::none(),
        nb::sig("def metrics(image: numpy.typing.ArrayLike | os.PathLike[str], "
                "reference: numpy.typing.ArrayLike | os.PathLike[str], "
                "metrics: str | collections.abc.Sequence[str] = (), *, "
                "weights: numpy.typing.ArrayLike | None = None, "
                "lpips_weights: str | os.PathLike[str] | None = None) -> dict[str, float]"),
        "PSNR, SSIM and the metrics with these names (docs/figures.md; \"all\" names all) of an image and "
        "what it should be: [H, W, 3] or [H, W, 4], from 0 to 1, where integers are from 0 to 255; or the "
        "files of images. weights: [H, W], how much each pixel counts. Raises InputError.");
}

}  // namespace ewa::python
