// SPDX-License-Identifier: MIT
#pragma once

#include <torch/torch.h>

/// Poses of a batch in LibTorch, with gradients: what body_kinematics.h and rotation_6d.h do for
/// one. B rows; meters; columns are turned, x_world = R x.
namespace holdfast::imos {

/// R (.. x 3 x 3) of six numbers (.. x 6) by GS: the rows of R.
torch::Tensor RotationsOf(const torch::Tensor& six);
/// rows12(R) (.. x 6) of R (.. x 3 x 3).
torch::Tensor SixOf(const torch::Tensor& rotations);

struct TorchBody {
  torch::Tensor joints;  ///< (B x 22 x 3)
  torch::Tensor wrists;  ///< (B x 2 x 3 x 3) world rotations: left (joint 20), right (21)
};

/// `rotations` (B x 22 x 3 x 3) relative to parents, `transl` (B x 3), `bones` (B x 22 x 3), as
/// BoneOffsetsOf gives them.
TorchBody ForwardJoints(const torch::Tensor& rotations, const torch::Tensor& transl,
                        const torch::Tensor& bones);

struct TorchObject {
  torch::Tensor T;  ///< (B x 3)
  torch::Tensor R;  ///< (B x 3 x 3)
};

/// The object carried rigidly from `from` to `to` by the left wrist where left (B) is 1, by the
/// right where right (B) is 1; it stays where both are 0.
TorchObject Carried(const TorchObject& object, const TorchBody& from, const TorchBody& to,
                    const torch::Tensor& left, const torch::Tensor& right);

}  // namespace holdfast::imos
