// SPDX-License-Identifier: MIT
#include "geometry/body/hand_parts.h"

#include <algorithm>

namespace holdfast {

std::vector<int> StrongestHandJoints(const BodySurface& surface, Side side) {
  std::vector<int> strongest(static_cast<std::size_t>(surface.NumVertices()), -1);
  const std::vector<int>& hand = surface.Model().HandVertexIds(side);
  for (int v = 0; v < surface.NumVertices(); ++v) {
    if (!std::ranges::binary_search(hand, surface.VertexIds()[static_cast<std::size_t>(v)])) {
      continue;
    }
    int joint = WristJoint(side);
    double most = 0.0;
    for (const auto& [j, weight] : surface.Weights(v)) {
      const bool is_finger = j >= HandBegin(side) && j < HandBegin(side) + kJointsPerHand;
      if ((is_finger || j == WristJoint(side)) && weight > most) {
        joint = j;
        most = weight;
      }
    }
    strongest[static_cast<std::size_t>(v)] = joint;
  }
  return strongest;
}

}  // namespace holdfast
