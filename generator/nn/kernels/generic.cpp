// SPDX-License-Identifier: MIT
// Vectors of 16 bytes: SSE2, NEON and similar, or plain scalars if there are none.
#include "generator/nn/kernels/layer_loops.h"

namespace holdfast::kernels {

template <typename Real>
LayerLoops<Real> GenericLayerLoops() {
  return LoopsOf<VectorShape<Real, 16, 2, 4, 8>>();
}
template LayerLoops<float> GenericLayerLoops<float>();
template LayerLoops<double> GenericLayerLoops<double>();

}  // namespace holdfast::kernels
