// SPDX-License-Identifier: MIT
#include "solver/latent/latent_terms.h"

#include <gtest/gtest.h>

#include "generator/wandr/motion_states.h"
#include "generator/wandr/network.h"
#include "geometry/rotation.h"
#include "tests/support/wandr_scene.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;
using wandr::testing::DefaultBody;
using wandr::testing::DefaultBones;

// What the embedded network makes of a goal, and the same motion changed.
class MotionCostOf : public ::testing::Test {
 protected:
  MotionCostOf() {
    const wandr::NetworkWeights weights = wandr::DefaultNetwork();
    const wandr::Network<float> network(weights);
    const auto start = wandr::StartAtRest(wandr::StandingPose(DefaultBody()),
                                          wandr::Normalizer<double>(weights.statistics))
                           .Cast<float>();
    sample_ = wandr::ReachGoals(network, DefaultBones().Cast<float>(), start, {&goal_, 1}, 1, 1)[0];
  }

  double Cost() const { return MotionCost(body_, {&goal_, 1}, sample_); }

  template <typename Change>
  void ForEachPose(const Change& change) {
    for (Eigen::Index t = 0; t < sample_.track.states.cols(); ++t) {
      wandr::Pose<double> pose = wandr::PoseOf<float>(sample_.track.states.col(t)).Cast<double>();
      change(t, pose);
      sample_.track.states.col(t) = wandr::StateOf(pose.Cast<float>());
    }
  }

  Vector3d goal_{1.5, 1.0, 1.1};
  LatentBody body_ = LatentBodyOf(DefaultBody().rest_joints, DefaultBody().sole_y);
  wandr::ReachSample sample_;
};

TEST_F(MotionCostOf, OneElsewhereIsTheSame) {
  const double before = Cost();
  EXPECT_GT(before, 0.0);
  const Vector3d by(3.0, -2.0, 0.0);
  ForEachPose([&](Eigen::Index, wandr::Pose<double>& pose) { pose.translation += by; });
  goal_ += by;
  EXPECT_NEAR(Cost(), before, 1e-4 * before);
}

TEST_F(MotionCostOf, WhoLeansCostsMore) {
  const double before = Cost();
  ForEachPose([](Eigen::Index, wandr::Pose<double>& pose) {
    pose.rotation[3] = pose.rotation[3] * ExpSO3({25.0 * kDegree, 0.0, 0.0});
  });
  EXPECT_GT(Cost(), 1.2 * before);
}

TEST_F(MotionCostOf, WhoGoesOnBentKneesCostsMore) {
  const double before = Cost();
  ForEachPose([](Eigen::Index, wandr::Pose<double>& pose) { pose.translation.z() -= 0.2; });
  EXPECT_GT(Cost(), 1.2 * before);
}

TEST_F(MotionCostOf, WhoShakesCostsMore) {
  const double before = Cost();
  ForEachPose([](Eigen::Index t, wandr::Pose<double>& pose) {
    pose.rotation[16] = pose.rotation[16] * ExpSO3({0.0, (t % 2 == 0 ? 8.0 : -8.0) * kDegree, 0.0});
  });
  EXPECT_GT(Cost(), 1.2 * before);
}

// Feet are the refit's business, and so is where one is when.
TEST_F(MotionCostOf, WhoGlidesCostsNoMore) {
  const double before = Cost();
  ForEachPose([](Eigen::Index t, wandr::Pose<double>& pose) {
    pose.translation.x() += 0.002 * static_cast<double>(t);
  });
  EXPECT_LT(Cost(), 1.05 * before);
}

}  // namespace
}  // namespace holdfast
