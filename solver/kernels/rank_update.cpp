// SPDX-License-Identifier: MIT
#include "solver/kernels/rank_update.h"

#include <cassert>

#include "solver/kernels/rank_update_arguments.h"

namespace holdfast {

void RankUpdate(Isa isa, const double* rows, int num_rows, int width, double* product) {
  assert(IsSupported(isa) && width % 8 == 0);
  const kernels::RankUpdateArguments in{rows, num_rows, width, product};
  switch (isa) {
#if defined(HOLDFAST_X86_KERNELS)
    case Isa::kSse2:
      return kernels::RankUpdateSse2(in);
    case Isa::kAvx2:
      return kernels::RankUpdateAvx2(in);
    case Isa::kAvx512:
      return kernels::RankUpdateAvx512(in);
#endif
    default:
      return kernels::RankUpdateScalar(in);
  }
}

}  // namespace holdfast
