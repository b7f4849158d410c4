// SPDX-License-Identifier: MIT
#pragma once

/// The two inner loops of the fit, compiled once per instruction set and chosen at run time (Isa):
/// points, distances and rows of Jacobians go in; sums of squares, gradients, Hessians come out.
///
/// From the inside out:
///   pair_arguments.h         plain pointers of the pair loop
///   rank_update_arguments.h  plain pointers of the rank update
///   sum_halves.h             horizontal sum of an AVX register
///   pair_loop.h              residuals |z - o_j| - D_j summed, over lanes
///   rank_update_loop.h       H += A^T A in register tiles, over lanes
///   pair_kernel.h            SumPairs: the pair loop by instruction set
///   rank_update.h            RankUpdate: the same for A^T A
#include "solver/kernels/pair_kernel.h"
#include "solver/kernels/rank_update.h"
