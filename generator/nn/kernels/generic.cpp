// SPDX-License-Identifier: MIT
// Vectors of 16 bytes: SSE2, NEON and similar, or plain scalars if there are none.
#include "generator/nn/kernels/layer_loops.h"

namespace holdfast::kernels {

template <>
LayerLoops<float> GenericLayerLoops<float>() {
  return LoopsOf<VectorShape<float, 16, 2, 4, 8>>();
}
template <>
LayerLoops<double> GenericLayerLoops<double>() {
  return LoopsOf<VectorShape<double, 16, 2, 4, 8>>();
}

}  // namespace holdfast::kernels
