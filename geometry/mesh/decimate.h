// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/mesh/mesh.h"
#include "geometry/mesh/surface_distance.h"

namespace holdfast {

/// Edge-collapse cost and placement. kLindstromTurk preserves shape best: for 14 scanned household
/// objects decimated from 8,000 to 300 vertices, its mean distance is 0.11 mm (the others: 0.20 and
/// 0.24 mm) and its volume error 0.05 % (1.5 and 1.6 %). The maximum distances are similar (2.0,
/// 1.8, 2.0 mm). tests/bench/decimation_methods.cpp prints the table.
enum class DecimateMethod {
  kLindstromTurk,                 ///< volume, boundary and shape (Lindstrom & Turk 1998)
  kGarlandHeckbert,               ///< quadrics of the faces' planes (Garland & Heckbert 1997)
  kGarlandHeckbertProbabilistic,  ///< quadrics of uncertain planes (Trettner & Kobbelt 2020)
};

inline constexpr DecimateMethod kDecimateMethods[] = {
    DecimateMethod::kLindstromTurk, DecimateMethod::kGarlandHeckbert,
    DecimateMethod::kGarlandHeckbertProbabilistic};

/// Returns "lindstrom-turk", "garland-heckbert" or "garland-heckbert-probabilistic".
std::string_view Name(DecimateMethod method);
/// Parses a method name. Throws Error, listing the names, if the name is unknown.
DecimateMethod ParseDecimateMethod(std::string_view name);

struct DecimateOptions {
  int vertices = 300;  ///< exact number of vertices of the result, >= 4
  DecimateMethod method = DecimateMethod::kLindstromTurk;
  /// Whether a surface without boundary that cannot be decimated directly (edges of more than two
  /// faces, or too many handles for the vertex count) may be wrapped first (geometry/mesh/wrap.h).
  bool allow_wrap = true;
  int samples = 100'000;  ///< points per surface for the distances; 0: do not measure
};

struct DecimateResult {
  TriangleMesh mesh;
  DecimateMethod method = DecimateMethod::kLindstromTurk;  ///< used; see HasDecimateMethods
  std::optional<SurfaceDistance> distance;  ///< between the input and `mesh`, both directions
  std::vector<std::string> notes;           ///< what was repaired, or why nothing was done
};

/// Collapses edges until exactly `options.vertices` are left. The mesh is repaired first
/// (geometry/mesh/mesh_check.h). Vertices where parts of the surface touch are split; for a surface
/// with boundary, sheets that meet in an edge are also split (PartSheets), and small fragments,
/// less than 1 % of the area, are dropped if they would need many vertices. The result is manifold
/// and oriented like the input. Components, handles and holes are preserved unless the mesh was
/// wrapped; boundaries are preserved as well as the vertex count allows. All changes are reported
/// in `notes`. Independent of the unit. Deterministic. A mesh with no more vertices than requested
/// is only repaired, with a note.
///
/// Throws Error for surfaces with a boundary that need more vertices, and where wrapping would be
/// needed but is not allowed.
DecimateResult Decimate(const TriangleMesh& mesh, const DecimateOptions& options = {});

}  // namespace holdfast
