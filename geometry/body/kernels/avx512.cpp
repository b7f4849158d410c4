// SPDX-License-Identifier: MIT
#if defined(__AVX512F__)
#include <immintrin.h>

#define HOLDFAST_LANES 8
#define HOLDFAST_MULTIPLY_ADD(a, b, c) _mm512_fmadd_ps(_mm512_set1_ps(a), b, c)
#define HOLDFAST_POSE_TILE PoseTileAvx512
#define HOLDFAST_ADJOINT_TILE AdjointTileAvx512
#include "geometry/body/kernels/skinning_loop.h"
#endif
