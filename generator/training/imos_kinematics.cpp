// SPDX-License-Identifier: MIT
#include "generator/training/imos_kinematics.h"

#include <vector>

#include "geometry/skeleton.h"

namespace holdfast::imos {
namespace {

constexpr double kLeastNorm = 1e-9;

torch::Tensor Normalised(const torch::Tensor& v) {
  return v / torch::sqrt((v * v).sum(-1, true) + kLeastNorm * kLeastNorm);
}

}  // namespace

torch::Tensor RotationsOf(const torch::Tensor& six) {
  const torch::Tensor a1 = six.narrow(-1, 0, 3), a2 = six.narrow(-1, 3, 3);
  const torch::Tensor b1 = Normalised(a1);
  const torch::Tensor b2 = Normalised(a2 - (b1 * a2).sum(-1, true) * b1);
  return torch::stack({b1, b2, torch::cross(b1, b2, -1)}, -2);
}

torch::Tensor SixOf(const torch::Tensor& rotations) {
  return rotations.narrow(-2, 0, 2).flatten(-2);
}

TorchBody ForwardJoints(const torch::Tensor& rotations, const torch::Tensor& transl,
                        const torch::Tensor& bones) {
  std::vector<torch::Tensor> world(kNumBodyJoints), joints(kNumBodyJoints);
  world[0] = rotations.select(1, 0);
  joints[0] = transl + bones.select(1, 0);
  for (int k = 1; k < kNumBodyJoints; ++k) {
    const torch::Tensor& above = world[kJointParents[k]];
    joints[k] =
        joints[kJointParents[k]] + torch::bmm(above, bones.select(1, k).unsqueeze(2)).squeeze(2);
    world[k] = torch::bmm(above, rotations.select(1, k));
  }
  return {torch::stack(joints, 1),
          torch::stack({world[WristJoint(Side::kLeft)], world[WristJoint(Side::kRight)]}, 1)};
}

TorchObject Carried(const TorchObject& object, const TorchBody& from, const TorchBody& to,
                    const torch::Tensor& left, const torch::Tensor& right) {
  const auto by = [&](int wrist, int joint) {
    const torch::Tensor turn =
        torch::bmm(to.wrists.select(1, wrist), from.wrists.select(1, wrist).transpose(1, 2));
    const torch::Tensor arm = object.T - from.joints.select(1, joint);
    return TorchObject{torch::bmm(turn, arm.unsqueeze(2)).squeeze(2) + to.joints.select(1, joint),
                       torch::bmm(turn, object.R)};
  };
  const TorchObject in_left = by(0, WristJoint(Side::kLeft));
  const TorchObject in_right = by(1, WristJoint(Side::kRight));
  const auto choose = [&](const torch::Tensor& stays, const torch::Tensor& l,
                          const torch::Tensor& r, const std::vector<std::int64_t>& shape) {
    const torch::Tensor a = left.view(shape), b = right.view(shape);
    return stays * (1.0 - a - b) + l * a + r * b;
  };
  return {choose(object.T, in_left.T, in_right.T, {-1, 1}),
          choose(object.R, in_left.R, in_right.R, {-1, 1, 1})};
}

}  // namespace holdfast::imos
