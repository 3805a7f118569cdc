// SPDX-License-Identifier: Apache-2.0
#include "metrics.h"

#include <nanobind/stl/string.h>

#include <algorithm>
#include <array>
#include <set>
#include <sstream>

#include "arrays.h"
#include "bindings.h"
#include "core/text.h"
#include "images.h"

namespace ewa::python {
namespace {

constexpr std::array<const char*, 2> kLpips = {"lpips_vgg", "lpips_alex"};

/// The words of a list of metrics.
std::vector<std::string> words_of(nb::handle names) {
    std::vector<std::string> words;
    if (!nb::isinstance<nb::str>(names)) {
        for (const nb::handle name : names) words.push_back(nb::cast<std::string>(name));
        return words;
    }
    const std::string list = nb::cast<std::string>(names);
    if (list.empty()) return words;
    std::istringstream stream(list + ",");
    for (std::string word; std::getline(stream, word, ',');) words.push_back(word);
    return words;
}

nb::dict measure(nb::handle image, nb::handle reference, nb::handle names, nb::handle weights) {
    const AskedMetrics asked = asked_metrics(names);
    const Image judged = image_of(image, "image"), wanted = image_of(reference, "reference");
    const Image counts = weights.is_none() ? Image() : weights_of(weights);
    double psnr = 0, ssim = 0;
    std::vector<Figure> figures;
    {
        const nb::gil_scoped_release released;
        psnr = ewa::psnr(judged, wanted, counts);
        ssim = ewa::ssim(judged, wanted, counts);
        if (!asked.meter.empty()) figures = asked.meter.measure(judged, wanted, counts);
    }
    for (Figure& figure : lpips_figures(asked.lpips, judged, wanted, counts))
        figures.push_back(std::move(figure));
    return figures_dict(psnr, ssim, figures);
}

}  // namespace

AskedMetrics asked_metrics(nb::handle names) {
    std::string others;
    std::set<std::string> lpips;
    for (const std::string& word : words_of(names)) {
        const std::string known = core::lower(word);
        if (known == "lpips")
            lpips.insert(kLpips.begin(), kLpips.end());
        else if (std::ranges::find(kLpips, known) != kLpips.end())
            lpips.insert(known);
        else
            others.append(others.empty() ? "" : ",").append(word);
    }
    AskedMetrics asked;
    if (!others.empty()) asked.meter = Meter(metrics_named(others));
    for (const char* name : kLpips)
        if (lpips.contains(name)) asked.lpips.emplace_back(name);
    // A network that is missing is an error before the work.
    for (const std::string& name : asked.lpips) nb::module_::import_("ewa._lpips").attr("network")(name);
    return asked;
}

std::vector<Figure> lpips_figures(const std::vector<std::string>& names, const Image& image,
                                  const Image& reference, const Image& weights) {
    std::vector<Figure> figures;
    if (names.empty()) return figures;
    const nb::gil_scoped_acquire interpreter;
    const nb::object distance = nb::module_::import_("ewa._lpips").attr("distance");
    const nb::object judged = nb::cast(to_numpy(Image(image))), wanted = nb::cast(to_numpy(Image(reference)));
    const nb::object counts = weights.pixels.empty() ? nb::none() : nb::cast(to_numpy(Image(weights)));
    for (const std::string& name : names)
        figures.push_back({name, nb::cast<double>(distance(name, judged, wanted, counts))});
    return figures;
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
        nb::kw_only(), nb::arg("weights") = nb::none(),
        nb::sig("def metrics(image: numpy.typing.ArrayLike | os.PathLike[str], "
                "reference: numpy.typing.ArrayLike | os.PathLike[str], "
                "metrics: str | collections.abc.Sequence[str] = (), *, "
                "weights: numpy.typing.ArrayLike | None = None) -> dict[str, float]"),
        "PSNR, SSIM and the metrics with these names (docs/figures.md; \"all\" names all but LPIPS) of an "
        "image and "
        "what it should be: [H, W, 3] or [H, W, 4], from 0 to 1, where integers are from 0 to 255; or the "
        "files of images. weights: [H, W], how much each pixel counts. Raises InputError.");
}

}  // namespace ewa::python
