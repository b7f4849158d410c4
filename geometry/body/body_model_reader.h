// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "geometry/body/body_model.h"
#include "geometry/body/skeleton.h"
#include "geometry/io/container/npz.h"

namespace holdfast {

/// Reads and checks the fields of a body model and converts them to SMPL-X's 55 joints. For the
/// fields and errors see BodyModel::Load. Supports `.npz` (read member by member) and pickles as
/// SMPL-X, SMPL-H and MANO are distributed (see DataFile: nothing in the pickle is executed; sparse
/// matrices and chumpy arrays are converted to plain arrays). The name is the file's stem.
BodyModelParts ReadBodyModel(const std::filesystem::path& path);
/// `name` is used in reports.
BodyModelParts ReadBodyModel(NpzReader archive, std::string name);

inline constexpr int kSmplxVertices = 10475;

}  // namespace holdfast
