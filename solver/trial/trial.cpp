// SPDX-License-Identifier: MIT
#include "solver/trial/trial.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "geometry/parallel.h"
#include "geometry/rotation.h"
#include "solver/hand/hand_landmarks.h"

namespace holdfast {
namespace {

constexpr std::array<std::string_view, kTrialDirections> kDirectionNames = {"+x", "-x", "+y",
                                                                            "-y", "+z", "-z"};

FingerPose FingersOf(const std::vector<Eigen::Quaterniond>& joints) {
  FingerPose fingers = FingerPose::Zero();
  for (std::size_t j = 0; j < joints.size() && j < kJointsPerHand; ++j) {
    fingers.segment<3>(3 * static_cast<int>(j)) = LogSO3(joints[j].toRotationMatrix());
  }
  return fingers;
}

std::vector<Eigen::Quaterniond> JointsOf(const FingerPose& fingers) {
  std::vector<Eigen::Quaterniond> joints;
  for (int j = 0; j < kJointsPerHand; ++j) {
    joints.emplace_back(ExpSO3(fingers.segment<3>(3 * j)));
  }
  return joints;
}

// Runs for `frames` frames of the recording; `prepare` advances each.
template <typename Prepare>
TrialCourse Follow(TrialRun& run, int frames, const Eigen::Vector3d& center,
                   const TrialProtocol& protocol, const Prepare& prepare) {
  TrialCourse course;
  const auto record = [&] {
    course.hand_from_object.push_back(run.HandFromObject());
    course.fingers.push_back(FingersOf(run.Joints()));
    const Eigen::Isometry3d &now = course.hand_from_object.back(),
                            &first = course.hand_from_object.front();
    course.slip_mm = 1e3 * (now * center - first * center).norm();
    course.slip_deg = AngleBetween(now.linear(), first.linear()) / kDegree;
    course.most_slip_mm = std::max(course.most_slip_mm, course.slip_mm);
    course.most_slip_deg = std::max(course.most_slip_deg, course.slip_deg);
  };
  record();
  for (int k = 0; k < frames && !run.Unstable(); ++k) {
    prepare(k);
    record();
  }
  course.touches = run.Touching() > 0;
  course.stable = !run.Unstable();
  course.holds = course.stable && course.touches && course.most_slip_mm < protocol.most_mm &&
                 course.most_slip_deg < protocol.most_deg;
  return course;
}

TrialCourse FollowField(TrialRun& run, double seconds, const FrameMotion& motion,
                        const Eigen::Vector3d& center, const TrialProtocol& protocol) {
  const int frames = std::max(1, static_cast<int>(std::lround(seconds * protocol.frame_rate)));
  return Follow(run, frames, center, protocol,
                [&](int) { run.Advance(1.0 / protocol.frame_rate, motion); });
}

// Inertial motion of the wrist as felt by the object in the wrist's frame, by second differences;
// engine steps between two frames use a linear blend.
std::vector<FrameMotion> FrameMotions(const HandMotion& hand, double gravity) {
  const int count = static_cast<int>(hand.world_from_wrist.size());
  const double rate = hand.frame_rate;
  const auto at = [&](int t) -> const Eigen::Isometry3d& {
    return hand.world_from_wrist[static_cast<std::size_t>(std::clamp(t, 0, count - 1))];
  };
  std::vector<FrameMotion> motions(static_cast<std::size_t>(count));
  for (int t = 0; t < count; ++t) {
    FrameMotion& motion = motions[static_cast<std::size_t>(t)];
    const Eigen::Matrix3d wrist_from_world = at(t).linear().transpose();
    const Eigen::Vector3d after = LogSO3(at(t + 1).linear() * at(t).linear().transpose());
    const Eigen::Vector3d before = LogSO3(at(t).linear() * at(t - 1).linear().transpose());
    const bool inside = t > 0 && t + 1 < count;
    Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
    if (inside) {
      acceleration =
          rate * rate *
          (at(t + 1).translation() - 2.0 * at(t).translation() + at(t - 1).translation());
      motion.turn_rate = wrist_from_world * (rate * rate * (after - before));
    }
    motion.turning = wrist_from_world * (rate * (inside ? 0.5 : 1.0) * (after + before));
    motion.field = wrist_from_world * (-gravity * Eigen::Vector3d::UnitZ() - acceleration);
  }
  return motions;
}

FrameMotion Blend(const FrameMotion& a, const FrameMotion& b, double s) {
  return {(1.0 - s) * a.field + s * b.field, (1.0 - s) * a.turning + s * b.turning,
          (1.0 - s) * a.turn_rate + s * b.turn_rate};
}

// Starts from the settled state and follows the motion frame by frame.
TrialCourse FollowClip(TrialRun run, const HandMotion& hand, const Eigen::Vector3d& center,
                       const TrialProtocol& protocol) {
  constexpr int kParts = 4;  // per frame, each with constant motion
  const std::vector<FrameMotion> motions = FrameMotions(hand, protocol.gravity_m_s2);
  const int frames = static_cast<int>(motions.size()) - 1;
  return Follow(run, frames, center, protocol, [&](int t) {
    const auto k = static_cast<std::size_t>(t);
    const std::vector<Eigen::Quaterniond> from = JointsOf(hand.fingers[k]);
    const std::vector<Eigen::Quaterniond> to = JointsOf(hand.fingers[k + 1]);
    for (int part = 0; part < kParts; ++part) {
      const double s = (part + 0.5) / kParts;
      std::vector<Eigen::Quaterniond> targets;
      for (std::size_t j = 0; j < to.size(); ++j) targets.push_back(from[j].slerp(s, to[j]));
      run.SetTargets(targets);
      run.Advance(1.0 / (hand.frame_rate * kParts), Blend(motions[k], motions[k + 1], s));
    }
  });
}

}  // namespace

std::string_view TrialDirectionName(int direction) {
  return kDirectionNames[static_cast<std::size_t>(direction)];
}

Eigen::Vector3d TrialDirection(int direction) {
  return (direction % 2 == 0 ? 1.0 : -1.0) * Eigen::Vector3d::Unit(direction / 2);
}

TrialSolid MakeTrialSolid(const TriangleMesh& mesh, const SignedDistance& distance,
                          const TrialProtocol& protocol) {
  ConvexPieceOptions piece_options = protocol.pieces;
  piece_options.threads = protocol.threads;
  ConvexPieces split = SplitIntoConvexPieces(mesh, piece_options);
  TrialSolid solid;
  solid.pieces = std::move(split.pieces);
  solid.excess_mm = 1e3 * split.excess_m;
  solid.mass_of_pieces = !distance.IsWatertight() || SignedVolume(mesh) <= 0.0;
  solid.mass =
      MassOfSolids(solid.mass_of_pieces ? solid.pieces : std::vector{mesh}, protocol.density_kg_m3);
  const double wanted =
      std::clamp(solid.mass.mass_kg, protocol.least_mass_kg, protocol.most_mass_kg);
  solid.mass.inertia *= wanted / solid.mass.mass_kg;
  solid.mass.mass_kg = wanted;
  solid.radius_m = (mesh.vertices.colwise() - solid.mass.center).colwise().norm().maxCoeff();
  return solid;
}

int HoldTrial::Held() const {
  return static_cast<int>(std::ranges::count(directions, true, &TrialCourse::holds));
}

double HoldTrial::WorstSlip_mm() const {
  return std::ranges::max(directions, {}, &TrialCourse::slip_mm).slip_mm;
}

double HoldTrial::WorstSlip_deg() const {
  return std::ranges::max(directions, {}, &TrialCourse::slip_deg).slip_deg;
}

HoldTrial TryHold(const std::vector<MjcfLink>& links, const std::vector<GripContact>& contacts,
                  const TrialSolid& solid, const Eigen::Isometry3d& hand_from_object,
                  const TrialProtocol& protocol, const HandMotion* motion) {
  const TrialScene scene(links, contacts, solid.pieces, solid.mass, hand_from_object,
                         protocol.scene);
  HoldTrial trial;
  trial.mass_kg = solid.mass.mass_kg;
  for (const GripContact& contact : contacts) {
    const double push = contact.press.dot(contact.into);
    if (push <= 0.0) continue;
    trial.grip_N += push;
    ++trial.pressing;
  }
  TrialRun settled(scene);
  const Eigen::Vector3d& center = solid.mass.center;
  FrameMotion slow;
  slow.drag_per_s = protocol.settle_drag_per_s;
  trial.settling = FollowField(settled, protocol.settle_s, slow, center, protocol);
  if (motion != nullptr) trial.clip.emplace();
  ParallelFor(kTrialDirections + (motion != nullptr ? 1 : 0), protocol.threads, [&](int k) {
    if (k == kTrialDirections) {
      trial.clip = FollowClip(settled, *motion, center, protocol);
      trial.clip->holds = trial.clip->holds && trial.settling.holds;
      return;
    }
    TrialRun run(settled);
    TrialCourse& course = trial.directions[static_cast<std::size_t>(k)];
    FrameMotion still;
    still.field = protocol.gravity_m_s2 * (hand_from_object.linear() * TrialDirection(k));
    course = FollowField(run, protocol.hold_s, still, center, protocol);
    course.holds = course.holds && trial.settling.holds;
  });
  return trial;
}

std::vector<GripContact> PressesOfHand(const HandState& state,
                                       const Eigen::Isometry3d& world_from_object,
                                       const TrialSolid& solid, const SignedDistance& distance,
                                       const TrialProtocol& protocol) {
  const Eigen::Isometry3d wrist_from_object = state.WorldFromWrist().inverse() * world_from_object;
  std::vector<GripContact> contacts =
      ContactsOfHand(state, world_from_object, distance, protocol.touch_m);
  BalancePresses(wrist_from_object * solid.mass.center, solid.radius_m, protocol.scene.friction,
                 std::max(protocol.least_grip_N,
                          protocol.grip_weights * solid.mass.mass_kg * protocol.gravity_m_s2),
                 contacts);
  return contacts;
}

HoldTrial TryHold(const HandState& state, const Eigen::Isometry3d& world_from_object,
                  const TrialSolid& solid, const SignedDistance& distance,
                  const TrialProtocol& protocol, const HandMotion* motion) {
  RequirePhysics();
  const Eigen::Isometry3d wrist_from_object = state.WorldFromWrist().inverse() * world_from_object;
  const std::vector<GripContact> contacts =
      PressesOfHand(state, world_from_object, solid, distance, protocol);
  return TryHold(LinksOfHand(state, protocol.fingers), contacts, solid, wrist_from_object, protocol,
                 motion);
}

std::vector<HoldTrial> TryGrasps(const HandModel& hand, const TriangleMesh& object,
                                 std::span<const CertifiedGrasp> grasps,
                                 const TrialProtocol& protocol,
                                 const std::function<bool(double)>& progress) {
  RequirePhysics();
  const SignedDistance distance(object);
  const TrialSolid solid = MakeTrialSolid(object, distance, protocol);
  const HandEvaluation at_wrist = AtWrist(hand);
  TrialProtocol of_each = protocol;
  of_each.threads = 1;
  const auto count = static_cast<int>(grasps.size());
  std::vector<HoldTrial> trials(grasps.size());
  std::mutex mutex;
  int done = 0;
  bool stopped = false;
  ParallelFor(count, protocol.threads, [&](int i) {
    {
      const std::lock_guard lock(mutex);
      if (stopped) return;
    }
    const Grasp& grasp = grasps[static_cast<std::size_t>(i)].grasp;
    HandEvaluation evaluation = at_wrist;
    trials[static_cast<std::size_t>(i)] =
        TryHold(evaluation.At(grasp.fingers), grasp.wrist_from_object, solid, distance, of_each);
    const std::lock_guard lock(mutex);
    ++done;
    stopped = stopped || (progress && !progress(static_cast<double>(done) / count));
  });
  return trials;
}

}  // namespace holdfast
