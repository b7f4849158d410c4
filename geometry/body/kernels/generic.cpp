// SPDX-License-Identifier: MIT
#define HOLDFAST_LANES 2
#define HOLDFAST_MULTIPLY_ADD(a, b, c) ((a) * (b) + (c))
#include "geometry/body/kernels/skinning_loop.h"

namespace holdfast::kernels {

void PoseTileGeneric(const SkinningArguments& in, int begin, int end, long* next, float* offsets,
                     double* posed_rest, double* vertices) {
  PoseTile(in, begin, end, next, offsets, posed_rest, vertices);
}

void AdjointTileGeneric(const SkinningArguments& in, int begin, int end, long* next,
                        const double* posed_rest, const double* d_vertices, double* d_posed_rest,
                        const SkinningGradient& sums) {
  AdjointTile(in, begin, end, next, posed_rest, d_vertices, d_posed_rest, sums);
}

}  // namespace holdfast::kernels
