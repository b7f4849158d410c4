// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "generator/imos/weights.h"

namespace holdfast::imos {

/// What a checkpoint's tensors do not tell.
struct ImportWeightsOptions {
  /// The published weights have the arms as 17, 19, 21, 16, 18, 20; the published code trains them
  /// ascending.
  ArmOrder arm_order = ArmOrder::kRightThenLeft;
  ObjectRotation object_rotation = ObjectRotation::kRows;  ///< as GRAB has it
  int attention_heads = 4;
  bool keep_training = false;  ///< keeps the present encoder
};

struct ImportedWeights {
  NetworkWeights weights;
  /// Tensors of the checkpoints that no network here has: body models' buffers, counters.
  std::vector<std::string> ignored;
};

/// The published networks from two PyTorch checkpoints, the arms' and the body's: files that
/// torch.save wrote, of a state by names, alone or under `model_pose` or `state_dict`, with or
/// without a `module.` before every name. Sizes and the rest of the configuration follow from the
/// tensors' shapes. Nothing in the files is executed. Throws Error for what is no such file, for
/// missing tensors, and for shapes that fit no configuration.
ImportedWeights ImportWeights(const std::filesystem::path& arms, const std::filesystem::path& body,
                              const ImportWeightsOptions& options);

}  // namespace holdfast::imos
