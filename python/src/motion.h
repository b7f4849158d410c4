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

/// What is to be taken, checked and prepared.
struct TakeCall {
  TakeRequest request;
  std::shared_ptr<const PreparedObject> object;
};

/// `goals`: middles of the object's bottom, where it stands, then where it shall be.
TakeCall TakeOf(const py::object& object, const ReachJob& job,
                const std::vector<Eigen::Vector3d>& goals, const ReachOptions& options);

/// ReachAndTake as a TakeResult. Throws FitFailure where nothing came of it, and Stopped.
py::object Take(const TakeCall& call, const ReachPerson& person,
                const wandr::NetworkWeights& network, const ReachOptions& options,
                std::vector<std::string> warnings, const py::object& progress);

void BindTake(py::module_& module);

}  // namespace holdfast::python
