// SPDX-License-Identifier: Apache-2.0
#include "errors.h"

#include <nanobind/stl/string.h>

#include <cstdarg>
#include <cstring>
#include <mutex>
#include <string_view>
#include <vector>

#include "core/folders.h"
#include "ewa/log.h"

namespace nb = nanobind;

namespace ewa::python {

std::string spelled(const char* text) {
    return nb::cast<std::string>(nb::module_::import_("ewa._errors").attr("spelled")(text));
}

void warn(PyObject* category, const std::string& text) {
    if (PyErr_WarnEx(category, text.c_str(), 1) != 0) throw nb::python_error();
}

namespace {

struct Said {
    std::mutex mutex;
    std::vector<std::string> lines;
};

/// Never destroyed: other objects may say something while they are.
Said& said() {
    static auto* const one = new Said;
    return *one;
}

}  // namespace

void keep_log() {
    set_log_handler([](LogLevel, std::string_view text) {
        const std::lock_guard lock(said().mutex);
        said().lines.emplace_back(text);
    });
}

void say_log() {
    std::vector<std::string> lines;
    {
        const std::lock_guard lock(said().mutex);
        lines.swap(said().lines);
    }
    for (const std::string& line : lines) warn(PyExc_UserWarning, spelled(line.c_str()));
}

void make_folder_of(const std::filesystem::path& file) {
    if (file.has_parent_path()) core::make_folder(file.parent_path());
}

}  // namespace ewa::python

// nanobind tells in many lines that a call fits no signature, and has no hook for that text. The linker gives its calls of
// PyErr_SetString to this function (--wrap), which lets ewa._errors say it in one line.
extern "C" {
// Its warning of an object without __init__ adds nothing to the exception that follows.
int __wrap_PyErr_WarnFormat(PyObject* category, Py_ssize_t level, const char* format, ...) {  // NOLINT
    if (std::strncmp(format, "nanobind:", 9) == 0) return 0;
    va_list values;
    va_start(values, format);
    PyObject* text = PyUnicode_FromFormatV(format, values);
    va_end(values);
    if (!text) return -1;
    const nb::object owned = nb::steal(text);
    return PyErr_WarnEx(category, nb::cast<std::string>(owned).c_str(), level);
}
// Its functions have no signature that Python's inspect finds: a type that may change can be given one (ewa/_signatures.py).
PyObject* __real_PyType_FromSpec(PyType_Spec* spec);   // NOLINT
PyObject* __wrap_PyType_FromSpec(PyType_Spec* spec) {  // NOLINT
    for (const char* name : {"nanobind.nb_func", "nanobind.nb_method", "nanobind.nb_bound_method"})
        if (std::strcmp(spec->name, name) == 0) spec->flags &= ~(1u << 8);  // Py_TPFLAGS_IMMUTABLETYPE
    return __real_PyType_FromSpec(spec);
}
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
