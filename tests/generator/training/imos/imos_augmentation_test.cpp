// SPDX-License-Identifier: MIT
#include "generator/training/imos/imos_augmentation.h"

#include <vector>

#include <ATen/CPUGeneratorImpl.h>
#include <gtest/gtest.h>

#include "generator/training/imos/imos_kinematics.h"
#include "tests/support/action_scene.h"

namespace holdfast::imos {
namespace {

// All key frames of all rows, one below the other.
struct Posed {
  explicit Posed(const SequenceTensors& batch)
      : rotations(RotationsOf(batch.pose.flatten(0, 1).view({-1, kNumPoseJoints, kRotationSize}))),
        body(ForwardJoints(
            rotations, batch.transl.flatten(0, 1),
            batch.bones.unsqueeze(1).expand({-1, kNumKeyFrames, -1, -1}).flatten(0, 1))) {}

  torch::Tensor rotations;
  TorchBody body;
};

SequenceTensors Disturbed(const SequenceTensors& batch, double deviation, std::uint64_t seed = 1) {
  SequenceTensors copy = batch;
  at::Generator generator = at::detail::createCPUGenerator(seed);
  DisturbStances(copy, deviation, generator);
  return copy;
}

double Largest(const torch::Tensor& x) { return x.abs().max().item<double>(); }

TEST(DisturbStances, IsAnotherPersonDoingTheSame) {
  const SequenceTensors batch = TensorsOf(testing::ComposedSequences(12));
  const SequenceTensors other = Disturbed(batch, 0.1);
  const Posed was(batch), is(other);
  EXPECT_LT(Largest(is.body.joints.view_as(other.joints) - other.joints), 1e-5)
      << "joints are those of the pose";

  // Turns after the parent's frame: R^T R', by joint and key frame.
  const torch::Tensor turns = torch::matmul(was.rotations.transpose(-1, -2), is.rotations)
                                  .view({batch.Count(), kNumKeyFrames, kNumPoseJoints, 3, 3});
  const torch::Tensor trunk = turns.narrow(2, 0, kNumTrunkJoints);
  EXPECT_LT(Largest(trunk - trunk.narrow(1, 0, 1)), 1e-5) << "they stand the same all the time";
  const torch::Tensor arms = turns.narrow(2, kNumTrunkJoints, kNumArmJoints);
  EXPECT_LT(Largest(arms.narrow(1, 0, kHistory) - arms.narrow(1, 0, 1)), 1e-5);
  EXPECT_LT(Largest(arms.narrow(1, 10, kNumKeyFrames - 10) - torch::eye(3)), 1e-5)
      << "hands come to where they should be";
  // trace R = 1 + 2 cos: a mean angle of three N(0, s^2) is 1.6 s.
  const torch::Tensor cosines =
      0.5 * (trunk.diagonal(0, -2, -1).sum(-1).narrow(2, 1, kNumTrunkJoints - 1) - 1.0);
  const double angle = torch::acos(cosines.clamp(-1.0, 1.0)).mean().item<double>();
  EXPECT_GT(angle, 0.13);
  EXPECT_LT(angle, 0.19);

  // What is carried stays in the hand.
  const auto in_hand = [&](const SequenceTensors& s, const Posed& posed, int wrist, int joint) {
    const torch::Tensor arm = s.object_T.flatten(0, 1) - posed.body.joints.select(1, joint);
    const torch::Tensor turn = posed.body.wrists.select(1, wrist).transpose(1, 2);
    return torch::cat(
        {torch::bmm(turn, arm.unsqueeze(2)), torch::bmm(turn, s.object_R.flatten(0, 1))}, 2);
  };
  for (const auto& [wrist, joint, by] :
       {std::tuple(0, 20, batch.by_left), std::tuple(1, 21, batch.by_right)}) {
    const torch::Tensor moved =
        (in_hand(other, is, wrist, joint) - in_hand(batch, was, wrist, joint)) *
        by.flatten().view({-1, 1, 1});
    EXPECT_LT(Largest(moved), 1e-5);
  }
  EXPECT_GT(Largest(other.object_T - batch.object_T), 0.01);
}

TEST(DisturbStances, FollowsFromItsGeneratorAndDoesNothingByNothing) {
  const SequenceTensors batch = TensorsOf(testing::ComposedSequences(6));
  EXPECT_TRUE(torch::equal(Disturbed(batch, 0.1).pose, Disturbed(batch, 0.1).pose));
  EXPECT_FALSE(torch::equal(Disturbed(batch, 0.1).pose, Disturbed(batch, 0.1, 2).pose));
  EXPECT_TRUE(torch::equal(Disturbed(batch, 0.0).pose, batch.pose));
}

TEST(DisturbShapes, MovesBetasAlone) {
  // Many, for the deviation; the same ten again and again, as making one takes long.
  std::vector<ActionSequence> sequences;
  const std::vector<ActionSequence> ten = testing::ComposedSequences(10);
  for (int k = 0; k < 20; ++k) sequences.insert(sequences.end(), ten.begin(), ten.end());
  const SequenceTensors batch = TensorsOf(sequences);
  SequenceTensors other = batch;
  at::Generator generator = at::detail::createCPUGenerator(3);
  DisturbShapes(other, 0.5, generator);
  const double deviation = (other.betas - batch.betas).std().item<double>();
  EXPECT_NEAR(deviation, 0.5, 0.05);
  EXPECT_TRUE(torch::equal(other.bones, batch.bones));
}

}  // namespace
}  // namespace holdfast::imos
