// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json.hpp>

#include "solver/transfer/surface_map.h"
#include "solver/transfer/transfer.h"

namespace holdfast {

/// A map in numbers, units in the names.
nlohmann::json MapJson(const SurfaceMapReport& map);

/// What became of each hold, a list.
nlohmann::json TransferredHoldsJson(const std::vector<TransferredHold>& holds);

/// What kept its way, and how body and arms followed.
nlohmann::json FollowingJson(const TransferReport& report);

}  // namespace holdfast
