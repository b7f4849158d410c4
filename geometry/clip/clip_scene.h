// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// A clip with all that it takes to see or measure it.
struct ClipScene {
  std::string source;  ///< what messages call it
  Clip clip;
  std::shared_ptr<const BodyModel> body;
  Eigen::VectorXd betas;               ///< of that body
  bool foreign_body = false;           ///< the clip was made, and fitted, with another body model
  std::string made_with;               ///< which one
  std::optional<TriangleMesh> object;  ///< full resolution, in the object's own frame
  std::string object_source;           ///< where it came from, for LoadObject
  std::string object_missing;          ///< why there is none, for a clip that has an object track

  /// The vertices of the body in the clip: shaped, of the body model that was loaded.
  BodySurface Surface() const { return BodySurface(body, betas); }
};

}  // namespace holdfast
