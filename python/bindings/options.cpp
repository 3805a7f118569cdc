// SPDX-License-Identifier: Apache-2.0
#include "options.h"

#include <algorithm>
#include <cmath>

#include "arrays.h"
#include "core/typing.h"
#include "ewa/error.h"

namespace ewa::python {

std::array<float, 3> background_of(nb::handle value) {
    if (nb::isinstance<nb::str>(value)) {
        const std::string text = nb::borrow<nb::str>(value).c_str();
        const auto color = core::parse_colour(text);
        if (!color) throw InputError("background: " + core::not_a_colour(text));
        return *color;
    }
    const Array<float> array(value, "background", {3});
    if (!std::all_of(array.data(), array.data() + 3, [](float x) { return std::isfinite(x); }))
        throw InputError("background is not finite");
    return {array.data()[0], array.data()[1], array.data()[2]};
}

}  // namespace ewa::python
