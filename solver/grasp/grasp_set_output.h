// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <string>

#include "geometry/body/skeleton.h"
#include "geometry/io/container/npz.h"
#include "solver/grasp/grasp_set.h"

namespace holdfast {

/// A set of N grasps with C contacts in all as arrays by name, as docs/formats.md lists them: poses
/// (N, 4, 4), finger angles (N, 45), qualities (N,), contacts (C, ...) with the grasp of each.
std::map<std::string, NpyArray> GraspSetArrays(const GraspSet& set, const std::string& object,
                                               Side side);

/// The qualities and the wrist's pose as a table: a row for each grasp, best first.
std::string GraspSetCsv(const GraspSet& set);

}  // namespace holdfast
