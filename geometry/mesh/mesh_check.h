// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// What a mesh is like, and what is wrong with it. Edges, components and volumes are those of the
/// vertex ids as given: vertices at the same place are not taken as one.
struct MeshReport {
  Eigen::Index num_vertices = 0;
  Eigen::Index num_faces = 0;
  Eigen::Index num_edges = 0;
  Eigen::Index num_components = 0;  ///< sets of faces joined through shared edges

  Eigen::Index num_boundary_edges = 0;         ///< edges of one face
  Eigen::Index num_non_manifold_edges = 0;     ///< edges of three faces or more
  Eigen::Index num_non_manifold_vertices = 0;  ///< vertices where separate fans of faces touch
  Eigen::Index num_duplicate_vertices = 0;     ///< vertices at exactly the place of an earlier one
  Eigen::Index num_unreferenced_vertices = 0;  ///< vertices of no face
  Eigen::Index num_degenerate_faces = 0;       ///< a repeated corner, or all corners on one line
  Eigen::Index num_duplicate_faces = 0;        ///< the same three corners as an earlier face
  Eigen::Index num_misoriented_edges = 0;      ///< edges two faces run through the same way round

  /// Closed components that point inwards and lie in no other closed component.
  Eigen::Index num_inside_out_components = 0;
  /// Closed components that lie in another and point the same way: a solid within a solid rather
  /// than a cavity, so that their surfaces do not bound the whole.
  Eigen::Index num_nested_solids = 0;

  /// Nothing of the above is wrong: closed, manifold, consistent, outwards. Inside and outside are
  /// then defined and SignedDistance takes its exact sign. (Parts that cut through each other are
  /// not looked for.)
  bool watertight = false;

  Eigen::Vector3d extent_m = Eigen::Vector3d::Zero();  ///< bounding box of the vertices of faces
  double area_m2 = 0.0;
  double volume_m3 = 0.0;  ///< signed; meaningful when closed

  /// The largest extent is more than 2 m or less than 5 mm: not a handheld object in meters.
  bool implausible_size = false;
  /// Then the factor that gives meters if a common unit explains it: 0.001 (millimeters), 0.01
  /// (centimeters), 1000 (meters taken for millimeters) or 0.0254 (inches), the first that makes it
  /// hand-sized: the geometric mean of its extents is then 2.2 cm ... 22 cm. Else 1.
  double suggested_scale = 1.0;
};

/// Looks at a mesh without changing it: seconds for two million vertices, about 100 bytes per face.
/// Throws Error for ids out of range and coordinates that are not finite.
MeshReport CheckMesh(const TriangleMesh& mesh);

/// The factors that give meters if a common unit explains a size that is not handheld, the
/// likeliest first: what they make of it is 1 cm ... 30 cm in the geometric mean. `path` is the
/// mesh's file: .stl has no unit, and is in millimeters by custom.
std::vector<double> PossibleScales(const Eigen::Vector3d& extent_m, std::string_view path);

/// What to do about such a size: the options --object-scale, each with the size that it gives.
std::string UnitRemedy(const Eigen::Vector3d& extent_m, std::string_view path);

/// The report as plain sentences: what the mesh is, then each fault.
std::vector<std::string> Describe(const MeshReport& report);

struct RepairedMesh {
  TriangleMesh mesh;
  std::vector<std::string> actions;  ///< what was done, one plain sentence each; empty: nothing
  std::vector<int> source_vertex;    ///< per vertex of `mesh`: its id in the input
};

/// The repairs that cannot change the shape: welds vertices at exactly the same place, drops faces
/// with a repeated corner, doubled faces and vertices of no face, divides faces along corners that
/// lie on their sides in place of faces without area, turns faces to agree with their neighbors,
/// and closed parts outwards (with what lies inside them). Does not close holes, part what is not
/// manifold, or move a vertex: check the result. Throws Error as CheckMesh, and when no face is
/// left.
RepairedMesh RepairMesh(const TriangleMesh& mesh);

}  // namespace holdfast
