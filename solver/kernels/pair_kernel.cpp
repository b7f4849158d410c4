// SPDX-License-Identifier: MIT
#include "solver/kernels/pair_kernel.h"

#include <cassert>

#include "solver/kernels/pair_arguments.h"

namespace holdfast {

static_assert(sizeof(PairSums) == 10 * sizeof(double));

template <typename Real>
PairTargets<Real>::PairTargets(const Eigen::Matrix3Xd& points)
    : count_(static_cast<int>(points.cols())),
      stride_((count_ + kPad - 1) / kPad * kPad),
      coordinates_(3 * static_cast<std::size_t>(stride_), Real(0)) {
  for (int c = 0; c < 3; ++c) {
    for (int j = 0; j < count_; ++j) {
      coordinates_[static_cast<std::size_t>(c) * stride_ + j] = static_cast<Real>(points(c, j));
    }
  }
}

template <typename Real>
void SumPairs(Isa isa, const PairTargets<Real>& targets, const Real* points, int num_points,
              const Real* reference, PairSums* sums) {
  assert(IsSupported(isa));
  const kernels::PairArguments<Real> in{
      targets.X(),     targets.Y(),      targets.Z(),
      targets.Count(), targets.Stride(), points,
      num_points,      reference,        reinterpret_cast<double*>(sums)};
  switch (isa) {
#if defined(HOLDFAST_X86_KERNELS)
    case Isa::kSse2:
      return kernels::PairLoopSse2(in);
    case Isa::kAvx2:
      return kernels::PairLoopAvx2(in);
    case Isa::kAvx512:
      return kernels::PairLoopAvx512(in);
#endif
    default:
      return kernels::PairLoopScalar(in);
  }
}

template class PairTargets<float>;
template class PairTargets<double>;
template void SumPairs<float>(Isa, const PairTargets<float>&, const float*, int, const float*,
                              PairSums*);
template void SumPairs<double>(Isa, const PairTargets<double>&, const double*, int, const double*,
                               PairSums*);

void RankUpdate(Isa isa, const double* rows, int num_rows, int width, double* product) {
  assert(IsSupported(isa) && width % 8 == 0);
  switch (isa) {
#if defined(HOLDFAST_X86_KERNELS)
    case Isa::kSse2:
      return kernels::RankUpdateSse2(rows, num_rows, width, product);
    case Isa::kAvx2:
      return kernels::RankUpdateAvx2(rows, num_rows, width, product);
    case Isa::kAvx512:
      return kernels::RankUpdateAvx512(rows, num_rows, width, product);
#endif
    default:
      return kernels::RankUpdateScalar(rows, num_rows, width, product);
  }
}

}  // namespace holdfast
