// SPDX-License-Identifier: Apache-2.0
#include "arrays.h"

#include <algorithm>
#include <span>

namespace ewa::python {
namespace {

std::string shape_text(const std::vector<std::string>& lengths) {
    std::string text = "(";
    for (size_t i = 0; i < lengths.size(); ++i) text.append(i ? ", " : "").append(lengths[i]);
    return text + (lengths.size() == 1 ? ",)" : ")");
}

std::string expected_text(const Shape& shape) {
    std::vector<std::string> lengths;
    for (const ptrdiff_t length : shape)
        lengths.push_back(length == kLeading ? "..."
                          : length < 0       ? std::string(1, char(-length))
                                             : std::to_string(length));
    return shape_text(lengths);
}

bool fits(std::span<const ptrdiff_t> lengths, std::span<const ptrdiff_t> shape) {
    if (!shape.empty() && shape[0] == kLeading) {
        shape = shape.subspan(1);
        if (lengths.size() < shape.size()) return false;
        lengths = lengths.last(shape.size());
    }
    return std::equal(lengths.begin(), lengths.end(), shape.begin(), shape.end(),
                      [](ptrdiff_t is, ptrdiff_t expected) { return expected < 0 || is == expected; });
}

}  // namespace

nb::object numpy_argument(nb::handle value, const std::string& name, const char* dtype,
                          std::initializer_list<Shape> shapes) {
    const nb::module_ numpy = nb::module_::import_("numpy");
    nb::object array;
    try {
        array = numpy.attr("asarray")(value);
    } catch (nb::python_error& error) {
        if (!error.matches(PyExc_ValueError)) throw;
        throw nb::value_error((name + " is no array: its parts differ in length").c_str());
    }
    const auto kind = nb::cast<std::string>(array.attr("dtype").attr("kind"));
    const bool empty = nb::cast<size_t>(array.attr("size")) == 0;
    if (!empty && std::string("biuf").find(kind) == std::string::npos)
        throw nb::type_error((name + " holds no real numbers: its dtype is " +
                              nb::cast<std::string>(array.attr("dtype").attr("__str__")()))
                                 .c_str());
    const auto lengths = nb::cast<std::vector<ptrdiff_t>>(nb::list(array.attr("shape")));
    if (std::none_of(shapes.begin(), shapes.end(),
                     [&](const Shape& shape) { return fits(lengths, shape); })) {
        std::vector<std::string> is;
        for (const ptrdiff_t length : lengths) is.push_back(std::to_string(length));
        std::string expected;
        for (const Shape& shape : shapes)
            expected.append(expected.empty() ? "" : " or ").append(expected_text(shape));
        throw nb::value_error((name + " has the shape " + shape_text(is) + "; expected " + expected).c_str());
    }
    const nb::object converted =
        numpy.attr("asarray")(array, nb::arg("dtype") = dtype, nb::arg("order") = "C");
    // Numbers that are not whole, or too large, would become others.
    const bool whole = nb::cast<std::string>(converted.attr("dtype").attr("kind")) != "f";
    if (whole && !empty && !converted.is(array) &&
        !nb::cast<bool>(numpy.attr("array_equal")(converted, array)))
        throw nb::value_error((name + " holds numbers that are not whole, or not within " + dtype).c_str());
    return converted;
}

}  // namespace ewa::python
