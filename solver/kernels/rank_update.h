// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/isa.h"

namespace holdfast {

/// product += A^T A for A (num_rows x width, row-major), in its upper triangle (what lies below is
/// undefined). `width` is a multiple of 8: pad with columns of zeros. Sums run over rows in order,
/// so that the result depends on the instruction set only through fused rounding.
void RankUpdate(Isa isa, const double* rows, int num_rows, int width, double* product);

}  // namespace holdfast
