// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "python/src/fit.h"
#include "python/src/run.h"
#include "solver/reach/reach_and_take.h"

namespace holdfast::python {

/// A take, checked and prepared.
struct TakeCall {
  TakeRequest request;
  std::shared_ptr<const PreparedObject> object;
};

/// `goals`: centers of the object's bottom, first the initial place, then the targets.
TakeCall TakeOf(const py::object& object, const ReachJob& job,
                const std::vector<Eigen::Vector3d>& goals, const ReachOptions& options);

/// Runs ReachAndTake and returns a TakeResult. Throws FitFailure if it fails, and Stopped.
py::object Take(const TakeCall& call, const ReachPerson& person,
                const wandr::NetworkWeights& network, const ReachOptions& options,
                std::vector<std::string> warnings, const py::object& progress);

void BindTake(py::module_& module);

}  // namespace holdfast::python
