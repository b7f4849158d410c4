// SPDX-License-Identifier: MIT
// Makes the embedded objects: make_objects OUT_DIR [NAME...]

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/decimate.h"
#include "geometry/mesh/mesh_check.h"
#include "geometry/mesh/surface_distance.h"
#include "meshes/make/objects/mesh_faults.h"
#include "meshes/make/objects/object_shapes.h"

namespace {

using namespace holdfast;

/// A faulty mesh is never written.
void RequireSound(const TriangleMesh& mesh, const std::string& name) {
  const MeshReport report = CheckMesh(mesh);
  if (!report.watertight || report.num_components != 1) {
    std::string faults;
    for (const std::string& line : Describe(report)) faults += line + " ";
    throw Error(name, "the mesh is not one watertight surface: " + faults, "Adjust its shape.");
  }
  if (const auto places = FindSelfIntersections(mesh); !places.empty()) {
    std::string list;
    for (const Eigen::Vector3d& place : places) {
      char text[64];
      std::snprintf(text, sizeof(text), " (%.1f, %.1f, %.1f)", 1e3 * place.x(), 1e3 * place.y(),
                    1e3 * place.z());
      list += text;
    }
    throw Error(name, "the mesh cuts itself at (mm)" + list,
                "Adjust its shape or the mesher's options.");
  }
}

/// The 300-vertex version. Edge collapse can make close walls cut each other: then another cost, or
/// an intermediate step, usually does not.
DecimateResult DecimateSoundly(const TriangleMesh& mesh, const std::string& name) {
  for (const int first_to : {0, 3000, 1500, 800}) {
    for (const DecimateMethod method : kDecimateMethods) {
      DecimateOptions options;
      options.method = method;
      TriangleMesh start = mesh;
      if (first_to > 0 && first_to < mesh.NumVertices()) {
        DecimateOptions step = options;
        step.vertices = first_to;
        step.method = DecimateMethod::kLindstromTurk;
        step.samples = 0;
        start = Decimate(mesh, step).mesh;
      }
      DecimateResult result = Decimate(start, options);
      result.mesh.vertices = result.mesh.vertices.cast<float>().cast<double>().eval();
      if (!FindSelfIntersections(result.mesh).empty()) continue;
      RequireSound(result.mesh, name + "_300");
      result.distance = MeasureSurfaceDistance(mesh, result.mesh);
      return result;
    }
  }
  throw Error(name, "no way of decimating it keeps it from cutting itself", "Adjust its shape.");
}

void Make(const HandheldObject& shape, const std::filesystem::path& folder) {
  const TriangleMesh mesh = PlaceOnTable(shape.make());
  RequireSound(mesh, shape.name);
  WriteMesh(mesh, folder / (shape.name + ".ply"));
  const Eigen::Vector3d size = 1e3 * Extent(mesh);
  std::printf("%-11s %5ld vertices  %5.1f x %5.1f x %5.1f mm  %7.1f cm3", shape.name.c_str(),
              static_cast<long>(mesh.NumVertices()), size.x(), size.y(), size.z(),
              1e6 * SignedVolume(mesh));
  std::fflush(stdout);

  const DecimateResult coarse = DecimateSoundly(mesh, shape.name);
  WriteMesh(coarse.mesh, folder / (shape.name + "_300.ply"));
  std::printf(
      "   300 vertices within %.2f mm\n",
      1e3 * std::max(coarse.distance->hausdorff_forward_m, coarse.distance->hausdorff_backward_m));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: make_objects OUT_DIR [NAME...]\n");
    return 2;
  }
  const std::vector<std::string> wanted(argv + 2, argv + argc);
  int failures = 0;
  for (const HandheldObject& shape : HandheldObjects()) {
    if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), shape.name) == wanted.end()) {
      continue;
    }
    try {
      Make(shape, argv[1]);
    } catch (const Error& error) {
      std::fprintf(stderr, "\n%s: %s\n", shape.name.c_str(), error.what());
      ++failures;
    }
  }
  return failures == 0 ? 0 : 1;
}
