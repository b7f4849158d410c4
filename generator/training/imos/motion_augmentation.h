// SPDX-License-Identifier: MIT
#pragma once

#include <torch/torch.h>

#include "generator/nn/random_stream.h"

/// Other motions of the same meaning, for networks that are to tell actions from joints: (N x T x
/// 66) meters, in and out.
namespace holdfast::imos {

/// Of people who stand otherwise and are of other size: each coordinate of a motion shifted by a
/// draw of N(0, stance_m^2), the same in all key frames, and the whole scaled by up to a tenth.
torch::Tensor InOtherStances(const torch::Tensor& motions, double stance_m,
                             nn::RandomStream& random);

/// A draw of N(0, jitter_m^2) added to each number.
torch::Tensor Jittered(const torch::Tensor& motions, double jitter_m, nn::RandomStream& random);

}  // namespace holdfast::imos
