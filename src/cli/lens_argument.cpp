// SPDX-License-Identifier: Apache-2.0
#include "cli/lens_argument.h"

#include <cmath>
#include <sstream>
#include <vector>

#include "core/text.h"
#include "ewa/error.h"

namespace ewa::cli {

LensArgument lens_of(const std::string& text) {
    constexpr size_t kShown = 60;  // bytes of the text in an error
    const size_t colon = text.find(':');
    const std::string name = text.substr(0, colon);
    std::vector<double> numbers;
    std::stringstream list(colon == std::string::npos ? "" : text.substr(colon + 1));
    for (std::string word; std::getline(list, word, ',');) {
        const auto number = core::parse_number(word);
        if (!number || !std::isfinite(*number))
            throw InputError("--through: '" + word.substr(0, kShown) + "' is not a number; expected " +
                             kLensForms);
        numbers.push_back(*number);
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
