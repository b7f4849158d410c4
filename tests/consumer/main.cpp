// SPDX-License-Identifier: MIT
// The program's first job from outside the tree: an object into a person's hand, in every frame.
#include <cstdio>

#include "geometry/import/load_clip.h"
#include "solver/carry/carry.h"

int main() {
  const holdfast::LoadedClip motion = holdfast::LoadClip("demo_drink");
  const holdfast::PreparedObject mug = holdfast::PrepareObject(holdfast::LoadObject("mug"));
  const holdfast::CarryReport carried = holdfast::CarryObject(motion.clip, motion.body, mug);
  holdfast::WriteClip(carried.clip, "held.npz");
  std::printf("deepest %.2f mm\n", carried.contact.penetration_max_mm);
  return carried.status == holdfast::CarryStatus::kCarried ? 0 : 1;
}
