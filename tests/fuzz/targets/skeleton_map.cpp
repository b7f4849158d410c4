// SPDX-License-Identifier: MIT
#include "geometry/retarget/skeleton_map.h"

#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

namespace {

// SMPL-X's own joints under one root more, all at their names, and two joints of the same name.
holdfast::SourceMotion SomeMotion() {
  holdfast::SourceMotion motion;
  motion.joint_names = {"root"};
  motion.parents = {-1};
  for (int j = 0; j < holdfast::kNumJoints; ++j) {
    motion.joint_names.emplace_back(holdfast::kJointNames[j]);
    motion.parents.push_back(holdfast::kJointParents[j] + 1);
  }
  motion.joint_names.insert(motion.joint_names.end(), {"prop", "prop"});
  motion.parents.insert(motion.parents.end(), {0, 0});
  return motion;
}

}  // namespace

HOLDFAST_FUZZ_TARGET(skeleton_map) {
  static const holdfast::SourceMotion motion = SomeMotion();
  const holdfast::fuzz::MemoryFile file(trial.Bytes());
  const holdfast::SkeletonMap map = holdfast::ReadSkeletonMap(file.Path(), motion);
  trial.Accept();
  for (const int source : map.source) {
    holdfast::fuzz::Require(source >= -1 && source < motion.NumJoints(),
                            "a map names joints of the motion");
  }
  holdfast::fuzz::Require(map.source[0] >= 0, "a map has a pelvis");
  holdfast::fuzz::Require(
      map.NumMapped() + static_cast<int>(map.UnusedSourceJoints(motion).size()) <=
          motion.NumJoints() + holdfast::kNumJoints,
      "joints are used or unused");
}
