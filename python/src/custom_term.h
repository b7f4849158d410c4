// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "python/src/numpy.h"
#include "solver/fit/custom_term.h"

namespace holdfast::python {

/// Converts None, or a list of holdfast.CustomTerm.
std::vector<CustomTerm> CustomTermsOf(const py::object& terms);

}  // namespace holdfast::python
