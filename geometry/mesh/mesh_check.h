// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Properties and defects of a mesh. Edges, components and volumes refer to the vertex ids as
/// given: vertices at the same position are not merged.
struct MeshReport {
  Eigen::Index num_vertices = 0;
  Eigen::Index num_faces = 0;
  Eigen::Index num_edges = 0;
  Eigen::Index num_components = 0;  ///< sets of faces joined through shared edges

  Eigen::Index num_boundary_edges = 0;         ///< edges of one face
  Eigen::Index num_non_manifold_edges = 0;     ///< edges of three or more faces
  Eigen::Index num_non_manifold_vertices = 0;  ///< vertices where separate fans of faces touch
  Eigen::Index num_duplicate_vertices = 0;     ///< vertices at exactly an earlier vertex's position
  Eigen::Index num_unreferenced_vertices = 0;  ///< vertices without faces
  Eigen::Index num_degenerate_faces = 0;       ///< a repeated corner, or collinear corners
  Eigen::Index num_duplicate_faces = 0;        ///< the same three corners as an earlier face
  Eigen::Index num_misoriented_edges = 0;      ///< edges that two faces traverse the same way

  /// Closed components that point inwards and lie in no other closed component.
  Eigen::Index num_inside_out_components = 0;
  /// Closed components that lie in another one and have the same orientation: a solid within a
  /// solid rather than a cavity, so that their surfaces do not bound the whole.
  Eigen::Index num_nested_solids = 0;

  /// None of the defects above: closed, manifold, consistently oriented, outwards. Inside and
  /// outside are then well defined, and SignedDistance uses its exact sign. (Parts that intersect
  /// each other are not detected.)
  bool watertight = false;

  Eigen::Vector3d extent_m = Eigen::Vector3d::Zero();  ///< bounding box of the faces' vertices
  double area_m2 = 0.0;
  double volume_m3 = 0.0;  ///< signed; meaningful if closed

  /// The largest extent is more than 2 m or less than 5 mm: not a handheld object in meters.
  bool implausible_size = false;
  /// For an implausible size, the factor to meters if a common unit explains it: 0.001
  /// (millimeters), 0.01 (centimeters), 1000 (meters read as millimeters) or 0.0254 (inches); the
  /// first that makes the geometric mean of the extents hand-sized, 2.2 cm ... 22 cm. Otherwise 1.
  double suggested_scale = 1.0;
};

/// Checks a mesh without changing it. Takes seconds for two million vertices, and about 100 bytes
/// per face. Throws Error for ids out of range and coordinates that are not finite.
MeshReport CheckMesh(const TriangleMesh& mesh);

/// Returns the factors to meters, the most likely first, if a common unit explains a size that is
/// not handheld: the scaled object has a geometric mean extent of 1 cm ... 30 cm. `path` is the
/// file of the mesh: .stl stores no unit and is in millimeters by convention.
std::vector<double> PossibleScales(const Eigen::Vector3d& extent_m, std::string_view path);

/// Remedy for such a size: the --object-scale options, each with the resulting size.
std::string UnitRemedy(const Eigen::Vector3d& extent_m, std::string_view path);

/// The report as plain sentences: the properties of the mesh, then each defect.
std::vector<std::string> Describe(const MeshReport& report);

struct RepairedMesh {
  TriangleMesh mesh;
  std::vector<std::string> actions;  ///< one sentence per repair; empty if none
};

/// Applies the repairs that cannot change the shape. Welds vertices at exactly the same position.
/// Drops faces with a repeated corner, duplicate faces and unreferenced vertices. Replaces faces
/// without area by splitting the neighbor at the corner that lies on its side. Orients faces
/// consistently, and closed parts outwards (with what lies inside them). Does not close holes,
/// split non-manifold elements or move a vertex: check the result. Throws Error as CheckMesh, and
/// if no face is left.
RepairedMesh RepairMesh(const TriangleMesh& mesh);

}  // namespace holdfast
