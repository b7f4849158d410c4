// SPDX-License-Identifier: MIT
#include "geometry/body/smplx_hand_vertices.h"

#include <algorithm>
#include <span>

namespace holdfast {

// A range of ids without the vertices that MANO does not have.
std::vector<int> SmplxHandVertices(Side side) {
  static constexpr int kRightMissing[] = {7452, 7453, 7454, 7455, 7457, 7458, 7460,
                                          7461, 7462, 7497, 7498, 7557, 7559, 7580,
                                          7584, 7591, 7592, 7593, 7594, 7636};
  static constexpr int kLeftMissing[] = {4716, 4717, 4718, 4719, 4721, 4722, 4724, 4725,
                                         4726, 4761, 4762, 4821, 4823, 4844, 4848, 4855,
                                         4856, 4857, 4858, 4900, 5349, 5350};
  const bool right = side == Side::kRight;
  const std::span<const int> missing =
      right ? std::span<const int>(kRightMissing) : std::span<const int>(kLeftMissing);
  std::vector<int> ids;
  for (int v = right ? 7331 : 4595; v <= (right ? 8128 : 5394); ++v) {
    if (std::find(missing.begin(), missing.end(), v) == missing.end()) ids.push_back(v);
  }
  return ids;
}

}  // namespace holdfast
