// SPDX-License-Identifier: MIT
#include "geometry/io/gltf/gltf_reader.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/motion_checks.h"

HOLDFAST_FUZZ_TARGET(gltf) {
  const holdfast::SourceMotion motion =
      holdfast::ParseGltfMotion(std::string(trial.Text()), "motion.glb", "/nonexistent");
  trial.Accept();
  holdfast::fuzz::RequireSound(motion);
}
