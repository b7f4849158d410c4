// SPDX-License-Identifier: MIT
#if defined(__AVX512F__)
#include "generator/nn/kernels/layer_loops.h"

namespace holdfast::kernels {

template <>
LayerLoops<float> Avx512LayerLoops<float>() {
  return LoopsOf<VectorShape<float, 64, 4, 6, 4>>();
}
template <>
LayerLoops<double> Avx512LayerLoops<double>() {
  return LoopsOf<VectorShape<double, 64, 4, 6, 8>>();
}

}  // namespace holdfast::kernels
#endif
