// SPDX-License-Identifier: MIT
#include "solver/kernels/pair_kernel.h"

#include <gtest/gtest.h>

namespace holdfast {
namespace {

struct Scene {
  Eigen::Matrix3Xd targets, points;
  Eigen::MatrixXd reference;  // M x N
};

Scene RandomScene(int num_targets, int num_points) {
  std::srand(static_cast<unsigned>(num_targets));
  Scene scene{0.1 * Eigen::Matrix3Xd::Random(3, num_targets),
              0.1 * Eigen::Matrix3Xd::Random(3, num_points),
              0.05 * Eigen::MatrixXd::Random(num_targets, num_points).cwiseAbs()};
  if (num_targets > 2 && num_points > 2) scene.points.col(1) = scene.targets.col(2);  // coincide
  return scene;
}

template <typename Real>
std::vector<PairSums> Run(Isa isa, const Scene& scene) {
  const PairTargets<Real> targets(scene.targets);
  const Eigen::Matrix<Real, 3, Eigen::Dynamic> points = scene.points.cast<Real>();
  // Padding is poisoned: a kernel that lets it through shows NaN.
  std::vector<Real> reference(static_cast<std::size_t>(points.cols()) * targets.Stride(), Real(7));
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    for (Eigen::Index j = 0; j < scene.targets.cols(); ++j) {
      reference[i * targets.Stride() + j] = static_cast<Real>(scene.reference(j, i));
    }
  }
  std::vector<PairSums> sums(static_cast<std::size_t>(points.cols()),
                             PairSums{{NAN, NAN, NAN, NAN, NAN, NAN}, {NAN, NAN, NAN}, NAN});
  SumPairs<Real>(isa, targets, points.data(), static_cast<int>(points.cols()), reference.data(),
                 sums.data());
  return sums;
}

PairSums Literal(const Scene& scene, int i) {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  double squares = 0.0;
  for (Eigen::Index j = 0; j < scene.targets.cols(); ++j) {
    const Eigen::Vector3d d = scene.points.col(i) - scene.targets.col(j);
    const Eigen::Vector3d n = d.norm() > 0.0 ? Eigen::Vector3d(d.normalized()) : d;
    const double r = d.norm() - scene.reference(j, i);
    H += n * n.transpose();
    g += r * n;
    squares += r * r;
  }
  return {{H(0, 0), H(0, 1), H(0, 2), H(1, 1), H(1, 2), H(2, 2)}, {g(0), g(1), g(2)}, squares};
}

template <typename Real>
void CheckAgainstLiteral(double tolerance) {
  for (const Isa isa : {Isa::kScalar, Isa::kSse2, Isa::kAvx2, Isa::kAvx512}) {
    if (!IsSupported(isa)) continue;
    // Every remainder of the vector width, and less than one vector.
    for (const int num_targets : {1, 2, 3, 7, 15, 16, 17, 31, 33, 300}) {
      const Scene scene = RandomScene(num_targets, 23);
      const std::vector<PairSums> sums = Run<Real>(isa, scene);
      for (int i = 0; i < 23; ++i) {
        const PairSums expected = Literal(scene, i);
        for (int k = 0; k < 6; ++k) {
          EXPECT_NEAR(sums[i].hessian[k], expected.hessian[k], tolerance * num_targets)
              << IsaName(isa) << " " << num_targets << " " << i;
        }
        for (int k = 0; k < 3; ++k) {
          EXPECT_NEAR(sums[i].gradient[k], expected.gradient[k], 0.1 * tolerance * num_targets)
              << IsaName(isa) << " " << num_targets << " " << i;
        }
        EXPECT_NEAR(sums[i].squares, expected.squares, 0.01 * tolerance * num_targets)
            << IsaName(isa) << " " << num_targets << " " << i;
      }
    }
  }
}

TEST(PairKernel, DoubleIsExactOnEveryInstructionSet) { CheckAgainstLiteral<double>(1e-14); }

TEST(PairKernel, SingleIsSinglePreciseOnEveryInstructionSet) { CheckAgainstLiteral<float>(2e-6); }

TEST(PairKernel, PicksTheWidestSetThatThisMachineHas) {
  EXPECT_TRUE(IsSupported(BestIsa()));
  for (const Isa isa : {Isa::kScalar, Isa::kSse2, Isa::kAvx2, Isa::kAvx512}) {
    if (static_cast<int>(isa) > static_cast<int>(BestIsa())) {
      EXPECT_FALSE(IsSupported(isa));
    }
  }
}

}  // namespace
}  // namespace holdfast
