// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "geometry/body/body_model.h"
#include "geometry/body/body_model_fields.h"

namespace holdfast {

/// Reads and checks a body model's fields and brings them into SMPL-X's 55 joints; BodyModel::Load
/// says what they are and what is thrown. `name` goes into reports.
BodyModelParts ReadBodyModel(const BodyModelFields& fields, std::string name);

}  // namespace holdfast
