// SPDX-License-Identifier: MIT
#include "generator/training/imos/imos_augmentation.h"

#include <algorithm>

#include "generator/scripted/minimum_jerk.h"
#include "generator/training/imos/imos_kinematics.h"

namespace holdfast::imos {
namespace {

constexpr int kArmsThereFrom = 10;  // key frame

// Rotations (.. x 3 x 3) of axis-angles (.. x 3), by Rodrigues.
torch::Tensor Exp(const torch::Tensor& axis_angle) {
  const torch::Tensor angle = torch::sqrt((axis_angle * axis_angle).sum(-1, true) + 1e-12);
  const torch::Tensor axis = axis_angle / angle;
  const torch::Tensor x = axis.select(-1, 0), y = axis.select(-1, 1), z = axis.select(-1, 2);
  const torch::Tensor zero = torch::zeros_like(x);
  const torch::Tensor cross =
      torch::stack({torch::stack({zero, -z, y}, -1), torch::stack({z, zero, -x}, -1),
                    torch::stack({-y, x, zero}, -1)},
                   -2);
  const torch::Tensor a = angle.unsqueeze(-1);
  return torch::eye(3) + torch::sin(a) * cross +
         (1.0 - torch::cos(a)) * torch::matmul(cross, cross);
}

// How much of its turn each joint has in each key frame, (T x 22 x 1).
torch::Tensor Shares() {
  torch::Tensor shares = torch::ones({kNumKeyFrames, kNumPoseJoints, 1});
  shares.select(1, 0).fill_(0.5);
  for (int t = kHistory; t < kNumKeyFrames; ++t) {
    const double way = static_cast<double>(t - kHistory + 1) / (kArmsThereFrom - kHistory + 1);
    shares[t]
        .narrow(0, kNumTrunkJoints, kNumArmJoints)
        .fill_(1.0 - MinimumJerk(std::min(way, 1.0)));
  }
  return shares;
}

}  // namespace

void DisturbShapes(SequenceTensors& batch, double deviation, at::Generator& generator) {
  batch.betas = batch.betas + torch::empty_like(batch.betas).normal_(0.0, deviation, generator);
}

void DisturbStances(SequenceTensors& batch, double deviation_rad, at::Generator& generator) {
  if (deviation_rad <= 0.0) return;
  const torch::NoGradGuard no_gradients;
  const std::int64_t rows = batch.Count(), frames = kNumKeyFrames;
  const auto each = [&](const torch::Tensor& x) { return x.flatten(0, 1); };  // B T x ..
  const torch::Tensor turns =
      torch::empty({rows, 1, kNumPoseJoints, 3}).normal_(0.0, deviation_rad, generator) * Shares();
  const torch::Tensor before =
      RotationsOf(each(batch.pose).view({rows * frames, kNumPoseJoints, kRotationSize}));
  const torch::Tensor after = torch::matmul(before, Exp(each(turns)));
  const torch::Tensor transl = each(batch.transl);
  const torch::Tensor bones = each(batch.bones.unsqueeze(1).expand({-1, frames, -1, -1}));
  const TorchBody was = ForwardJoints(before, transl, bones),
                  is = ForwardJoints(after, transl, bones);
  const TorchObject object = Carried({each(batch.object_T), each(batch.object_R)}, was, is,
                                     each(batch.by_left), each(batch.by_right));
  batch.pose = SixOf(after).reshape({rows, frames, kPoseSize});
  batch.joints = is.joints.view({rows, frames, kNumPoseJoints, 3});
  batch.object_T = object.T.view({rows, frames, 3});
  batch.object_R = object.R.view({rows, frames, 3, 3});
}

}  // namespace holdfast::imos
