// SPDX-License-Identifier: MIT
#include "solver/latent/latent_terms.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "generator/matching/capture_quality.h"
#include "generator/matching/foot_lock.h"
#include "generator/wandr/intention.h"
#include "generator/wandr/walk_pace.h"
#include "solver/terms/motion/feet_terms.h"
#include "solver/terms/motion/goal_terms.h"
#include "solver/terms/motion/posture_terms.h"

namespace holdfast {
namespace {

constexpr double kFrame = 1.0 / wandr::kFramesPerSecond;
constexpr int kPace = 10;       // frames over which the pelvis speed is measured
constexpr int kBurst = 2;       // same, for single steps
constexpr int kCreep = 6;       // frames over which a planted foot must not creep
constexpr int kArriving = 5;    // frames before the deadline
constexpr int kTurn = 8;        // frames over which the heading change is measured
constexpr int kReaching = 20;   // frames before the deadline
constexpr double kHandy = 0.9;  // meters above the ground
constexpr int kRising = 30;     // frames
constexpr int kHeadJoint = 15;
constexpr double kStandsStill = 0.25;  // m/s
constexpr double kWorthWalking = 0.1;  // meters
constexpr double kStrolls = 0.7;       // m/s: no natural cadence below
constexpr double kWalkRatio = 0.41;    // meters per Hz: step length over step frequency
constexpr int kHalfStep = 8;           // frames
constexpr double kLowLean = 0.35;      // per meter that a goal is below kHandy

// Body radius around a joint, meters: feet, arms, trunk and legs.
double Thickness(int joint) {
  if (joint == 7 || joint == 8 || joint == 10 || joint == 11) return 0.06;
  return joint > kHeadJoint ? 0.05 : 0.13;
}

// Between frames against sliding, and over a fifth of a second against creeping.
void AddSkateTerms(const LatentOptions& options, const MotionView& motion, int num_soles,
                   MotionObjective& objective) {
  const int frames = motion.NumFrames();
  const auto slide = std::make_shared<ceres::CauchyLoss>(0.01 * std::sqrt(options.skate));
  const auto creep = std::make_shared<ceres::CauchyLoss>(0.03 * std::sqrt(options.creep));
  std::vector<double> share(static_cast<std::size_t>(frames));
  for (int k = 0; k < num_soles; ++k) {
    const int point = kNumBodyJoints + k;
    for (int t = 0; t < frames; ++t) {
      share[t] = PlantedShare(motion.At(t, point).z());
    }
    for (const int lag : {1, kCreep}) {
      const double weight = lag == 1 ? options.skate : options.creep;
      for (int t = 0; t + lag < frames && weight > 0.0; ++t) {
        const double planted = *std::min_element(share.begin() + t, share.begin() + t + lag + 1);
        if (planted <= 0.0) continue;
        objective.Add("skate", FootSkate(weight * planted), lag == 1 ? slide : creep,
                      {Position(t, point), Position(t + lag, point)});
      }
    }
  }
}

// Terms that apply to every frame.
void AddFrameTerms(const LatentBody& body, const LatentOptions& options, const ReachTask& task,
                   int frames, MotionObjective& objective) {
  const int num_soles = static_cast<int>(body.soles.size());
  // If the wrist must be lower than the length of a hand, the hand is in the floor or bent up,
  // which the latents do not represent.
  const bool in_floor =
      !body.fingertips.empty() && task.goal.z() < body.fingertips[0].offset.norm();
  const int num_tips = in_floor ? 0 : static_cast<int>(body.fingertips.size());
  const auto floor = FloorContact(-0.005, options.floor);
  const auto airborne = Airborne(std::vector<double>(static_cast<std::size_t>(num_soles), 0.0),
                                 0.01, options.airborne);
  const auto speed = HorizontalLimit(options.fastest_m_s, kPace * kFrame, options.speed);
  const auto burst = HorizontalLimit(options.fastest_m_s + 0.3, kBurst * kFrame, options.speed);
  const auto smooth = std::make_shared<JointAcceleration>(kFrame, options.acceleration);
  std::array<MotionTerm, kNumBodyJoints> ranges;
  for (std::size_t k = 1; k < kNumBodyJoints; ++k) {
    if (body.joint_limits[k] > 0.0 && options.limits > 0.0) {
      ranges[k] = RotationRange(body.joint_limits[k],
                                k == 13 || k == 14 ? options.collars : options.limits);
    }
  }
  for (int t = 1; t < frames; ++t) {
    std::vector<MotionQuantity> soles;
    for (int k = 0; k < num_soles + num_tips; ++k) {
      const MotionQuantity point = Position(t, kNumBodyJoints + k);
      objective.Add("floor", floor, nullptr, {point});
      if (k < num_soles) soles.push_back(point);
    }
    objective.Add("airborne", airborne, nullptr, std::move(soles));
    if (t >= kBurst) {
      objective.Add("speed", burst, nullptr, {Position(t - kBurst, 0), Position(t, 0)});
    }
    if (t >= kPace) {
      objective.Add("speed", speed, nullptr, {Position(t - kPace, 0), Position(t, 0)});
    }
    if (options.acceleration > 0.0 && t + 1 < frames) {
      for (int k = 0; k < kNumBodyJoints; ++k) {
        objective.Add("acceleration", smooth, nullptr,
                      {Position(t - 1, k), Position(t, k), Position(t + 1, k)});
      }
    }
    for (int k = 1; k < kNumBodyJoints; ++k) {
      const auto& range = ranges[k];
      if (range != nullptr) objective.Add("limits", range, nullptr, {LocalRotation(t, k)});
    }
  }
}

void AddBalanceTerms(const LatentOptions& options, const MotionView& motion, const ReachTask& task,
                     MotionObjective& objective) {
  const int frames = motion.NumFrames();
  const auto balance = StandingBalance(0.05, options.balance);
  std::vector<int> joints;
  for (const auto& mass : kBalanceMasses) joints.push_back(mass.first);
  joints.insert(joints.end(), kBalanceFeet.begin(), kBalanceFeet.end());
  for (int t = 1; t < frames; ++t) {
    // The body stands on arrival, and otherwise when it hardly moves.
    const bool arrived = t >= task.deadline - kArriving && t <= task.deadline + options.hold_frames;
    const int before = std::max(0, t - kPace), after = std::min(frames - 1, t + kPace);
    const Eigen::Vector3d way = motion.At(after, 0) - motion.At(before, 0);
    if (!arrived && way.head<2>().norm() > kStandsStill * (after - before) * kFrame) continue;
    std::vector<MotionQuantity> blocks;
    for (const int joint : joints) blocks.push_back(Position(t, joint));
    objective.Add("balance", balance, nullptr, std::move(blocks));
  }
}

void AddObstacleTerms(const LatentOptions& options, int frames, MotionObjective& objective) {
  for (const auto& obstacle : options.obstacles) {
    for (int k = 0; k < kNumBodyJoints; ++k) {
      const double clearance = k == GoalJoint(options) ? 0.02 : Thickness(k);
      const auto keep_out = Obstacle(*obstacle, clearance, options.obstacle);
      for (int t = 1; t < frames; ++t) {
        objective.Add("obstacle", keep_out, nullptr, {Position(t, k)});
      }
    }
  }
}

// Stand close enough to reach the goal at the deadline.
void AddStanceTerms(const LatentOptions& options, const ReachTask& task, int frames,
                    MotionObjective& objective) {
  const int first = std::max(1, task.deadline - 3 * kArriving);
  const int last = std::min(frames - 1, task.deadline + options.hold_frames);
  const auto near =
      StandNear(task.goal, options.farthest_stance_m, options.near / (last - first + 1));
  for (int t = first; t <= last; ++t) objective.Add("near", near, nullptr, {Position(t, 0)});
}

// Walk at an even pace to where the goal is in reach.
void AddPathTerms(const LatentOptions& options, const MotionView& motion, const ReachTask& task,
                  MotionObjective& objective) {
  const wandr::WalkPace pace = wandr::PaceOf(task.start, motion.At(0, 0), task.velocity, task.goal);
  // The straight path is invalid if there are obstacles.
  if (pace.Length() < kWorthWalking || !options.obstacles.empty()) return;
  const auto gently = std::make_shared<ceres::CauchyLoss>(0.5 * std::sqrt(options.path));
  const auto turning = std::make_shared<ceres::CauchyLoss>(0.3 * std::sqrt(options.along));
  const double stretch = static_cast<double>(pace.Deadline()) / std::max(1, task.deadline);
  const int last = std::min(motion.NumFrames() - 1, static_cast<int>(pace.Arrival() / stretch));
  for (int t = 3; t <= last; t += 3) {
    const wandr::WalkPace::Stand stand = pace.At(stretch * t);
    objective.Add("path", PelvisPath(stand.position, options.path), gently, {Position(t, 0)});
    if (options.along > 0.0) {
      objective.Add("along", HeadingAlong(stand.facing, options.along), turning,
                    {WorldRotation(t, 0)});
    }
  }
  if (options.cadence <= 0.0) return;
  for (int t = 1; t < last; ++t) {
    const wandr::WalkPace::Stand stand = pace.At(stretch * (t + kHalfStep));
    const double speed = stand.speed_m_s * stretch;
    if (speed < kStrolls) continue;
    const int step =
        static_cast<int>(std::lround(wandr::kFramesPerSecond / std::sqrt(speed / kWalkRatio)));
    if (t + step > last) continue;
    objective.Add("cadence", Cadence(stand.facing, options.cadence), nullptr,
                  {Position(t, kLeftAnkle), Position(t, kRightAnkle),
                   Position(t + step, kLeftAnkle), Position(t + step, kRightAnkle)});
  }
}

void AddLookTerms(const LatentOptions& options, const ReachTask& task, int frames,
                  MotionObjective& objective) {
  const auto look = LookAt(task.goal, options.look);
  for (int t = std::max(1, task.deadline - 45); t <= std::min(task.deadline, frames - 1); t += 3) {
    objective.Add("look", look, nullptr, {WorldRotation(t, kHeadJoint), Position(t, kHeadJoint)});
  }
}

// Frame at which reaching begins: earlier for low goals.
int ReachesFrom(const ReachTask& task) {
  return task.deadline - (task.goal.z() < kHandy ? 2 * kReaching : kReaching);
}

// Turn while walking, with an upright trunk; leaning is allowed while reaching.
void AddPostureTerms(const LatentOptions& options, const MotionView& motion, const ReachTask& task,
                     MotionObjective& objective) {
  const int frames = motion.NumFrames();
  if (options.turn > 0.0) {
    const auto turn = HeadingTurn(options.fastest_turn_rad_s, kTurn * kFrame, options.turn);
    for (int t = 0; t + kTurn < frames; t += 2) {
      objective.Add("turn", turn, nullptr, {WorldRotation(t, 0), WorldRotation(t + kTurn, 0)});
    }
  }
  if (options.lean <= 0.0) return;
  const auto walk = HorizontalLimit(options.farthest_lean_m, 1.0, options.lean);
  // Bend for low goals.
  const double low_m = std::max(0.0, kHandy - task.goal.z());
  const auto reach =
      HorizontalLimit(options.farthest_lean_reaching_m + kLowLean * low_m, 1.0, options.lean);
  const int reaching = ReachesFrom(task);
  const double first_m = (motion.At(0, kNeck) - motion.At(0, 0)).head<2>().norm();
  for (int t = 1; t < frames; ++t) {
    MotionTerm lean = t < reaching ? walk : reach;
    // A body that is bent at the start has a second to straighten.
    const double still_m = first_m * (1.0 - static_cast<double>(t) / kRising);
    if (t < kRising && still_m > options.farthest_lean_m) {
      lean = HorizontalLimit(still_m, 1.0, options.lean);
    }
    objective.Add("lean", lean, nullptr, {Position(t, 0), Position(t, kNeck)});
  }
}

// Pelvis height of a person standing on straight legs, meters above the ground.
double StandingHeight(const LatentBody& body) {
  constexpr int kHip = 1, kKnee = 4, kAnkle = 7;
  const auto& offset = body.bones.offset;
  return offset.col(kKnee).norm() + offset.col(kAnkle).norm() - offset(1, kHip) -
         body.soles[0].offset.y();
}

// No crouching while walking; a low start has a second to rise.
void AddHeightTerms(const LatentBody& body, const LatentOptions& options, const MotionView& motion,
                    const ReachTask& task, MotionObjective& objective) {
  if (options.height <= 0.0 || body.soles.empty()) return;
  const double lowest_m = options.lowest_walk * StandingHeight(body);
  const double missing_m = std::max(0.0, lowest_m - motion.At(0, 0).z());
  const int last = std::min(motion.NumFrames() - 1, ReachesFrom(task));
  for (int t = 1; t < last; ++t) {
    const double still_m = missing_m * std::max(0.0, 1.0 - static_cast<double>(t) / kRising);
    objective.Add("height", FloorContact(lowest_m - still_m, options.height), nullptr,
                  {Position(t, 0)});
  }
}

}  // namespace

std::vector<BodyPoint> PointsOf(const LatentBody& body) {
  std::vector<BodyPoint> points = body.soles;
  points.insert(points.end(), body.fingertips.begin(), body.fingertips.end());
  return points;
}

int GoalJoint(const LatentOptions& options) { return WristJoint(options.intention.wrist); }

void AddNaturalTerms(const LatentBody& body, const LatentOptions& options, const MotionView& motion,
                     const ReachTask& task, MotionObjective& objective) {
  const int frames = motion.NumFrames();
  const int num_soles = static_cast<int>(body.soles.size());
  if (options.skate > 0.0) AddSkateTerms(options, motion, num_soles, objective);
  AddFrameTerms(body, options, task, frames, objective);
  if (options.balance > 0.0) AddBalanceTerms(options, motion, task, objective);
  AddObstacleTerms(options, frames, objective);
  if (options.near > 0.0) AddStanceTerms(options, task, frames, objective);
  if (options.path > 0.0) AddPathTerms(options, motion, task, objective);
  if (options.look > 0.0) AddLookTerms(options, task, frames, objective);
  AddPostureTerms(options, motion, task, objective);
  AddHeightTerms(body, options, motion, task, objective);
}

void AddGoalTerms(const LatentOptions& options, const ReachTask& task, double share_done,
                  int frames, MotionObjective& objective) {
  const int joint = GoalJoint(options);
  if (options.free_time) {
    const int last = std::min(frames - 1, task.deadline + options.late_frames);
    std::vector<MotionQuantity> window;
    for (int t = 1; t <= last; ++t) window.push_back(Position(t, joint));
    const double tau =
        options.soft_min_from_m *
        std::pow(options.soft_min_to_m / options.soft_min_from_m, std::min(1.0, 2.0 * share_done));
    const int count = static_cast<int>(window.size());
    objective.Add("goal", FirstArrival(task.goal, count, tau, options.goal), nullptr,
                  std::move(window));
    return;
  }
  const int last = std::min(frames - 1, task.deadline + options.hold_frames);
  const int first = std::min(task.deadline, last);
  const double each = options.goal / (last - first + 1);
  const auto goal = std::make_shared<NearPoint>(task.goal, each);
  for (int t = first; t <= last; ++t) objective.Add("goal", goal, nullptr, {Position(t, joint)});
  if (options.approach) {
    const auto approach =
        ApproachDirection(*options.approach, options.direction / (last - first + 1));
    for (int t = first; t <= last; ++t) {
      objective.Add("direction", approach, nullptr,
                    {Position(t, kJointParents[joint]), Position(t, joint)});
    }
  }
}

LatentBody LatentBodyOf(const Eigen::Matrix3Xd& rest_joints, double sole_y) {
  LatentBody body;
  body.bones = wandr::BoneOffsetsOf(rest_joints).Cast<float>();
  // Heels and balls as in the ground probe; toes extend by about half the ankle-to-ball distance,
  // fingertips lie beyond the last knuckle of the middle finger.
  constexpr double kToes = 0.45, kFinger = 1.13;
  constexpr std::array<std::array<int, 2>, 2> kFeet = {{{7, 10}, {8, 11}}};
  constexpr std::array<std::array<int, 2>, 2> kHands = {{{20, 30}, {21, 45}}};
  BodyFrame rest;
  rest.pelvis = rest_joints.col(0);
  const Soles soles = SolePoints(rest_joints, sole_y).At(Place(rest_joints, rest));
  for (int side = 0; side < 2; ++side) {
    const auto [ankle, ball] = kFeet[side];
    const Eigen::Vector3d heel = soles.col(2 * side) - rest_joints.col(ankle);
    const Eigen::Vector3d under_ball = soles.col(2 * side + 1) - rest_joints.col(ball);
    const double length = rest_joints(2, ball) - rest_joints(2, ankle);
    body.soles.push_back({ankle, heel});
    body.soles.push_back({ball, under_ball});
    body.soles.push_back({ball, under_ball + kToes * length * Eigen::Vector3d::UnitZ()});
    const auto [wrist, knuckle] = kHands[side];
    body.fingertips.push_back(
        {wrist, kFinger * (rest_joints.col(knuckle) - rest_joints.col(wrist))});
  }
  body.joint_limits = CapturedJointLimits();
  for (const std::size_t k : {13, 14}) {
    body.joint_limits[k] = std::min(body.joint_limits[k], kCollarLimit);
  }
  return body;
}

namespace {

// The refit pins feet, keeps them on the ground and balances standing bodies; timing and position
// are the network's choice.
LatentOptions LeftByRefit() {
  LatentOptions options;
  options.skate = options.creep = options.floor = options.airborne = options.balance = 0.0;
  options.path = options.near = options.look = 0.0;
  return options;
}

}  // namespace

double MotionCost(const LatentBody& body, std::span<const Eigen::Vector3d> goals,
                  const wandr::ReachSample& sample) {
  const LatentOptions options = LeftByRefit();
  const auto bones = body.bones.Cast<double>();
  const std::vector<BodyPoint> points = PointsOf(body);
  double sum = 0.0;
  int frames = 0;
  for (std::size_t g = 0; g < goals.size(); ++g) {
    const wandr::GoalOutcome& outcome = sample.goals[g];
    const int first = outcome.taken_on, steps = outcome.left - first;
    if (first < 0 || steps < 1) continue;
    ReachTask task;
    task.goal = goals[g];
    task.num_steps = steps;
    task.deadline = outcome.due - first;
    MotionView motion(points);
    motion.Resize(steps + 1);
    for (int t = 0; t <= steps; ++t) {
      motion.Set(t, wandr::PoseOf<float>(sample.track.states.col(first + t)), bones);
    }
    MotionObjective objective;
    AddNaturalTerms(body, options, motion, task, objective);
    sum += objective.Evaluate(motion);
    frames += steps;
  }
  return frames > 0 ? sum / frames : 0.0;
}

}  // namespace holdfast
