// SPDX-License-Identifier: MIT
#define HOLDFAST_LANES 2
#define HOLDFAST_MULTIPLY_ADD(a, b, c) ((a) * (b) + (c))
#define HOLDFAST_POSE_TILE PoseTileGeneric
#define HOLDFAST_ADJOINT_TILE AdjointTileGeneric
#include "geometry/body/kernels/skinning_loop.h"
