// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include "geometry/body/body_model.h"

namespace holdfast {

/// Returns the hand of the embedded body as a model of a hand alone, in the form of MANO: used for
/// clips of a hand where no MANO file is given. Its wrist joint is where MANO's is, so that the
/// translations of MANO clips fit. It has no betas. Made once for each side, on first use.
std::shared_ptr<const BodyModel> DefaultHand(Side side);

}  // namespace holdfast
