// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/mesh/mesh.h"
#include "geometry/mesh/surface_distance.h"

namespace holdfast {

/// Which edge is collapsed next, and where to. The first keeps shape best: 14 scanned household
/// objects of 8,000 vertices taken to 300 are off by 0.11 mm in the mean (0.20 and 0.24 mm by the
/// others), and by 0.05 % of their volume (1.5 and 1.6 %); the largest distances are alike
/// (2.0, 1.8, 2.0 mm). tests/bench/decimation_methods.cpp prints the table.
enum class DecimateMethod {
  kLindstromTurk,                 ///< volume, boundary and shape (Lindstrom & Turk 1998)
  kGarlandHeckbert,               ///< quadrics of the faces' planes (Garland & Heckbert 1997)
  kGarlandHeckbertProbabilistic,  ///< quadrics of uncertain planes (Trettner & Kobbelt 2020)
};

inline constexpr DecimateMethod kDecimateMethods[] = {
    DecimateMethod::kLindstromTurk, DecimateMethod::kGarlandHeckbert,
    DecimateMethod::kGarlandHeckbertProbabilistic};

/// "lindstrom-turk", "garland-heckbert", "garland-heckbert-probabilistic".
std::string_view Name(DecimateMethod method);
/// Throws Error that lists the names.
DecimateMethod ParseDecimateMethod(std::string_view name);

struct DecimateOptions {
  int vertices = 300;  ///< as many as the result has, >= 4
  DecimateMethod method = DecimateMethod::kLindstromTurk;
  /// A surface without boundary that cannot be decimated as it is (edges of more than two faces, or
  /// more handles than so few vertices can show) may be wrapped first (geometry/mesh/wrap.h).
  bool allow_wrap = true;
  int samples = 100'000;  ///< points per surface for the distances; 0: do not measure
};

struct DecimateResult {
  TriangleMesh mesh;
  std::optional<SurfaceDistance> distance;  ///< from the input to `mesh`, and back
  std::vector<std::string> notes;           ///< what was repaired, or why nothing was done
};

/// Collapses edges until exactly `options.vertices` are left. The mesh is repaired first
/// (geometry/mesh/mesh_check.h), and vertices where parts of the surface touch are parted, of a
/// surface with boundary also sheets that meet in an edge (PartSheets; specks that come off, less
/// than 1 % of the area, are left out where they would take many vertices). The result is manifold
/// and oriented as the input; components, handles and holes stay what they are unless the mesh had
/// to be wrapped; boundaries keep their place as well as the vertices allow. Whatever was done is
/// noted. Independent of the unit. Deterministic. A mesh with no more vertices than asked for comes
/// back repaired only, with a note.
///
/// Throws Error for surfaces with a boundary that need more vertices, and in place of wrapping when
/// that is not allowed.
DecimateResult Decimate(const TriangleMesh& mesh, const DecimateOptions& options = {});

}  // namespace holdfast
