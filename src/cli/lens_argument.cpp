// SPDX-License-Identifier: Apache-2.0
#include "cli/lens_argument.h"

#include <string_view>
#include <vector>

#include "core/typing.h"
#include "ewa/error.h"
#include "options/option.h"

namespace ewa::cli {

using options::kLensForms;

LensArgument lens_of(const std::string& text) {
    constexpr size_t kShown = 60;  // bytes of the text in an error
    const size_t colon = text.find(':');
    const std::string name = text.substr(0, colon);
    std::vector<double> numbers;
    if (colon != std::string::npos) {
        const auto list = core::parse_list(std::string_view(text).substr(colon + 1));
        if (!list)
            throw InputError("--through: '" + text.substr(colon + 1, kShown) +
                             "' is not a list of numbers; expected " + kLensForms);
        numbers = *list;
    }
    const size_t most = name == "fisheye" ? 1 : name == "opencv" ? 4 : 0;
    const bool good = name == "fisheye" || name == "equirectangular" || name == "orthographic" ||
                      (name == "opencv" && !numbers.empty() && numbers.size() != 3);
    if (!good || numbers.size() > most)
        throw InputError("--through: '" + text.substr(0, kShown) + "' is no lens; expected " + kLensForms);
    LensArgument out;
    if (name == "fisheye") {
        out.lens.lens = Lens::fisheye;
        if (!numbers.empty()) out.fisheye_degrees = numbers[0];
        if (!(out.fisheye_degrees > 0 && out.fisheye_degrees <= 360))
            throw InputError("--through: a fisheye shows more than 0 and at most 360 degrees");
    } else if (name == "equirectangular") {
        out.lens.lens = Lens::equirectangular;
    } else if (name == "orthographic") {
        out.lens.lens = Lens::orthographic;
    } else {
        numbers.resize(4);
        out.lens = {.k1 = numbers[0], .k2 = numbers[1], .p1 = numbers[2], .p2 = numbers[3]};
    }
    return out;
}

}  // namespace ewa::cli
