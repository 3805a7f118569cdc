// SPDX-License-Identifier: Apache-2.0
// Errors of work that uses files and no device.
#pragma once
#include <nanobind/nanobind.h>

#include "ewa/error.h"

namespace ewa::python {

/// Calls work without the interpreter. Its RunError, which is of the disk, becomes OSError.
template <class Work>
auto with_files(const Work& work) {
    try {
        const nanobind::gil_scoped_release released;
        return work();
    } catch (const RunError& error) {
        PyErr_SetString(PyExc_OSError, error.what());
        throw nanobind::python_error();
    }
}

}  // namespace ewa::python
