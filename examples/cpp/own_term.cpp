// SPDX-License-Identifier: MIT
// A term of your own in the fit: a mug is kept upright while a hand carries it.
//
//   own_term [OBJECT [CLIP [FOLDER]]]
//
// The term is a cost function of Ceres over a parameter block of the fit, the object's rotation.
// Prints the largest tilt without the term and with it, and writes the fit with it: FOLDER/clip.npz
// and FOLDER/object.ply.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>

#include <ceres/sized_cost_function.h>

#include "geometry/clip/clip_arrays.h"
#include "geometry/import/load_clip.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/rotation.h"
#include "solver/carry/carry.h"

using namespace holdfast;

// The object's z axis is vertical: the horizontal components (x, y) of R e_z are zero. Parameter
// block: the object's rotation, a unit quaternion (x, y, z, w).
class Upright final : public ceres::SizedCostFunction<2, 4> {
 public:
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const double x = parameters[0][0], y = parameters[0][1], z = parameters[0][2],
                 w = parameters[0][3];
    residuals[0] = 2.0 * (x * z + w * y);
    residuals[1] = 2.0 * (y * z - w * x);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 4, Eigen::RowMajor>> J(jacobians[0]);
      J << 2.0 * z, 2.0 * w, 2.0 * x, 2.0 * y,  //
          -2.0 * w, 2.0 * z, 2.0 * y, -2.0 * x;
    }
    return true;
  }
};

double LargestTilt(const Clip& clip) {
  double largest = 0.0;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    largest = std::max(largest, std::acos(clip.object->Pose(t).linear()(2, 2)));
  }
  return largest / kDegree;
}

int main(int argc, char** argv) try {
  const PreparedObject object = PrepareObject(LoadObject(argc > 1 ? argv[1] : "mug"));
  const LoadedClip motion = LoadClip(argc > 2 ? argv[2] : "demo_drink");
  CarryOptions options;
  const CarryReport plain = CarryObject(motion.clip, motion.body, object, options);

  CustomTerm upright;
  upright.name = "upright";
  upright.weight = 1e5;
  upright.blocks = {FitBlock::kObjectRotation};
  upright.make = [](const CustomTermFrame&) { return std::make_unique<Upright>(); };
  options.fit.custom_terms = {upright};
  const CarryReport kept = CarryObject(motion.clip, motion.body, object, options);

  std::printf("largest tilt without the term: %.1f degrees\n", LargestTilt(plain.clip));
  std::printf("largest tilt with the term:    %.1f degrees\n", LargestTilt(kept.clip));
  for (const std::string& warning : kept.warnings) std::printf("warning: %s\n", warning.c_str());
  if (argc > 3) {
    const std::filesystem::path folder = argv[3];
    std::filesystem::create_directories(folder);
    WriteClipFiles(kept.clip, object.object.mesh, folder);
  }
  return 0;
} catch (const Error& error) {  // where, what is wrong, what to do
  std::fprintf(stderr, "own_term: %s\n", error.what());
  return 1;
}
