// SPDX-License-Identifier: MIT
#if defined(__AVX2__)
#include "generator/nn/kernels/layer_loops.h"

namespace holdfast::kernels {

template <>
LayerLoops<float> Avx2LayerLoops<float>() {
  return LoopsOf<VectorShape<float, 32, 2, 6, 8>>();
}
template <>
LayerLoops<double> Avx2LayerLoops<double>() {
  return LoopsOf<VectorShape<double, 32, 2, 6, 8>>();
}

}  // namespace holdfast::kernels
#endif
