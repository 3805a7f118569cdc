// SPDX-License-Identifier: Apache-2.0
#include "errors.h"

#include <nanobind/stl/string.h>

#include <cstring>

#include "core/folders.h"

namespace nb = nanobind;

namespace ewa::python {

std::string spelled(const char* text) {
    return nb::cast<std::string>(nb::module_::import_("ewa._errors").attr("spelled")(text));
}

void warn(PyObject* category, const std::string& text) {
    if (PyErr_WarnEx(category, text.c_str(), 1) != 0) throw nb::python_error();
}

void make_folder_of(const std::filesystem::path& file) {
    if (file.has_parent_path()) core::make_folder(file.parent_path());
}

}  // namespace ewa::python

// nanobind tells in many lines that a call fits no signature, and has no hook for that text. The linker gives its calls of
// PyErr_SetString to this function (--wrap), which lets ewa._errors say it in one line.
extern "C" {
void __real_PyErr_SetString(PyObject* type, const char* text);   // NOLINT
void __wrap_PyErr_SetString(PyObject* type, const char* text) {  // NOLINT
    if (type == PyExc_TypeError && std::strstr(text, "incompatible function arguments") != nullptr) {
        try {
            const nb::object line = nb::module_::import_("ewa._errors").attr("wrong_arguments")(text);
            return __real_PyErr_SetString(type, nb::cast<std::string>(line).c_str());
        } catch (nb::python_error& error) {
            error.discard_as_unraisable("ewa._errors.wrong_arguments");
        }
    }
    __real_PyErr_SetString(type, text);
}
}
