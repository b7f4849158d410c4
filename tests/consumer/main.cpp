// SPDX-License-Identifier: MIT
// A program outside the tree: the installed headers and libraries are all it has.
#include <cstdio>

#include "geometry/body/body_model.h"
#include "geometry/body/hand_model.h"
#include "solver/fit/fit.h"

int main() {
  const auto body = holdfast::BodyModel::Default();
  const holdfast::HandModel hand(body, {}, holdfast::Side::kRight);
  std::printf("%d vertices, %d of the right hand\n", body->NumVertices(), hand.NumVertices());
  return hand.NumVertices() > 0 ? 0 : 1;
}
