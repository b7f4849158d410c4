// SPDX-License-Identifier: MIT
#include "solver/fit/prepared_object.h"

#include <future>
#include <optional>
#include <utility>

#include "geometry/parallel.h"

namespace holdfast {

PreparedObject PrepareObject(LoadedObject object, int vertices, int threads) {
  std::vector<std::string> notes = object.notes;
  std::optional<Solid> solid;
  FitObject fit;
  auto prepared = std::async(threads > 1 ? std::launch::async : std::launch::deferred,
                             [&, stop = StopOn::Flag()] {
                               const StopOn inherited(stop);
                               solid.emplace(object.mesh);
                               fit = MakeFitObject(object.mesh, solid->distance, {}, threads);
                             });
  TriangleMesh simplified = ForFitting(object, vertices, &notes);
  prepared.get();
  fit.vertices = simplified.vertices;
  return {std::move(object), std::move(*solid), std::move(simplified), std::move(fit),
          std::move(notes)};
}

}  // namespace holdfast
