// SPDX-License-Identifier: MIT
// Compares the decimation methods on a folder of meshes:
//   decimation_methods meshes/objects [VERTICES]
// Distances in millimeters between each mesh and its decimation, by 200,000 points on each surface.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/decimate.h"
#include "geometry/mesh/mesh_check.h"

namespace fs = std::filesystem;
using namespace holdfast;

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: decimation_methods FOLDER [VERTICES]\n");
    return 2;
  }
  try {
    std::vector<fs::path> paths;
    for (const auto& entry : fs::directory_iterator(argv[1])) {
      const std::string extension = entry.path().extension().string();
      if (extension == ".obj" || extension == ".ply") paths.push_back(entry.path());
    }
    std::sort(paths.begin(), paths.end());
    const int vertices = argc > 2 ? std::stoi(argv[2]) : 300;
    fmt::print(
        "| mesh | method | Hausdorff to / from | mean to / from | volume | s | watertight |\n");
    fmt::print("|---|---|---|---|---|---|---|\n");
    struct Sum {
      double hausdorff = 0.0, mean = 0.0, volume = 0.0;
      int best = 0;
    };
    std::vector<Sum> sums(std::size(kDecimateMethods));
    int num_meshes = 0;
    for (const fs::path& path : paths) {
      const TriangleMesh mesh = ReadMesh(path);
      if (mesh.NumVertices() <= vertices) continue;
      ++num_meshes;
      std::size_t best = 0;
      double best_mean = 1e300;
      for (std::size_t m = 0; m < sums.size(); ++m) {
        DecimateOptions options;
        options.vertices = vertices;
        options.method = kDecimateMethods[m];
        options.samples = 0;
        const auto start = std::chrono::steady_clock::now();
        const DecimateResult result = Decimate(mesh, options);
        const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
        const SurfaceDistance d = MeasureSurfaceDistance(mesh, result.mesh, 200'000);
        const double volume = SignedVolume(result.mesh) / SignedVolume(mesh) - 1.0;
        const MeshReport report = CheckMesh(result.mesh);
        fmt::print("| {} | {} | {:.2f} / {:.2f} | {:.3f} / {:.3f} | {:+.2f} % | {:.2f} | {} |\n",
                   path.stem().string(), Name(options.method), 1e3 * d.hausdorff_forward_m,
                   1e3 * d.hausdorff_backward_m, 1e3 * d.mean_forward_m, 1e3 * d.mean_backward_m,
                   1e2 * volume, seconds.count(), report.watertight ? "yes" : "no");
        const double mean = 0.5 * (d.mean_forward_m + d.mean_backward_m);
        sums[m].hausdorff += std::max(d.hausdorff_forward_m, d.hausdorff_backward_m);
        sums[m].mean += mean;
        sums[m].volume += std::abs(volume);
        if (mean < best_mean) {
          best_mean = mean;
          best = m;
        }
      }
      ++sums[best].best;
    }
    fmt::print("\nOver {} meshes, {} vertices:\n\n", num_meshes, vertices);
    fmt::print(
        "| method | two-sided Hausdorff, mm | mean distance, mm | volume error | best mean |\n");
    fmt::print("|---|---|---|---|---|\n");
    for (std::size_t m = 0; m < sums.size(); ++m) {
      fmt::print("| {} | {:.2f} | {:.3f} | {:.2f} % | {} |\n", Name(kDecimateMethods[m]),
                 1e3 * sums[m].hausdorff / num_meshes, 1e3 * sums[m].mean / num_meshes,
                 1e2 * sums[m].volume / num_meshes, sums[m].best);
    }
  } catch (const Error& error) {
    fmt::print(stderr, "decimation_methods: {}\n", error.what());
    return 1;
  }
  return 0;
}
