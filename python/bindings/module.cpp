// SPDX-License-Identifier: Apache-2.0
// The extension module ewa._native, on which the package ewa is built.
#include <nanobind/nanobind.h>

#include "bindings.h"
#include "errors.h"
#include "ewa/error.h"

namespace nb = nanobind;

namespace {

/// The classes of ewa/_errors.py. The module lives as long as the process.
nb::object& error_class(const char* name) {
    static nb::object* const input = new nb::object(nb::module_::import_("ewa._errors").attr("InputError"));
    static nb::object* const device = new nb::object(nb::module_::import_("ewa._errors").attr("DeviceError"));
    return name[0] == 'I' ? *input : *device;
}

void translate(const std::exception_ptr& thrown, void*) {
    try {
        std::rethrow_exception(thrown);
    } catch (const ewa::InputError& error) {
        PyErr_SetString(error_class("InputError").ptr(), ewa::python::spelled(error.what()).c_str());
    } catch (const ewa::RunError& error) {
        PyErr_SetString(error_class("DeviceError").ptr(), ewa::python::spelled(error.what()).c_str());
    } catch (const nb::cast_error&) {
        PyErr_SetString(
            PyExc_TypeError,
            "an argument has another type than expected, or an object was made without its __init__");
    }
}

}  // namespace

NB_MODULE(_native, module) {
    module.doc() = "What the package ewa has from libewa.";
    module.attr("__version__") = EWA_VERSION;
    nb::set_leak_warnings(false);  // an exception's traceback may keep objects until the process ends
    nb::register_exception_translator(translate);
    ewa::python::keep_log();
    ewa::python::bind_device(module);
    ewa::python::bind_splats(module);
    ewa::python::bind_images(module);
    ewa::python::bind_render(module);
    ewa::python::bind_dataset(module);
    ewa::python::bind_metrics(module);
    ewa::python::bind_capture(module);
    ewa::python::bind_mesh(module);
    ewa::python::bind_train(module);
    ewa::python::bind_operators(module);
}
