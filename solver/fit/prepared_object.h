// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "geometry/io/mesh/load_object.h"
#include "geometry/score/exact_intersection.h"
#include "solver/fit/fit_options.h"

namespace holdfast {

/// An object with all that a fit asks of it; const, shared by fits.
struct PreparedObject {
  LoadedObject object;
  Solid solid;              ///< of the full mesh
  TriangleMesh simplified;  ///< for the pair terms
  FitObject fit;
  std::vector<std::string> notes;  ///< of loading and simplifying
};

/// Simplifies the object to `vertices` for the pair terms and prepares its distances, on up to
/// `threads` threads. Throws what Decimate and SignedDistance throw.
PreparedObject PrepareObject(LoadedObject object, int vertices = 300, int threads = 1);

}  // namespace holdfast
