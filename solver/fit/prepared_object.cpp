// SPDX-License-Identifier: MIT
#include "solver/fit/prepared_object.h"

#include <utility>

namespace holdfast {

PreparedObject PrepareObject(LoadedObject object, int vertices, int threads) {
  std::vector<std::string> notes = object.notes;
  TriangleMesh simplified = ForFitting(object, vertices, &notes);
  Solid solid(object.mesh);
  FitObject fit = MakeFitObject(object.mesh, solid.distance, simplified, threads);
  return {std::move(object), std::move(solid), std::move(simplified), std::move(fit),
          std::move(notes)};
}

}  // namespace holdfast
