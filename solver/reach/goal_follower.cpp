// SPDX-License-Identifier: MIT
#include "solver/reach/goal_follower.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "generator/body/limb_ik.h"
#include "generator/scripted/minimum_jerk.h"
#include "generator/wandr/motion_states.h"
#include "generator/wandr/pose.h"
#include "generator/wandr/reach_goals.h"
#include "geometry/error.h"
#include "solver/body_ik/arm_ik.h"
#include "solver/body_ik/frame_pose.h"
#include "solver/body_ik/reach_warp.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;

constexpr double kFrame_s = 1.0 / wandr::kFramesPerSecond;
constexpr std::array<int, 4> kLooksAhead = {12, 18, 26, 40};  // frames; goal in reach
constexpr std::array<int, 4> kWalksFor = {0, 15, 30,
                                          60};  // frames beyond the walking time; distant goal
// Meters by which the network's goal lies farther away than the real one, of a person who lags: a
// network whose goal is in reach does not begin to step, but leans after it.
constexpr std::array<double, 3> kBeyond = {0.0, 0.8, 1.6};
constexpr int kPushFrames = 9;
constexpr double kFarthest = 20.0;  // meters

}  // namespace

struct GoalFollower::Loop {
  Loop(const ReachPerson& person, const wandr::NetworkWeights& weights, const FollowOptions& asked)
      : options(asked),
        mirrored(asked.side == Side::kLeft),
        measures(mirrored ? MirroredMeasures(person.measures) : person.measures),
        network(weights),
        cost(wandr::BoneOffsetsOf(measures.rest_joints).Cast<float>(),
             static_cast<float>(measures.sole_y)),
        rollout(network, wandr::BoneOffsetsOf(measures.rest_joints).Cast<float>(), asked.candidates,
                asked.horizon, {.min_frames_left = 10.0, .hold_last_goal = true}),
        pinner(measures.rest_joints, measures.sole_y),
        random(asked.seed, 0),
        here(wandr::StartAtFrame(mirrored ? wandr::MirroredStates(person.states) : person.states,
                                 person.Frame(), wandr::Normalizer<double>(weights.statistics))
                 .Cast<float>()),
        latents(network.LatentSize() * asked.horizon, asked.candidates),
        best(Eigen::VectorXf::Zero(network.LatentSize() * asked.horizon)) {
    BodyFrame frame = FrameOf(here.pose.Cast<double>(), measures.rest_joints.col(0));
    hand = Wrist(frame);
    hand_velocity.setZero();
    pinner.Pin(frame);
  }

  Vector3d Wrist(const BodyFrame& frame) const {
    return Place(measures.rest_joints, frame).joints.col(kRightWrist);
  }

  // Distant goals get a later deadline; otherwise the network lunges.
  int LooksAhead(int candidate) const {
    const auto k = static_cast<std::size_t>(candidate) % kLooksAhead.size();
    const auto walks = static_cast<int>(std::max(0.0, way_left) / kWalking * 30.0);
    return walks == 0 ? kLooksAhead[k] : std::min(240, kLooksAhead[0] + walks + kWalksFor[k]);
  }

  // Updates whether the goal is or comes within reach, and how far the arm is raised.
  void ChooseReach() {
    const Vector3d before = shoulder;
    const BodyFrame frame = FrameOf(here.pose.Cast<double>(), measures.rest_joints.col(0));
    const BodyPlacement placed = Place(measures.rest_joints, frame);
    shoulder = placed.joints.col(kRightShoulder);
    if (steps++ > 0) walk += 0.15 * ((shoulder - before) / kFrame_s - walk);
    const auto away = [&](double frames) {
      Vector3d at = goal.After(frames);
      at.z() = std::max(at.z(), double{FollowCost::kHanging});  // people bend for what is lower
      return (at - shoulder - frames * kFrame_s * walk).norm();
    };
    const double soon = std::min(away(0.0), away(kRaise));
    if (soon < kRaisesWithin) raises = true;
    if (soon > kLowersBeyond) raises = false;
    raised = std::clamp(raised + (raises ? 1.0 : -0.7) / kRaise, 0.0, 1.0);
    way_left = (goal.After(0.0) - placed.joints.col(kPelvis)).head<2>().norm() - 0.8;
  }

  // For every candidate: latents, and the goal some frames ahead, or beyond it.
  void Draw() {
    constexpr double kLagging = 0.1;  // meters behind the stance, where the network is fully lured
    const Eigen::Index size = network.LatentSize(), all = latents.rows();
    best.head(all - size) = best.tail(all - size).eval();
    best.tail(size).setZero();
    plans.resize(static_cast<std::size_t>(options.candidates));
    ahead.resize(plans.size());
    beyond.resize(plans.size());
    const Vector3d pelvis = here.pose.translation.cast<double>() + measures.rest_joints.col(0);
    Vector3d way = goal.After(0.0) - pelvis;
    way.z() = 0.0;
    const double lags = std::clamp((way.norm() - FollowCost::kFar) / kLagging, 0.0, 1.0);
    way /= std::max(way.norm(), 1e-6);
    for (int i = 0; i < options.candidates; ++i) {
      ahead[i] = i == 0 ? best_ahead : LooksAhead(i);
      beyond[i] =
          i == 0 ? best_beyond : lags * kBeyond[static_cast<std::size_t>(i / 4) % kBeyond.size()];
      plans[i] = {{goal.After(ahead[i]) + beyond[i] * way, ahead[i]}};
      auto z = latents.col(i);
      if (i == 0) {
        z = best;
        continue;
      }
      // Every third candidate perturbs the last best; one is the mean motion.
      const bool anew = i % 3 != 0;
      const double sigma = i == 1 ? 0.0 : anew ? options.sigma : 0.4 * options.sigma;
      double pair[2] = {};
      for (Eigen::Index k = 0; k < all; ++k) {
        if (k % 2 == 0) random.NormalPair(pair[0], pair[1]);
        z[k] = static_cast<float>(sigma * pair[k % 2]) + (anew ? 0.0f : best[k]);
      }
    }
  }

  void Choose() {
    Draw();
    const int count = options.candidates;
    const auto reaches = static_cast<float>(MinimumJerk(raised));
    starts.assign(static_cast<std::size_t>(count), here);
    rollout.Begin(starts, plans);
    const Eigen::Index size = network.LatentSize();
    std::vector<float> costs(starts.size(), 0.0f);
    std::vector<wandr::BodyKinematics<float>> before(starts.size()), now(starts.size());
    for (auto& placed : before) cost.Place(here.pose, placed);
    for (int t = 0; t < options.horizon; ++t) {
      rollout.Step(latents.middleRows(size * t, size));
      if (t == 0) first = rollout.PreviousDelta();
      const Eigen::Vector3f wanted = goal.After(t + 1.0).cast<float>();
      for (int i = 0; i < count; ++i) {
        cost.Place(rollout.Poses(t + 1)[i], now[i]);
        costs[i] += cost(before[i], now[i], wanted, reaches);
      }
      before.swap(now);
    }
    int chosen = -1;
    float least = std::numeric_limits<float>::infinity();
    for (int i = 0; i < count; ++i) {
      if (!(costs[i] < least)) continue;
      least = costs[i];
      chosen = i;
    }
    if (chosen < 0) return;  // not finite: pose unchanged
    best = latents.col(chosen);
    best_ahead = ahead[chosen];
    best_beyond = beyond[chosen];
    here.pose = rollout.Poses(1)[chosen];
    here.previous_delta = first.col(chosen);
  }

  // Target of the hand: a critically damped follower of the goal.
  void MoveHand() {
    constexpr double kStiffness = 12.0, kFastest = 3.0;  // 1/s, m/s
    const Vector3d lacks = goal.After(-1.0) - hand;      // relative to the previous frame's goal
    hand_velocity += kFrame_s * (kStiffness * kStiffness * lacks +
                                 2.0 * kStiffness * (goal.Velocity() - hand_velocity));
    const double speed = hand_velocity.norm();
    if (speed > kFastest) hand_velocity *= kFastest / speed;
    hand += kFrame_s * hand_velocity;
  }

  // Arms that do not reach swing. The hand moves to its target in proportion to how far the arm is
  // raised, and only within reach: the trunk does not bend for goals that require walking.
  void PlaceHand(BodyFrame& frame) {
    constexpr double kBends = 0.18;  // meters beyond the arm
    const double share = MinimumJerk(raised);
    const double walks = MinimumJerk(walk.head<2>().norm() / kWalking);
    SwingArms(measures.rest_joints, {1.0, 1.0 - share}, walks, frame);
    if (share <= 0.0) return;
    const auto joints = Place(measures.rest_joints, frame).joints;
    const Vector3d root = joints.col(kRightShoulder), wrist = joints.col(kRightWrist);
    const Vector3d way = hand - root;
    const double farthest = MaxReach(measures.rest_joints, Arm(Side::kRight)) + kBends;
    const Vector3d place = root + way * std::min(1.0, farthest / std::max(way.norm(), 1e-9));
    PlaceWrist(measures.rest_joints, Side::kRight, wrist + share * (place - wrist), frame);
  }

  wandr::Pose<double> Step(Vector3d at) {
    if (mirrored) at = wandr::MirroredPoint(at);
    goal.See(at);
    ChooseReach();
    Choose();
    if (push_frames > 0) {
      const double done = MinimumJerk(1.0 - static_cast<double>(push_frames - 1) / kPushFrames) -
                          MinimumJerk(1.0 - static_cast<double>(push_frames) / kPushFrames);
      --push_frames;
      pushed_for = kPushFrames;  // feet follow the body by steps; it does not return to them
      // The network's previous step is unchanged: with the push in it, the motion would continue.
      here.pose.translation += (done * push).cast<float>();
    }
    BodyFrame frame = FrameOf(here.pose.Cast<double>(), measures.rest_joints.col(0));
    pinner.Pin(frame);
    if (--pushed_for < 0) {
      const Eigen::Vector2d drag = kYield * pinner.Drag();
      here.pose.translation.head<2>() += drag.cast<float>();
      pinner.Follow(drag);
    }
    MoveHand();
    PlaceHand(frame);
    wandr::Pose<double> pose = PoseOf(frame, measures.rest_joints.col(0));
    if (!mirrored) return pose;
    const wandr::StateMatrix<double> state = wandr::StateOf(pose);
    return wandr::PoseOf<double>(wandr::MirroredStates(state).col(0));
  }

  static constexpr double kYield = 0.5;    // fraction of a foot's drag fed back per frame
  static constexpr double kWalking = 1.1;  // m/s
  // Meters from the shoulder: the arm is raised within, and lowered beyond.
  static constexpr double kRaisesWithin = 0.75, kLowersBeyond = 1.0;
  static constexpr double kRaise = 16.0;  // frames

  FollowOptions options;
  bool mirrored;
  BodyMeasures measures;
  wandr::Network<float> network;
  FollowCost cost;
  wandr::Rollout<float> rollout;
  FootPinner pinner;
  nn::RandomStream random;
  wandr::RolloutStart<float> here;  // state of the network, feet not pinned
  Eigen::MatrixXf latents;          // (64 horizon x candidates)
  Eigen::VectorXf best;
  Eigen::MatrixXf first;
  int best_ahead = kLooksAhead[1];
  double best_beyond = 0.0;  // meters
  std::vector<int> ahead;
  std::vector<double> beyond;
  std::vector<wandr::RolloutStart<float>> starts;
  std::vector<wandr::GoalPlan> plans;
  GoalPrediction goal;
  Vector3d hand, hand_velocity;
  Vector3d push = Vector3d::Zero();
  int push_frames = 0, pushed_for = 0;
  int steps = 0;
  Vector3d shoulder = Vector3d::Zero(), walk = Vector3d::Zero();  // of the network; m/s
  bool raises = false;
  double raised = 0.0, way_left = 0.0;  // 0 to 1; meters left to a suitable stance
};

GoalFollower::GoalFollower(const ReachPerson& person, const wandr::NetworkWeights& network,
                           const FollowOptions& options) {
  if (options.candidates < 1 || options.horizon < 1 || !(options.sigma >= 0.0)) {
    throw Error("follow",
                fmt::format("{} candidates over {} frames, sigma {}", options.candidates,
                            options.horizon, options.sigma),
                "Give at least one candidate and one frame, and a sigma of 0 or more");
  }
  loop_ = std::make_unique<Loop>(person, network, options);
}
GoalFollower::~GoalFollower() = default;
GoalFollower::GoalFollower(GoalFollower&&) noexcept = default;

wandr::Pose<double> GoalFollower::Step(const Eigen::Vector3d& goal) {
  const Vector3d pelvis =
      loop_->here.pose.translation.cast<double>() + loop_->measures.rest_joints.col(0);
  const Vector3d seen = loop_->mirrored ? wandr::MirroredPoint(goal) : goal;
  if (!goal.allFinite() || goal.z() < 0.0 || (seen - pelvis).norm() > kFarthest) {
    throw Error("goal " + fmt::format("({:.2f}, {:.2f}, {:.2f})", goal.x(), goal.y(), goal.z()),
                fmt::format("is not a place above the ground within {:.0f} m", kFarthest),
                "Give world meters, z up from the ground");
  }
  return loop_->Step(goal);
}

void GoalFollower::Push(const Eigen::Vector3d& by) {
  if (!by.allFinite() || by.norm() > 1.0) {
    throw Error("push", "is not a displacement of at most 1 m", "Give meters, as in 0.2,0,0");
  }
  loop_->push = loop_->mirrored ? wandr::MirroredPoint(by) : by;
  loop_->push_frames = kPushFrames;
}

}  // namespace holdfast
