// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "geometry/io/mesh/mesh_io.h"
#include "geometry/io/mesh/mesh_scan.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

namespace holdfast::fuzz {

/// Triangles that a scan's polygons split into.
inline std::vector<Eigen::Vector3i> Fans(const MeshScan& scan) {
  std::vector<Eigen::Vector3i> triangles;
  for (std::size_t p = 0; p + 1 < scan.polygon_begin.size(); ++p) {
    const int begin = scan.polygon_begin[p];
    for (int i = begin + 1; i + 1 < scan.polygon_begin[p + 1]; ++i) {
      triangles.emplace_back(scan.polygon_ids[begin], scan.polygon_ids[i], scan.polygon_ids[i + 1]);
    }
  }
  return triangles;
}

/// Reads a mesh; one that is taken is whole, and comes back the same from a file of ours.
inline void ReadMeshAndBack(Trial& trial, const std::string& extension) {
  const TriangleMesh mesh = ReadMeshBytes(std::string(trial.Text()), "mesh" + extension).mesh;
  trial.Accept();
  Require(mesh.NumVertices() > 0 && mesh.NumFaces() > 0, "a mesh has vertices and faces");
  Require(mesh.vertices.allFinite(), "positions are finite");
  Require(mesh.faces.minCoeff() >= 0 && mesh.faces.maxCoeff() < mesh.NumVertices(),
          "vertex ids are in range");
  if (extension != ".stl") {
    const MeshScan scan = extension == ".obj"   ? ScanObj(trial.Text(), "mesh")
                          : extension == ".ply" ? ScanPly(trial.Text(), "mesh")
                                                : ScanOff(trial.Text(), "mesh");
    const std::vector<Eigen::Vector3i> fans = Fans(scan);
    Require(static_cast<Eigen::Index>(fans.size()) == mesh.NumFaces(), "every face is read");
    for (std::size_t f = 0; f < fans.size(); ++f) {
      Require(mesh.faces.col(static_cast<Eigen::Index>(f)) == fans[f], "faces are as in the file");
    }
  }

  // .ply takes every face, also one that repeats a corner, and holds single precision.
  const ScratchFile file(".ply");
  WriteMesh(mesh, file.Path());
  const TriangleMesh again = ReadMesh(file.Path());
  Require(again.faces == mesh.faces, "faces come back the same");
  Require(again.vertices == mesh.vertices.cast<float>().cast<double>(),
          "positions come back in single precision");
}

}  // namespace holdfast::fuzz
