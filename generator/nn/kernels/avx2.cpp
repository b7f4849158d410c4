// SPDX-License-Identifier: MIT
#if defined(__AVX2__)
#include "generator/nn/kernels/layer_loops.h"

namespace holdfast::kernels {

template <typename Real>
LayerLoops<Real> Avx2LayerLoops() {
  return LoopsOf<VectorShape<Real, 32, 2, 6, 8>>();
}
template LayerLoops<float> Avx2LayerLoops<float>();
template LayerLoops<double> Avx2LayerLoops<double>();

}  // namespace holdfast::kernels
#endif
