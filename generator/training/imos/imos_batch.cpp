// SPDX-License-Identifier: MIT
#include "generator/training/imos/imos_batch.h"

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast::imos {

SequenceTensors SequenceTensors::Rows(std::span<const std::int64_t> rows) const {
  const torch::Tensor index = torch::tensor(at::ArrayRef<std::int64_t>(rows.data(), rows.size()));
  SequenceTensors out;
  const auto pick = [&](const torch::Tensor& from, torch::Tensor& to) {
    to = from.index_select(0, index);
  };
  pick(pose, out.pose);
  pick(transl, out.transl);
  pick(joints, out.joints);
  pick(object_T, out.object_T);
  pick(object_R, out.object_R);
  pick(by_left, out.by_left);
  pick(by_right, out.by_right);
  pick(bones, out.bones);
  pick(betas, out.betas);
  pick(action, out.action);
  pick(object_id, out.object_id);
  return out;
}

SequenceTensors TensorsOf(std::span<const ActionSequence> sequences) {
  const auto count = static_cast<std::int64_t>(sequences.size());
  constexpr std::int64_t kFrames = kNumKeyFrames, kJoints = kNumPoseJoints;
  SequenceTensors out;
  out.pose = torch::empty({count, kFrames, kPoseSize});
  out.transl = torch::empty({count, kFrames, 3});
  out.joints = torch::empty({count, kFrames, kJoints, 3});
  out.object_T = torch::empty({count, kFrames, 3});
  out.object_R = torch::empty({count, kFrames, 3, 3});
  out.by_left = torch::zeros({count, kFrames});
  out.by_right = torch::zeros({count, kFrames});
  out.bones = torch::empty({count, kJoints, 3});
  out.betas = torch::empty({count, kNumBetas});
  out.action = torch::empty({count}, torch::kInt64);
  out.object_id = torch::zeros({count, kNumObjects});
  for (std::int64_t b = 0; b < count; ++b) {
    const ActionSequence& sequence = sequences[static_cast<std::size_t>(b)];
    if (sequence.NumKeyFrames() != kFrames) {
      throw Error(sequence.source.empty() ? sequence.name : sequence.source,
                  fmt::format("has {} key frames", sequence.NumKeyFrames()),
                  fmt::format("{} are needed", kFrames));
    }
    const auto columns = [](const torch::Tensor& row, std::int64_t numbers) {
      return Eigen::Map<Eigen::MatrixXf>(row.data_ptr<float>(), numbers, row.numel() / numbers);
    };
    columns(out.pose[b], kPoseSize) = sequence.pose.topRows<kPoseSize>().cast<float>();
    columns(out.transl[b], 3) = sequence.transl.cast<float>();
    columns(out.joints[b], 3 * kJoints) = sequence.joints.cast<float>();
    columns(out.object_T[b], 3) = sequence.object_transl.cast<float>();
    for (int k = 0; k < kFrames; ++k) {
      columns(out.object_R[b][k], 3) = sequence.ObjectRotation(k).transpose().cast<float>();
      out.by_left[b][k] = sequence.carriers[k] == Carrier::kLeftWrist ? 1.0f : 0.0f;
      out.by_right[b][k] = sequence.carriers[k] == Carrier::kRightWrist ? 1.0f : 0.0f;
    }
    columns(out.bones[b], 3) = wandr::BoneOffsetsOf(sequence.rest_joints).offset.cast<float>();
    columns(out.betas[b], kNumBetas) = sequence.betas.cast<float>();
    out.action[b] = sequence.action;
    out.object_id[b][sequence.object] = 1.0f;
  }
  return out;
}

}  // namespace holdfast::imos
