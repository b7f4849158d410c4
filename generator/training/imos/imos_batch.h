// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <torch/torch.h>

#include "generator/imos/action_sequence.h"

namespace holdfast::imos {

/// Sequences as tensors, B rows of T = 15 key frames, single precision.
struct SequenceTensors {
  torch::Tensor pose;       ///< (B x T x 132) joints 0..21
  torch::Tensor transl;     ///< (B x T x 3)
  torch::Tensor joints;     ///< (B x T x 22 x 3)
  torch::Tensor object_T;   ///< (B x T x 3)
  torch::Tensor object_R;   ///< (B x T x 3 x 3)
  torch::Tensor by_left;    ///< (B x T) 1 where the left wrist carries the object here
  torch::Tensor by_right;   ///< (B x T)
  torch::Tensor bones;      ///< (B x 22 x 3)
  torch::Tensor betas;      ///< (B x 10)
  torch::Tensor action;     ///< (B) ids
  torch::Tensor object_id;  ///< (B x 54) one-hot

  long Count() const { return pose.defined() ? static_cast<long>(pose.size(0)) : 0; }
  SequenceTensors Rows(std::span<const std::int64_t> rows) const;
};

/// Throws Error for sequences that have not 15 key frames.
SequenceTensors TensorsOf(std::span<const ActionSequence> sequences);

}  // namespace holdfast::imos
