// SPDX-License-Identifier: MIT
#if defined(__AVX2__)
#include <immintrin.h>

#define HOLDFAST_LANES 4
#define HOLDFAST_MULTIPLY_ADD(a, b, c) _mm256_fmadd_ps(_mm256_set1_ps(a), b, c)
#include "geometry/body/kernels/skinning_loop.h"

namespace holdfast::kernels {

void PoseTileAvx2(const SkinningArguments& in, int begin, int end, long* next, float* offsets,
                  double* posed_rest, double* vertices) {
  PoseTile(in, begin, end, next, offsets, posed_rest, vertices);
}

void AdjointTileAvx2(const SkinningArguments& in, int begin, int end, long* next,
                     const double* posed_rest, const double* d_vertices, double* d_posed_rest,
                     const SkinningGradient& sums) {
  AdjointTile(in, begin, end, next, posed_rest, d_vertices, d_posed_rest, sums);
}

}  // namespace holdfast::kernels
#endif
