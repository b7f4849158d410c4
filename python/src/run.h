// SPDX-License-Identifier: MIT
#pragma once

#include <functional>

#include <pybind11/pybind11.h>

#include "geometry/progress.h"

namespace holdfast::python {

namespace py = pybind11;

/// Runs `work` on a thread of its own, without the interpreter's lock, while this one looks for
/// Ctrl-C. `work` is to stop when the progress it is given returns false. `progress` is None or a
/// callable (stage, done, total); False from it stops the work too. What it raises, and
/// KeyboardInterrupt, is raised here when the work has stopped; so is what `work` throws, and
/// Stopped after False.
void RunWithProgress(const py::object& progress,
                     const std::function<void(const StagedProgress&)>& work);

/// Threads to use for the argument `threads`: 0 means all that the process may use.
int ThreadsOf(int threads);

}  // namespace holdfast::python
