// SPDX-License-Identifier: MIT
#include "geometry/io/motion/bvh.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/motion_checks.h"

HOLDFAST_FUZZ_TARGET(bvh) {
  const holdfast::SourceMotion motion = holdfast::ParseBvh(trial.Text(), "motion.bvh", 0.01);
  trial.Accept();
  holdfast::fuzz::RequireSound(motion);
}
