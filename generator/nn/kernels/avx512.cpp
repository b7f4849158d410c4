// SPDX-License-Identifier: MIT
#if defined(__AVX512F__)
#include "generator/nn/kernels/layer_loops.h"

namespace holdfast::kernels {

template <typename Real>
LayerLoops<Real> Avx512LayerLoops() {
  return LoopsOf<VectorShape<Real, 64, 4, 6, sizeof(Real) == 4 ? 4 : 8>>();
}
template LayerLoops<float> Avx512LayerLoops<float>();
template LayerLoops<double> Avx512LayerLoops<double>();

}  // namespace holdfast::kernels
#endif
