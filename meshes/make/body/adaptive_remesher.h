// SPDX-License-Identifier: MIT
#pragma once

#include <functional>

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// What the remesher has to know about the surface.
struct RemeshTarget {
  /// Wanted edge length at a point, metres.
  std::function<double(const Eigen::Vector3d&)> edge_length;
  /// Nearest point of the surface; of its border curve when the second argument is true.
  std::function<Eigen::Vector3d(const Eigen::Vector3d&, bool)> project;
};

/// Isotropic remeshing with a sizing field: rounds of splitting long edges, collapsing short ones,
/// flipping towards valence six (four on the border), smoothing in the tangent plane and projecting
/// back (Botsch and Kobbelt 2004; sizing after Dunyach et al. 2013). A border stays a border.
TriangleMesh Remesh(const TriangleMesh& mesh, const RemeshTarget& target, int rounds);

}  // namespace holdfast
