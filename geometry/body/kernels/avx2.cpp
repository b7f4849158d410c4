// SPDX-License-Identifier: MIT
#if defined(__AVX2__)
#include <immintrin.h>

#define HOLDFAST_LANES 4
#define HOLDFAST_MULTIPLY_ADD(a, b, c) _mm256_fmadd_ps(_mm256_set1_ps(a), b, c)
#define HOLDFAST_POSE_TILE PoseTileAvx2
#define HOLDFAST_ADJOINT_TILE AdjointTileAvx2
#include "geometry/body/kernels/skinning_loop.h"
#endif
