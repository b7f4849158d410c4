// SPDX-License-Identifier: MIT
#include "solver/kernels/pair_kernel.h"

#include <gtest/gtest.h>
#include <Eigen/Core>

namespace holdfast {
namespace {

TEST(RankUpdate, AddsTheProductOnEveryInstructionSet) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  for (const Isa isa : {Isa::kScalar, Isa::kSse2, Isa::kAvx2, Isa::kAvx512}) {
    if (!IsSupported(isa)) continue;
    for (const int width : {8, 16, 24, 56}) {
      for (const int rows : {0, 1, 3, 60}) {
        std::srand(static_cast<unsigned>(width + rows));
        const RowMajor a = RowMajor::Random(rows, width);
        const RowMajor start = RowMajor::Random(width, width);
        RowMajor product = start;
        RankUpdate(isa, a.data(), rows, width, product.data());
        const RowMajor expected = start + a.transpose() * a;
        for (int i = 0; i < width; ++i) {
          for (int j = i; j < width; ++j) {
            EXPECT_NEAR(product(i, j), expected(i, j), 1e-13 * (1 + rows))
                << IsaName(isa) << " " << width << " " << rows << " " << i << " " << j;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace holdfast
