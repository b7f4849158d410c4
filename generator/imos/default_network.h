// SPDX-License-Identifier: MIT
#pragma once

#include "generator/imos/weights.h"

namespace holdfast::imos {

/// Whether this library was built with trained weights in it (meshes/networks/imos.safetensors).
bool HasDefaultNetwork();

/// Those weights. Throws Error when there are none.
NetworkWeights DefaultNetwork();

}  // namespace holdfast::imos
