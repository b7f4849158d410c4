// SPDX-License-Identifier: MIT
#pragma once

#include "generator/wandr/network.h"

namespace holdfast::wandr {

/// Whether this library was built with trained weights in it (meshes/networks/wandr.safetensors).
bool HasDefaultNetwork();

/// Those weights. Throws Error when there are none.
NetworkWeights DefaultNetwork();

}  // namespace holdfast::wandr
