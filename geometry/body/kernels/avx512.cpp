// SPDX-License-Identifier: MIT
#if defined(__AVX512F__)
#include <immintrin.h>

#define HOLDFAST_LANES 8
#define HOLDFAST_MULTIPLY_ADD(a, b, c) _mm512_fmadd_ps(_mm512_set1_ps(a), b, c)
#include "geometry/body/kernels/skinning_loop.h"

namespace holdfast::kernels {

void PoseTileAvx512(const SkinningArguments& in, int begin, int end, long* next, float* offsets,
                    double* posed_rest, double* vertices) {
  PoseTile(in, begin, end, next, offsets, posed_rest, vertices);
}

void AdjointTileAvx512(const SkinningArguments& in, int begin, int end, long* next,
                       const double* posed_rest, const double* d_vertices, double* d_posed_rest,
                       const SkinningGradient& sums) {
  AdjointTile(in, begin, end, next, posed_rest, d_vertices, d_posed_rest, sums);
}

}  // namespace holdfast::kernels
#endif
