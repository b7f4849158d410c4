// SPDX-License-Identifier: MIT
#include "solver/terms/hand/paper_terms.h"

#include <algorithm>
#include <array>
#include <cassert>

namespace holdfast {

template <typename Real>
HandObjectDistance::Pairs<Real>::Pairs(const Eigen::Matrix3Xd& object,
                                       const Eigen::MatrixXd& distances)
    : targets(object),
      reference(static_cast<std::size_t>(distances.cols()) * targets.Stride(), Real(0)) {
  for (Eigen::Index i = 0; i < distances.cols(); ++i) {
    for (Eigen::Index j = 0; j < distances.rows(); ++j) {
      reference[static_cast<std::size_t>(i * targets.Stride() + j)] =
          static_cast<Real>(distances(j, i));
    }
  }
}

HandObjectDistance::HandObjectDistance(const Eigen::Matrix3Xd& object,
                                       const Eigen::MatrixXd& reference, double weight,
                                       PairPrecision precision, Isa isa)
    : weight_(weight),
      isa_(isa),
      pairs_(precision == PairPrecision::kSingle
                 ? decltype(pairs_)(std::in_place_type<Pairs<float>>, object, reference)
                 : decltype(pairs_)(std::in_place_type<Pairs<double>>, object, reference)) {
  assert(object.cols() == reference.rows());
}

template <typename Real>
double HandObjectDistance::AddPairs(const Pairs<Real>& pairs, const Eigen::Matrix3Xd& z,
                                    std::span<VertexQuadratic> quadratics) const {
  assert(pairs.reference.size() == static_cast<std::size_t>(z.cols()) * pairs.targets.Stride());
  constexpr Eigen::Index kAtOnce = 64;  // their sums stay in the L1 cache
  std::array<PairSums, kAtOnce> sums;
  Eigen::Matrix<Real, 3, kAtOnce> points;
  double energy = 0.0;
  for (Eigen::Index begin = 0; begin < z.cols(); begin += kAtOnce) {
    const Eigen::Index count = std::min(kAtOnce, z.cols() - begin);
    points.leftCols(count) = z.middleCols(begin, count).template cast<Real>();
    SumPairs<Real>(isa_, pairs.targets, points.data(), static_cast<int>(count),
                   pairs.reference.data() + begin * pairs.targets.Stride(), sums.data());
    for (Eigen::Index k = 0; k < count; ++k) {
      const PairSums& s = sums[static_cast<std::size_t>(k)];
      VertexQuadratic& quadratic = quadratics[static_cast<std::size_t>(begin + k)];
      Eigen::Matrix3d hessian;
      hessian << s.hessian[0], s.hessian[1], s.hessian[2],  //
          s.hessian[1], s.hessian[3], s.hessian[4],         //
          s.hessian[2], s.hessian[4], s.hessian[5];
      quadratic.hessian += weight_ * hessian;
      quadratic.gradient += weight_ * Eigen::Map<const Eigen::Vector3d>(s.gradient);
      quadratic.cost += 0.5 * weight_ * s.squares;
      energy += s.squares;
    }
  }
  return energy;
}

double HandObjectDistance::Add(const Eigen::Matrix3Xd& z,
                               std::span<VertexQuadratic> quadratics) const {
  return std::visit([&](const auto& pairs) { return AddPairs(pairs, z, quadratics); }, pairs_);
}

Eigen::MatrixXd HandObjectDistance::Distances(const Eigen::Matrix3Xd& z,
                                              const Eigen::Matrix3Xd& object) {
  Eigen::MatrixXd distances(object.cols(), z.cols());
  for (Eigen::Index i = 0; i < z.cols(); ++i) {
    distances.col(i) = (object.colwise() - z.col(i)).colwise().norm().transpose();
  }
  return distances;
}

}  // namespace holdfast
