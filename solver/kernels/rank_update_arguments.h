// SPDX-License-Identifier: MIT
#pragma once

namespace holdfast::kernels {

/// Plain pointers, as in pair_arguments.h.
struct RankUpdateArguments {
  const double* rows;  ///< num_rows x width, row-major
  int num_rows;
  int width;        ///< a multiple of 8
  double* product;  ///< width x width, row-major; the upper triangle is added to
};

void RankUpdateScalar(const RankUpdateArguments& in);
void RankUpdateSse2(const RankUpdateArguments& in);
void RankUpdateAvx2(const RankUpdateArguments& in);
void RankUpdateAvx512(const RankUpdateArguments& in);

}  // namespace holdfast::kernels
