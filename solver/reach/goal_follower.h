// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "generator/nn/random_stream.h"
#include "generator/wandr/network.h"
#include "generator/wandr/rollout.h"
#include "geometry/body/skeleton.h"
#include "solver/body_ik/foot_pinner.h"
#include "solver/reach/goal_prediction.h"
#include "solver/reach/reach_person.h"

namespace holdfast {

struct FollowOptions {
  Side side = Side::kRight;
  int candidates = 48;  ///< motions tried in every frame; time grows with both
  int horizon = 14;     ///< frames that they look ahead
  double sigma = 0.7;   ///< of the latents drawn anew
  std::uint64_t seed = 1;
};

/// A person follows a goal of the wrist that moves as it likes, frame by frame at 30 Hz: what comes
/// out for a frame depends on the goals up to it and no later one.
///
///   GoalFollower follower(StandingPerson(BodyModel::Default()), wandr::DefaultNetwork());
///   while (...) show(follower.Step(goal_now));
///
/// A goal that is or comes within reach is reached for; to one that is farther away the person
/// walks upright with swinging arms (SwingArms), and raises the arm in time. In every frame the
/// network is rolled out from where it is with some draws of latents, the last frame's best among
/// them, and intentions that look ahead by more or less; the motion that costs least (FollowCost)
/// gives the next pose. Then feet are pinned (FootPinner) and trunk and arm bring the wrist to the
/// goal as far as that is in reach (PlaceWrist), along a path of its own of limited speed, so that
/// a goal that jumps does not make the hand jump. Network and body are one loop: what pinned feet
/// hold back, the network is told.
class GoalFollower {
 public:
  /// Goes on from the last frame of `person`. `network` is copied into a runnable one. Throws Error
  /// for options that make no sense.
  GoalFollower(const ReachPerson& person, const wandr::NetworkWeights& network,
               const FollowOptions& options = {});
  ~GoalFollower();
  GoalFollower(GoalFollower&&) noexcept;

  /// The pose 1/30 s later, `goal` being where the wrist is wanted now (world, metres, z up). The
  /// first call gives frame 1 of the motion; frame 0 is where the person was. Throws Error for a
  /// goal that is not finite, below the ground or more than 20 m from the pelvis.
  wandr::Pose<double> Step(const Eigen::Vector3d& goal);
  /// Something moves the body by that much (world, metres, at most 1 m) over the next 0.3 s; its
  /// feet stay as long as they can.
  void Push(const Eigen::Vector3d& by);

 private:
  struct Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace holdfast
