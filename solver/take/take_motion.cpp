// SPDX-License-Identifier: MIT
#include "solver/take/take_motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include <fmt/format.h>

#include "generator/body/pose_builder.h"
#include "generator/matching/body_frame.h"
#include "generator/matching/foot_lock.h"
#include "generator/scripted/minimum_jerk.h"
#include "generator/wandr/motion_states.h"
#include "geometry/body/skeleton.h"
#include "geometry/error.h"
#include "geometry/rotation.h"
#include "solver/body_ik/reach_warp.h"
#include "solver/fit/clip_state.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr int kWarpMargin = 16, kWarpReach = 26;  // frames around a place
constexpr double kRate = 30.0;                    // of states
constexpr double kEasyReach = 0.95;     // fraction of the arm's length from which the trunk helps
constexpr double kMeetOwnArm_s = 0.45;  // blend time to the solved arm

// Limits of healthy trunks and arms, for WarpReach.
std::array<double, kNumBodyJoints> TrunkLimits() {
  std::array<double, kNumBodyJoints> limits;
  limits.fill(120.0 * kDegree);
  for (const int spine : {3, 6, 9}) limits[spine] = 25.0 * kDegree;
  for (const int collar : {13, 14}) limits[collar] = 30.0 * kDegree;
  for (const int neck : {kNeck, kHead}) limits[neck] = 40.0 * kDegree;
  return limits;
}

Quaterniond Relative(const Matrix3d& parent, const Matrix3d& child) {
  return Quaterniond(Matrix3d(parent.transpose() * child)).normalized();
}

constexpr int kSteps = 10;  // in each direction
constexpr double kStep = 6.0 * kDegree;
constexpr double kFar = 60.0 * kDegree, kFast = 60.0 * kDegree;
constexpr double kBell_s = 0.15, kBegin_s = 0.3;
constexpr std::array<double, 4> kSwivels = {-10.0, 10.0, 30.0, 50.0};  // degrees

double Square(double x) { return x * x; }

Isometry3d Turned(const Isometry3d& pose, const Vector3d& bottom_middle, double turn) {
  const Vector3d about = pose * bottom_middle;
  Isometry3d turned = pose;
  turned.prerotate(Eigen::AngleAxisd(turn, Vector3d::UnitZ()));
  turned.translation() += about - turned * bottom_middle;
  return turned;
}

// Rotates an upright object about the vertical through its bottom center, frame by frame from
// `take` on, to keep the holding hand within the wrist's limits and comfortable; its yaw is free.
// Minimizes
//
//   (hand error / 3 degrees)^2 + (arm shortfall / 2 cm)^2 + 0.1 discomfort + (turn / 60 degrees)^2
//   + (change / (60 degrees per second))^2
//
// summed over frames, by dynamic programming (up to 60 degrees, steps of 6), then Gaussian
// smoothing of 0.15 s; zero at the take. Changes `way` (one pose per frame of `body`) in place.
void EaseTurns(const ArmIk& arm, const TakeCandidate& take, const TakeObject& object,
               std::span<const BodyPlacement> body, int take_frame, double frame_rate,
               std::vector<Isometry3d>& way) {
  const int count = static_cast<int>(way.size()) - take_frame;
  if (count < 2) return;
  const Vector3d bottom = object.BottomMiddle();
  const auto cost = [&](int t, int s) {
    const double turn = kStep * (s - kSteps);
    const ArmTarget target = arm.TargetFor(
        body[take_frame + t], take.WristFor(Turned(way[take_frame + t], bottom, turn)));
    double here = std::numeric_limits<double>::infinity();
    for (const double swivel : kSwivels) {
      const ArmChoice choice = arm.At(target, swivel * kDegree);
      here = std::min(here, Square(choice.hand_error_rad / (3.0 * kDegree)) +
                                Square(choice.shortfall_m / 0.02) +
                                0.1 * std::min(choice.discomfort, 20.0));
    }
    here += Square(turn / kFar);
    return t == 0 && s != kSteps ? here + 1e6 : here;
  };
  std::vector<double> turns;
  for (const int s :
       CheapestPath(count, 2 * kSteps + 1, Square(kStep * frame_rate / kFast), cost)) {
    turns.push_back(kStep * (s - kSteps));
  }
  const int radius = static_cast<int>(std::lround(3.0 * kBell_s * frame_rate));
  for (int t = 0; t < count; ++t) {
    double sum = 0.0, total = 0.0;
    for (int d = -radius; d <= radius; ++d) {
      const double weight = std::exp(-0.5 * Square(d / (kBell_s * frame_rate)));
      sum += weight * turns[std::clamp(t + d, 0, count - 1)];
      total += weight;
    }
    const double begin = MinimumJerk(t / (kBegin_s * frame_rate));
    way[take_frame + t] = Turned(way[take_frame + t], bottom, begin * sum / total);
  }
}

// Returns the plan's candidate, with the object's yaw if free, that best suits the body at the
// take, including the wrist's distance from its current position.
TakeCandidate ChooseTake(const TakePlan& plan, const TakeObject& object, const ArmIk& arm,
                         const BodyPlacement& body) {
  const Vector3d wrist = body.joints.col(arm.Bones().end);
  TakeCandidate best;
  bool first = true;
  for (const TakeCandidate& candidate : plan.candidates) {
    const int yaws = plan.yaw_is_free ? 72 : 1;
    for (int k = 0; k < yaws; ++k) {
      TakeCandidate tried = candidate;
      if (plan.yaw_is_free) tried.yaw_rad = 2.0 * std::numbers::pi * k / yaws;
      const Isometry3d stands = object.Upright(plan.places.front(), tried.yaw_rad);
      ScoreTake(arm, body.joints.col(arm.Bones().root), body.rotation[kSpine3], stands,
                plan.places.front().z(), tried);
      tried.score -= 2.0 * (tried.WristFor(stands).translation() - wrist).norm();
      if (first || tried.Beats(best)) best = tried;
      first = false;
    }
  }
  return best;
}

// Returns the most comfortable yaw of the object at `place` for a body that holds it by `take`; of
// equal ones the first from `usual_yaw` (radians) on.
UprightPose ComfortableAt(const ArmIk& arm, const TakeCandidate& take, const TakeObject& object,
                          const Vector3d& place, const BodyPlacement& body, double usual_yaw) {
  UprightPose best;
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 72; ++k) {
    const double yaw = usual_yaw + 2.0 * std::numbers::pi * k / 72;
    const Isometry3d pose = object.Upright(place, yaw);
    const ArmChoice choice = arm.Best(arm.TargetFor(body, take.WristFor(pose)));
    const double cost = choice.discomfort + 30.0 * choice.shortfall_m;
    if (cost < least) {
      least = cost;
      best = {pose.translation(), yaw};
    }
  }
  return best;
}

class TakeMotionBuilder {
 public:
  TakeMotionBuilder(const TakePlan& plan, const TakeBodyMotion& motion, const HandModel& hand,
                    const TakeObject& object, const Clip& like)
      : plan_(plan),
        motion_(motion),
        hand_(hand),
        object_(object),
        rest_joints_(hand.Surface().RestJoints()),
        arm_(rest_joints_, plan.side),
        clip_(wandr::ClipOfStates(motion.states, like)),
        frames_(BodyFrames(clip_, rest_joints_)) {}

  TakeMotion Build() {
    TakeMotion made;
    if (static_cast<int>(motion_.frames.size()) != static_cast<int>(plan_.goals.size()) ||
        std::ranges::any_of(motion_.frames, [](int frame) { return frame < 0; })) {
      made.fault = "the body does not reach every position";
      made.score = -1e3;
      return made;
    }
    reached_ = motion_.frames;
    GiveTime(rest_joints_, arm_.Bones().root, reached_.front(), kRate, frames_, reached_);
    body_ = Place(rest_joints_, frames_);
    made.take = ChooseTake(plan_, object_, arm_, body_[reached_.front()]);
    const Isometry3d stands = object_.Upright(plan_.places.front(), made.take.yaw_rad);
    made.standing = {stands.translation(), made.take.yaw_rad};
    const Isometry3d grasp = made.take.WristFor(stands);
    try {
      made.times = TimesOfTake(body_, reached_, grasp.translation() + Retreat(made.take),
                               grasp.translation(), arm_, kRate);
    } catch (const Error& error) {
      made.fault = error.what();
      made.score = -1e3;
      return made;
    }
    const TakeTimes& times = made.times;
    made.shoulder_shortfall_m = std::max(
        0.0, (grasp.translation() - body_[times.take].joints.col(arm_.Bones().root)).norm() -
                 arm_.Length());
    Lean((times.arrive + times.take) / 2, grasp.translation(), 0);
    const std::vector<UprightPose> at_goals = Bring(made.take, times);

    const std::vector<Isometry3d> carry_frames = CarryFrames(body_, kRate);
    const UprightPose carry = Carry(made.take, times, carry_frames);
    std::vector<Isometry3d> way = EasiestWay(made, carry, at_goals, carry_frames);
    EaseTurns(arm_, made.take, object_, body_, times.take, kRate, way);
    ComeAround(made, grasp);
    MoveArm(made, grasp, way);
    Look(made);
    Finish(made);
    return made;
  }

 private:
  // Moves trunk and legs to help the wrist to `goal` at `frame` if the arm is short; frames near
  // the previous and next places are unchanged.
  void Lean(int frame, const Vector3d& goal, std::size_t which) {
    const int count = static_cast<int>(frames_.size());
    const Vector3d shoulder = body_[frame].joints.col(arm_.Bones().root);
    if ((goal - shoulder).norm() < kEasyReach * arm_.Length()) return;
    ReachWarp warp;
    warp.goal = goal;
    warp.frame = frame;
    warp.wrist = plan_.side;
    warp.begin = std::max(0, frame - kWarpReach);
    warp.end = std::min(count, frame + kWarpReach);
    if (which > 0) warp.begin = std::max(warp.begin, reached_[which - 1] + 12);
    if (which + 1 < reached_.size()) warp.end = std::min(warp.end, reached_[which + 1] - 12);
    if (frame - warp.begin < kWarpMargin || warp.end - 1 - frame < kWarpMargin) return;
    ReachWarpOptions options;
    options.joint_limits = TrunkLimits();
    WarpReach(rest_joints_, FeetOf(body_), warp, options, frames_);
    body_ = Place(rest_joints_, frames_);
  }

  // Object poses at the target places; the trunk helps if the arm is short.
  std::vector<UprightPose> Bring(const TakeCandidate& take, const TakeTimes& times) {
    std::vector<UprightPose> at_goals;
    for (std::size_t g = 0; g < times.goals.size(); ++g) {
      const Vector3d place = plan_.places[g + 1];
      const int at = times.goals[g];
      UprightPose pose = ComfortableAt(arm_, take, object_, place, body_[at], take.yaw_rad);
      const Vector3d wrist = take.WristFor(pose.Transform()).translation();
      Lean(at, wrist, g + 1);
      pose = ComfortableAt(arm_, take, object_, place, body_[at], pose.yaw_rad);
      at_goals.push_back(pose);
    }
    return at_goals;
  }

  UprightPose Carry(const TakeCandidate& take, const TakeTimes& times,
                    const std::vector<Isometry3d>& carry_frames) const {
    const int end = times.goals.empty() ? static_cast<int>(frames_.size()) - 1 : times.goals.back();
    std::vector<int> sampled;
    for (int k = 1; k <= 4; ++k) sampled.push_back(times.take + k * (end - times.take) / 5);
    return ComfortableCarry(arm_, take, object_, body_, carry_frames, times.take, sampled);
  }

  // The object's path at the pace of least shortfall and hand error.
  std::vector<Isometry3d> EasiestWay(const TakeMotion& made, const UprightPose& carry,
                                     const std::vector<UprightPose>& at_goals,
                                     const std::vector<Isometry3d>& carry_frames) const {
    std::vector<Isometry3d> best;
    double least = std::numeric_limits<double>::infinity();
    for (const auto& [leave, follow] :
         {std::pair(0.25, 0.9), std::pair(0.15, 0.7), std::pair(0.1, 0.5), std::pair(0.3, 1.3)}) {
      for (const double bring : {0.9, 1.3, 0.65, 0.45}) {
        std::vector<Isometry3d> way = ObjectWay(made.times, made.standing, carry, at_goals,
                                                carry_frames, kRate, leave, follow, bring);
        double cost = 0.0;
        for (int t = made.times.take; t < static_cast<int>(way.size()); t += 2) {
          const ArmTarget target = arm_.TargetFor(body_[t], made.take.WristFor(way[t]));
          double here = std::numeric_limits<double>::infinity();
          for (const double swivel : {-10.0, 10.0, 30.0, 50.0}) {
            const ArmChoice choice = arm_.At(target, swivel * kDegree);
            here = std::min(here, std::pow(choice.shortfall_m / 0.02, 2) +
                                      std::pow(choice.hand_error_rad / (3.0 * kDegree), 2) +
                                      0.02 * choice.discomfort);
          }
          cost += here;
        }
        if (cost < least) {
          least = cost;
          best = std::move(way);
        }
      }
    }
    return best;
  }

  static Vector3d Retreat(const TakeCandidate& take) {
    return Eigen::AngleAxisd(take.yaw_rad, Vector3d::UnitZ()) * take.approach.retreat *
           take.approach.standoff_m;
  }

  // Target wrist pose before the take: from the motion's own arm onto the approach line, and along
  // it.
  Isometry3d OnTheWay(int t, const TakeMotion& made, const Isometry3d& grasp) const {
    const TakeTimes& times = made.times;
    const auto share = [&](int from, int to) {
      return MinimumJerk(static_cast<double>(t - from) / std::max(1, to - from));
    };
    const Vector3d retreat = Retreat(made.take);
    const double onto = share(times.begin, times.pregrasp);
    // Start along the line while still moving onto it, so that the hand does not stop there.
    const double along = share(times.pregrasp - 5, times.arrive);
    const Isometry3d own = body_[t].WorldFromJoint(arm_.Bones().end);
    return RigidTransform(
        Quaterniond(own.linear()).slerp(onto, Quaterniond(grasp.linear())).matrix(),
        grasp.translation() + (1.0 - along) * retreat +
            (1.0 - onto) * (own.translation() - grasp.translation() - retreat) +
            4.0 * onto * (1.0 - onto) * around_);
  }

  // The straight path to the line may cross the object: find the smallest detour that does not.
  void ComeAround(const TakeMotion& made, const Isometry3d& grasp) {
    HandEvaluation hand = AtWrist(hand_);
    const Isometry3d object_from_world = made.standing.Transform().inverse();
    const Vector3d back = Retreat(made.take).normalized();
    const FingerPose relaxed = RelaxedFingers(rest_joints_, plan_.side);
    double least = std::numeric_limits<double>::infinity();
    Vector3d best = Vector3d::Zero();
    for (const double by : {0.0, 0.06, 0.12, 0.18}) {
      for (const Vector3d& way :
           {Vector3d(Vector3d::UnitZ()), back, Vector3d((back + Vector3d::UnitZ()).normalized())}) {
        around_ = by * way;
        double deepest = 0.0;
        for (int t = made.times.begin; t < made.times.arrive; t += 2) {
          const FingerPose fingers = FingersAt(t, made, relaxed);
          const Isometry3d object_from_wrist = object_from_world * OnTheWay(t, made, grasp);
          const Eigen::Matrix3Xd& skin = hand.At(fingers.data(), false).Vertices();
          for (Eigen::Index i = 0; i < skin.cols(); i += 2) {
            const Vector3d p = object_from_wrist * skin.col(i);
            if ((p.array() < object_.distance.Min().array()).any() ||
                (p.array() > object_.distance.Max().array()).any()) {
              continue;
            }
            deepest = std::max(deepest, -object_.distance.Distance(p));
          }
        }
        const double cost = 1000.0 * deepest + 10.0 * by;
        if (cost < least) {
          least = cost;
          best = around_;
        }
      }
    }
    around_ = best;
  }

  // Relaxed, ready, closed.
  FingerPose FingersAt(int t, const TakeMotion& made, const FingerPose& relaxed) const {
    const TakeTimes& times = made.times;
    const double ready = MinimumJerk(static_cast<double>(t - times.begin) /
                                     std::max(1, times.pregrasp - times.begin));
    const double closed =
        MinimumJerk(static_cast<double>(t - times.arrive) / std::max(1, times.take - times.arrive));
    return relaxed +
           ready * (ClosingFingers(made.take.approach, made.take.grasp, closed) - relaxed);
  }

  void MoveArm(TakeMotion& made, const Isometry3d& grasp, const std::vector<Isometry3d>& way) {
    const TakeTimes& times = made.times;
    const int count = static_cast<int>(frames_.size());
    const Limb& limb = arm_.Bones();
    std::vector<ArmTarget> targets;
    for (int t = times.begin; t < count; ++t) {
      const Isometry3d wrist = t < times.arrive  ? OnTheWay(t, made, grasp)
                               : t <= times.take ? grasp
                                                 : made.take.WristFor(way[t]);
      targets.push_back(arm_.TargetFor(body_[t], wrist));
    }
    const std::vector<double> swivels = arm_.Track(targets, kRate);
    made.hand_error_rad.assign(frames_.size(), 0.0);
    made.shortfall_m.assign(frames_.size(), 0.0);
    for (int t = times.begin; t < count; ++t) {
      const std::size_t k = static_cast<std::size_t>(t - times.begin);
      const ArmChoice choice = arm_.At(targets[k], swivels[k]);
      made.hand_error_rad[t] = choice.hand_error_rad;
      made.shortfall_m[t] = choice.shortfall_m;
      BodyFrame& frame = frames_[t];
      const double share = MinimumJerk((t - times.begin) / (kMeetOwnArm_s * kRate));
      const Matrix3d& collar = body_[t].rotation[limb.root - 3];
      const std::array<std::pair<int, Quaterniond>, 3> turns = {
          std::pair(limb.root, Relative(collar, choice.limb.upper)),
          std::pair(limb.middle, Relative(choice.limb.upper, choice.wrist.lower)),
          std::pair(limb.end, Quaterniond(choice.wrist.wrist).normalized())};
      for (const auto& [joint, turn] : turns) {
        frame.local[joint] = frame.local[joint].slerp(share, turn);
      }
      if (t >= times.pregrasp && t <= times.take) {
        made.coming_shortfall_m = std::max(made.coming_shortfall_m, choice.shortfall_m);
        made.coming_hand_error_rad = std::max(made.coming_hand_error_rad, choice.hand_error_rad);
      }
      if (t == times.take) {
        const Isometry3d is = Place(rest_joints_, frame).WorldFromJoint(limb.end);
        made.take_wrist_error_m = (is.translation() - grasp.translation()).norm();
        made.take_hand_error_rad = AngleBetween(is.linear(), grasp.linear());
      } else if (t > times.take) {
        made.max_shortfall_m = std::max(made.max_shortfall_m, choice.shortfall_m);
        made.max_hand_error_rad = std::max(made.max_hand_error_rad, choice.hand_error_rad);
      }
    }
  }

  // Turns neck and head to the object while reaching, and briefly afterwards.
  void Look(const TakeMotion& made) {
    const Vector3d at = plan_.places.front();
    const int count = static_cast<int>(frames_.size());
    const int from = std::max(0, made.times.begin - 12), to = made.times.take + 24;
    for (int t = from; t < std::min(to, count); ++t) {
      const double share = MinimumJerk((t - from) / 18.0) * MinimumJerk((to - t) / 18.0);
      const BodyPlacement placed = Place(rest_joints_, frames_[t]);
      const Vector3d face = placed.rotation[kHead].col(2);
      const Vector3d eyes =
          placed.joints.col(kHead) + 0.07 * placed.rotation[kHead].col(1) + 0.08 * face;
      const Quaterniond turn = RotationBetween(face, at - eyes);
      Vector3d angle = LogSO3(turn.matrix());
      // Heads rotate most of the way, eyes the rest, within the neck's range.
      const double wanted = 0.7 * angle.norm(), limit = 40.0 * kDegree;
      if (wanted < 1e-6) continue;
      angle *= share * limit * std::tanh(wanted / limit) / angle.norm();
      for (const int joint : {kNeck, kHead}) {
        // Half each, in the world.
        const Matrix3d parent = placed.rotation[kJointParents[joint]];
        const Matrix3d half = ExpSO3(0.5 * angle);
        frames_[t].local[joint] =
            Quaterniond(Matrix3d(parent.transpose() * half * parent)) * frames_[t].local[joint];
      }
    }
  }

  void Finish(TakeMotion& made) {
    const TakeTimes& times = made.times;
    const int count = static_cast<int>(frames_.size());
    const Clip like = clip_;
    JointPose hands = JointPose::Zero();
    const FingerPose relaxed = RelaxedFingers(rest_joints_, plan_.side);
    SetFingers(hands, OtherSide(plan_.side), RelaxedFingers(rest_joints_, OtherSide(plan_.side)));
    const Clip moved = ToClip(frames_, kRate, rest_joints_, hands);
    made.clip = like;
    made.clip.pose = moved.pose;
    made.clip.trans = moved.trans;
    made.clip.object.emplace();
    made.clip.object->trans.resize(3, count);
    made.clip.object->orient.resize(3, count);
    made.clip.holding_hand.assign(static_cast<std::size_t>(count), 0);
    // The actual hold: the grasp, except where the wrist's limits prevented it.
    const Isometry3d hand_from_object =
        Place(rest_joints_, frames_[times.take]).WorldFromJoint(arm_.Bones().end).inverse() *
        made.standing.Transform();
    made.clip.object->orient.col(0) = LogSO3(made.standing.Transform().linear());
    for (int t = 0; t < count; ++t) {
      SetFingers(made.clip.pose[t], plan_.side, FingersAt(t, made, relaxed));
      Isometry3d pose = made.standing.Transform();
      if (t > times.take) {
        pose = Place(rest_joints_, frames_[t]).WorldFromJoint(arm_.Bones().end) * hand_from_object;
      }
      if (t >= times.take) made.clip.holding_hand[t] = HoldingBit(plan_.side);
      made.clip.object->SetPose(t, pose);
    }
    if (made.take.fault.size() > 0) {
      made.fault = made.take.fault;
    } else if (made.take_wrist_error_m > 0.005) {
      made.fault =
          fmt::format("the hand stays {:.0f} mm from the object", 1000.0 * made.take_wrist_error_m);
    }
    made.score = made.take.score - 200.0 * made.take_wrist_error_m -
                 5.0 * made.take_hand_error_rad - 10.0 * made.max_shortfall_m -
                 2.0 * made.max_hand_error_rad - 30.0 * made.coming_shortfall_m -
                 5.0 * made.coming_hand_error_rad - (made.fault.empty() ? 0.0 : 100.0);
  }

  const TakePlan& plan_;
  const TakeBodyMotion& motion_;
  const HandModel& hand_;
  const TakeObject& object_;
  Eigen::Matrix3Xd rest_joints_;
  ArmIk arm_;
  Clip clip_;
  std::vector<BodyFrame> frames_;
  Vector3d around_ = Vector3d::Zero();  // detour around the object on the way to the line
  std::vector<int> reached_;            // frames at which the body is at the places
  std::vector<BodyPlacement> body_;
};

}  // namespace

TakeMotion MakeTakeMotion(const TakePlan& plan, const TakeBodyMotion& motion, const HandModel& hand,
                          const TakeObject& object, const Clip& like) {
  return TakeMotionBuilder(plan, motion, hand, object, like).Build();
}

}  // namespace holdfast
