// SPDX-License-Identifier: MIT
#include "solver/terms/hand_object_distance.h"

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
std::vector<PairSums> HandObjectDistance::Sums(const Pairs<Real>& pairs,
                                               const Eigen::Matrix3Xd& z) const {
  assert(pairs.reference.size() == static_cast<std::size_t>(z.cols()) * pairs.targets.Stride());
  const Eigen::Matrix<Real, 3, Eigen::Dynamic> points = z.template cast<Real>();
  std::vector<PairSums> sums(static_cast<std::size_t>(z.cols()));
  SumPairs<Real>(isa_, pairs.targets, points.data(), static_cast<int>(z.cols()),
                 pairs.reference.data(), sums.data());
  return sums;
}

double HandObjectDistance::Add(const Eigen::Matrix3Xd& z,
                               std::span<VertexQuadratic> quadratics) const {
  const std::vector<PairSums> sums =
      std::visit([&](const auto& pairs) { return Sums(pairs, z); }, pairs_);
  double energy = 0.0;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const PairSums& s = sums[i];
    Eigen::Matrix3d hessian;
    hessian << s.hessian[0], s.hessian[1], s.hessian[2],  //
        s.hessian[1], s.hessian[3], s.hessian[4],         //
        s.hessian[2], s.hessian[4], s.hessian[5];
    quadratics[i].hessian += weight_ * hessian;
    quadratics[i].gradient += weight_ * Eigen::Map<const Eigen::Vector3d>(s.gradient);
    quadratics[i].cost += 0.5 * weight_ * s.squares;
    energy += s.squares;
  }
  return energy;
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
