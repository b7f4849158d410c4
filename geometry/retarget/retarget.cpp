// SPDX-License-Identifier: MIT
#include "geometry/retarget/retarget.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/retarget/ground_contact.h"
#include "geometry/retarget/retarget_calibration.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

using Rotations = std::array<Eigen::Matrix3d, kNumJoints>;
using Joints = Eigen::Matrix<double, 3, kNumJoints>;

// Fraction of the hand's roll applied at the elbow joint: all of it at the wrist would twist the
// skin.
constexpr double kForearmTwistShare = 0.5;
constexpr double kForearmRoll = 110 * kDegree;  // maximum roll of a hand relative to its upper arm
// Fraction of a shoulder's shift applied to the collarbone. SMPL-X's shoulders rest lower below the
// neck than those of most capture skeletons, so the full shift would let them slump.
constexpr double kShoulderShare = 0.75;
constexpr double kWristBend = 105 * kDegree;  // anatomical limit is near 90
constexpr double kWristRoll = 135 * kDegree;  // maximum roll relative to the elbow

// Joint positions of a body for world rotations of its joints, pelvis at its rest position + trans.
Joints PlaceJoints(const Eigen::Matrix3Xd& rest, const Rotations& world,
                   const Eigen::Vector3d& trans) {
  Joints joints;
  joints.col(0) = rest.col(0) + trans;
  for (int j = 1; j < kNumJoints; ++j) {
    const int parent = kJointParents[j];
    joints.col(j) = joints.col(parent) + world[parent] * (rest.col(j) - rest.col(parent));
  }
  return joints;
}

class Retargeter {
 public:
  Retargeter(const MappedMotion& motion, const RetargetBody& body)
      : motion_(motion),
        body_(body),
        rest_(body.rest_joints),
        calibration_(Calibrate(motion, body)) {
    if (!calibration_.same_skeleton) GatherHands();
  }

  const RetargetCalibration& Calibration() const { return calibration_; }

  struct Pose {
    Rotations world;        // y-up
    Eigen::Vector3d trans;  // y-up
  };

  int RepairedHandFrames() const { return repaired_hand_frames_; }

  Pose Solve(int frame) const {
    Pose pose;
    pose.world.fill(Eigen::Matrix3d::Identity());
    if (calibration_.same_skeleton) {
      Copy(frame, pose.world);
    } else {
      Torso(frame, pose.world);
      for (const int hip : {1, 2}) Leg(frame, hip, pose.world);
      for (const int shoulder : {16, 17}) Arm(frame, shoulder, pose.world);
    }
    PlaceRoot(frame, pose);
    if (!calibration_.same_skeleton) {
      for (const int hip : {1, 2}) ReachAnkle(frame, hip, pose);
    }
    return pose;
  }

 private:
  Eigen::Matrix3d Turned(int frame, int joint) const {
    return motion_.Rotation(frame, joint) * calibration_.source_from_smplx[joint];
  }
  Eigen::Vector3d RestBone(int from, int to) const { return rest_.col(to) - rest_.col(from); }
  Eigen::Vector3d Bone(int frame, int from, int to) const {
    return motion_.Position(frame, to) - motion_.Position(frame, from);
  }
  // Rotates `R` by the smallest angle so that the rest bone points along `direction`.
  static Eigen::Matrix3d Aim(const Eigen::Matrix3d& R, const Eigen::Vector3d& rest_bone,
                             const Eigen::Vector3d& direction) {
    if (direction.squaredNorm() < 1e-18) return R;
    return LeastRotation(R * rest_bone, direction) * R;
  }

  void Copy(int frame, Rotations& world) const {
    for (int j = 0; j < kNumJoints; ++j) {
      if (motion_.Has(j)) {
        world[j] = motion_.Rotation(frame, j);
      } else {
        world[j] = world[kJointParents[j]] * RelaxedFinger(j);
      }
    }
  }

  Eigen::Matrix3d RelaxedFinger(int joint) const {
    if (joint < kLeftHandBegin) return Eigen::Matrix3d::Identity();
    const bool right = joint >= kRightHandBegin;
    const auto& hand = right ? body_.right_hand : body_.left_hand;
    return ExpSO3(hand.segment<3>(3 * (joint - (right ? kRightHandBegin : kLeftHandBegin))));
  }

  void Torso(int frame, Rotations& world) const {
    if (calibration_.shaped_like_smplx) return ShapedTorso(frame, world);
    world[0] = Turned(frame, 0);
    // Spine joints that the source lacks, or whose neutral pose is unknown, share the bend evenly.
    const bool own = calibration_.torso_rests_upright;
    int chest = motion_.Has(9) ? 9 : motion_.Has(6) ? 6 : motion_.Has(3) ? 3 : -1;
    const Eigen::Matrix3d top = chest < 0 ? world[0] : Turned(frame, chest);
    const Eigen::Vector3d bend = LogSO3(world[0].transpose() * top);
    for (const auto& [joint, share] : {std::pair{3, 1.0 / 3}, {6, 2.0 / 3}, {9, 1.0}}) {
      world[joint] =
          own && motion_.Has(joint) ? Turned(frame, joint) : world[0] * ExpSO3(share * bend);
    }
    const Eigen::Matrix3d head = motion_.Has(15)   ? Turned(frame, 15)
                                 : motion_.Has(12) ? Turned(frame, 12)
                                                   : world[9];
    const bool neck = motion_.Has(12) && calibration_.neck_rests_with_head;
    world[12] = neck
                    ? Turned(frame, 12)
                    : Eigen::Matrix3d(world[9] * ExpSO3(0.5 * LogSO3(world[9].transpose() * head)));
    if (!own && motion_.Has(12) && motion_.Has(15)) {
      world[12] = Aim(world[12], RestBone(12, 15), Bone(frame, 12, 15));
    }
    world[15] = head;
    for (const int j : {22, 23, 24}) world[j] = head;
    for (const int collar : {13, 14}) Collar(frame, collar, world);
  }

  void ShapedTorso(int frame, Rotations& world) const {
    for (const int j : {0, 9, 15}) world[j] = Turned(frame, j);
    for (const auto& [joint, child] : {std::pair{3, 6}, {6, 9}, {12, 15}, {13, 16}, {14, 17}}) {
      world[joint] = Aim(Turned(frame, joint), RestBone(joint, child), Bone(frame, joint, child));
    }
    for (const int j : {22, 23, 24}) world[j] = world[15];
  }

  // Collarbones start at different positions in each skeleton, so only the displacement of the
  // shoulder from its neutral position in the chest is used.
  void Collar(int frame, int collar, Rotations& world) const {
    const int shoulder = collar + 3;
    world[collar] = world[9];
    if (!motion_.Has(9)) return;
    const Eigen::Matrix3d to_chest = world[9].transpose();
    Eigen::Vector3d neutral = calibration_.shoulder_at_rest[collar - 13];
    if (!calibration_.torso_rests_upright) {
      if (!motion_.Has(12)) return;
      // No known neutral pose: use the position of SMPL-X's shoulder relative to the neck.
      const Eigen::Vector3d neck = Bone(frame, 9, 12);
      neutral = to_chest * neck + neck.norm() / RestBone(9, 12).norm() * RestBone(12, shoulder);
    }
    const Eigen::Vector3d moved =
        kShoulderShare * calibration_.scale * (to_chest * Bone(frame, 9, shoulder) - neutral);
    world[collar] =
        Aim(world[9], RestBone(collar, shoulder), world[9] * (RestBone(collar, shoulder) + moved));
  }

  void Leg(int frame, int hip, Rotations& world) const {
    const int knee = hip + 3, ankle = hip + 6, foot = hip + 9;
    world[hip] = Aim(Turned(frame, hip), RestBone(hip, knee), Bone(frame, hip, knee));
    world[knee] = BendHinge(knee, world[hip], RestBone(knee, ankle), Bone(frame, knee, ankle));
    world[ankle] = Turned(frame, ankle);
    world[foot] = motion_.Has(foot) ? Turned(frame, foot) : world[ankle];
  }

  // World rotations of the upper arm, and of the forearm with the elbow bent, without roll.
  std::pair<Eigen::Matrix3d, Eigen::Matrix3d> SolveArm(int frame, int shoulder) const {
    const int elbow = shoulder + 2, wrist = shoulder + 4;
    Eigen::Matrix3d upper =
        Aim(Turned(frame, shoulder), RestBone(shoulder, elbow), Bone(frame, shoulder, elbow));
    const auto bend_elbow = [&] {
      return BendHinge(elbow, upper, RestBone(elbow, wrist), Bone(frame, elbow, wrist));
    };
    const Eigen::Matrix3d unwrung = bend_elbow();
    // The elbow of a straight arm is undetermined, and captures let the upper arm spin: roll beyond
    // the forearm's range is applied to the upper arm. Continuous across half a turn, where the
    // correction is half a turn in either direction.
    const double straight =
        Bone(frame, shoulder, elbow).normalized().dot(Bone(frame, elbow, wrist).normalized());
    const double share = std::clamp(
        (straight - std::cos(45 * kDegree)) / (std::cos(20 * kDegree) - std::cos(45 * kDegree)),
        0.0, 1.0);
    const double twist =
        TwistAngle(unwrung.transpose() * Turned(frame, wrist), RestBone(elbow, wrist).normalized());
    const double excess = twist - FoldedTwist(twist);
    if (!(share > 0) || excess == 0) return {upper, unwrung};
    upper = upper * ExpSO3(share * excess * RestBone(shoulder, elbow).normalized());
    return {upper, bend_elbow()};
  }

  void Arm(int frame, int shoulder, Rotations& world) const {
    const int elbow = shoulder + 2, wrist = shoulder + 4;
    const auto [upper, unwrung] = SolveArm(frame, shoulder);
    const Eigen::Matrix3d hand = hands_[shoulder - 16][frame].toRotationMatrix();
    const Eigen::Vector3d forearm = RestBone(elbow, wrist).normalized();
    world[shoulder] = upper;
    world[wrist] = unwrung * hand;
    world[elbow] =
        unwrung * ExpSO3(kForearmTwistShare * FoldedTwist(TwistAngle(hand, forearm)) * forearm);
    Fingers(frame, wrist, world);
  }

  // Roll within the forearm's range; beyond, decreasing to zero at half a turn, so that +180 and
  // -180 degrees, which look the same, give the same result.
  static double FoldedTwist(double twist) {
    const double size = std::abs(twist);
    const double folded = size < kForearmRoll ? size
                                              : kForearmRoll * (std::numbers::pi - size) /
                                                    (std::numbers::pi - kForearmRoll);
    return std::copysign(folded, twist);
  }

  // Hands relative to their unrolled forearms, all frames. Impossible wrist poses (captured hands
  // sometimes flip) are interpolated from the nearest possible frames.
  void GatherHands() {
    const int frames = motion_.NumFrames();
    for (const int shoulder : {16, 17}) {
      const int elbow = shoulder + 2, wrist = shoulder + 4;
      const Eigen::Vector3d forearm = RestBone(elbow, wrist).normalized();
      auto& hands = hands_[shoulder - 16];
      hands.resize(frames);
      std::vector<bool> possible(frames);
      for (int t = 0; t < frames; ++t) {
        const Eigen::Matrix3d hand = SolveArm(t, shoulder).second.transpose() * Turned(t, wrist);
        const double bend = std::acos(std::clamp(forearm.dot(hand * forearm), -1.0, 1.0));
        possible[t] = bend < kWristBend && std::abs(TwistAngle(hand, forearm)) < kWristRoll;
        hands[t] = Eigen::Quaterniond(hand);
      }
      int last = -1;
      for (int t = 0; t <= frames; ++t) {
        if (t < frames && !possible[t]) continue;
        for (int gap = last + 1; gap < t; ++gap) {
          if (last < 0 && t == frames) continue;  // never possible: kept as is
          ++repaired_hand_frames_;
          hands[gap] = last < 0      ? hands[t]
                       : t == frames ? hands[last]
                                     : hands[last].slerp(double(gap - last) / (t - last), hands[t]);
        }
        last = t;
      }
    }
  }

  void Fingers(int frame, int wrist, Rotations& world) const {
    const int begin = wrist == 20 ? kLeftHandBegin : kRightHandBegin;
    for (int j = begin; j < begin + kJointsPerHand; ++j) {
      const int place = (j - begin) % 3;  // knuckle, middle, last
      const Eigen::Matrix3d& above = world[kJointParents[j]];
      if (!motion_.Has(j)) {
        world[j] = above * RelaxedFinger(j);
      } else if (place < 2 && motion_.Has(j + 1)) {
        world[j] = Aim(above, RestBone(j, j + 1), Bone(frame, j, j + 1));
      } else {
        world[j] = Aim(above, RestBone(j - 1, j), motion_.Rotation(frame, j) * motion_.Tip(j));
      }
    }
  }

  void PlaceRoot(int frame, Pose& pose) const {
    const Eigen::Vector3d root = rest_.col(0);
    if (calibration_.same_skeleton) {
      pose.trans = calibration_.scale * motion_.Position(frame, 0) - root;
      return;
    }
    const Eigen::Vector3d middle = 0.5 * (motion_.Position(frame, 1) + motion_.Position(frame, 2));
    const Eigen::Vector3d rest_middle = 0.5 * (rest_.col(1) + rest_.col(2));
    pose.trans = calibration_.scale * middle - (root + pose.world[0] * (rest_middle - root));
  }

  // Rotates thigh and shin so that the ankle reaches the source's position, scaled with the path.
  void ReachAnkle(int frame, int hip, Pose& pose) const {
    const int knee = hip + 3, ankle = hip + 6;
    Rotations& world = pose.world;
    const Eigen::Vector3d root = rest_.col(0) + pose.trans;
    const Eigen::Vector3d hip_at = root + world[0] * RestBone(0, hip);
    const double thigh = RestBone(hip, knee).norm(), shin = RestBone(knee, ankle).norm();
    Eigen::Vector3d reach = calibration_.scale * motion_.Position(frame, ankle) - hip_at;
    const Eigen::Vector3d now =
        world[hip] * RestBone(hip, knee) + world[knee] * RestBone(knee, ankle);
    if (calibration_.shaped_like_smplx && (now - reach).norm() < 1e-3) return;  // already reached
    const double longest = 0.9995 * (thigh + shin), shortest = 1.05 * std::abs(thigh - shin);
    const double distance = std::clamp(reach.norm(), shortest, longest);
    if (reach.norm() < 1e-9) return;
    reach.normalize();
    // The knee bends in the source's direction; a straight leg bends forward.
    const Eigen::Vector3d knee_now = world[hip] * RestBone(hip, knee);
    Eigen::Vector3d bend = knee_now - knee_now.dot(reach) * reach;
    bend += 0.02 * thigh * reach.cross(world[hip] * HingeAxis(knee));
    bend -= bend.dot(reach) * reach;
    if (bend.norm() < 1e-9) return;
    const double along = (thigh * thigh - shin * shin + distance * distance) / (2 * distance);
    const double aside = std::sqrt(std::max(thigh * thigh - along * along, 0.0));
    const Eigen::Vector3d knee_goal = along * reach + aside * bend.normalized();
    world[hip] = Aim(world[hip], RestBone(hip, knee), knee_goal);
    world[knee] = BendHinge(knee, world[hip], RestBone(knee, ankle), distance * reach - knee_goal);
  }

  const MappedMotion& motion_;
  const RetargetBody& body_;
  const Eigen::Matrix3Xd& rest_;
  RetargetCalibration calibration_;
  std::array<std::vector<Eigen::Quaterniond>, 2> hands_;  // left, right
  int repaired_hand_frames_ = 0;
};

struct Tally {
  double sum = 0, most = 0;
  std::size_t count = 0;
  void Add(double value) {
    sum += value;
    most = std::max(most, value);
    ++count;
  }
  double Mean() const { return count ? sum / static_cast<double>(count) : 0; }
};

// Error of the joints relative to the source's, with each limb bone at the body's length.
class ErrorMeter {
 public:
  ErrorMeter(const MappedMotion& motion, const Eigen::Matrix3Xd& rest,
             const RetargetCalibration& calibration)
      : motion_(motion),
        rest_(rest),
        scale_(calibration.scale),
        same_bones_(calibration.same_skeleton || calibration.shaped_like_smplx) {
    for (const int side : {0, 1}) {
      const int wrist = 20 + side;
      hand_in_source_[side] = motion.Tip(wrist);
      if (hand_in_source_[side].norm() < 0.1 * motion.LocalBone(wrist - 2, wrist).norm()) {
        hand_in_source_[side] = motion.LocalBone(wrist - 2, wrist);
      }
    }
  }

  void Add(int frame, const Joints& joints) {
    const auto expected = [&](int from, int to) -> Eigen::Vector3d {
      const Eigen::Vector3d bone = motion_.Position(frame, to) - motion_.Position(frame, from);
      return (rest_.col(to) - rest_.col(from)).norm() * bone.normalized();
    };
    for (const int top : {1, 2, 16, 17}) {
      const bool leg = top < 3;
      const int middle = top + (leg ? 3 : 2), end = middle + (leg ? 3 : 2);
      const Eigen::Vector3d upper = expected(top, middle), both = upper + expected(middle, end);
      all.Add(1000 * (joints.col(middle) - joints.col(top) - upper).norm());
      const double error = 1000 * (joints.col(end) - joints.col(top) - both).norm();
      all.Add(error);
      if (!leg) wrists.Add(error);
    }
    const Eigen::Vector3d middle = 0.5 * (joints.col(1) + joints.col(2));
    const Eigen::Vector3d source_middle =
        0.5 * (motion_.Position(frame, 1) + motion_.Position(frame, 2));
    for (const int ankle : {7, 8}) {
      ankles.Add(1000 * (joints.col(ankle) - middle -
                         scale_ * (motion_.Position(frame, ankle) - source_middle))
                            .norm());
    }
    AddPlaces(frame, joints);
    AddTrunk(frame, joints);
    for (const int side : {0, 1}) AddHand(frame, side, joints);
  }

  Tally all, wrists, ankles;
  std::array<Tally, kNumBodyJoints> places;  // millimeters
  std::array<Tally, 3> trunk;                // radians
  std::array<Tally, 2> hands;                // radians, left and right

 private:
  // For a source with SMPL-X's bones: all joints, scaled, relative to the middle of the hips.
  // Others have different collarbones and spines: arms relative to the shoulder, each bone at the
  // body's length, and ankles.
  void AddPlaces(int frame, const Joints& joints) {
    const auto source = [&](int joint) { return motion_.Position(frame, joint); };
    const Eigen::Vector3d hips = 0.5 * (joints.col(1) + joints.col(2));
    const Eigen::Vector3d source_hips = 0.5 * (source(1) + source(2));
    const auto add = [&](int joint, const Eigen::Vector3d& expected) {
      places[joint].Add(1000 * (joints.col(joint) - expected).norm());
    };
    for (int j = 0; j < kNumBodyJoints; ++j) {
      if (!(same_bones_ ? motion_.Has(j) : j == 7 || j == 8)) continue;
      add(j, hips + scale_ * (source(j) - source_hips));
    }
    if (same_bones_) return;
    for (const int shoulder : {16, 17}) {
      Eigen::Vector3d at = joints.col(shoulder);
      for (const int j : {shoulder, shoulder + 2}) {
        const double length = (rest_.col(j + 2) - rest_.col(j)).norm();
        at += length * (source(j + 2) - source(j)).normalized();
        add(j + 2, at);
      }
    }
  }

  // Hip line, shoulder line, and the line between their midpoints.
  void AddTrunk(int frame, const Joints& joints) {
    const auto source = [&](int joint) { return motion_.Position(frame, joint); };
    const auto add = [&](Tally& tally, const Eigen::Vector3d& clip, const Eigen::Vector3d& wanted) {
      tally.Add(std::atan2(clip.cross(wanted).norm(), clip.dot(wanted)));
    };
    add(trunk[0], joints.col(1) - joints.col(2), source(1) - source(2));
    add(trunk[1], joints.col(16) - joints.col(17), source(16) - source(17));
    add(trunk[2], joints.col(16) + joints.col(17) - joints.col(1) - joints.col(2),
        source(16) + source(17) - source(1) - source(2));
  }

  // From the wrist to the knuckles; without fingers along the end site of the source's hand, else
  // along its forearm.
  void AddHand(int frame, int side, const Joints& joints) {
    const int wrist = 20 + side, begin = side == 0 ? kLeftHandBegin : kRightHandBegin;
    Eigen::Vector3d clip = Eigen::Vector3d::Zero(), source = clip;
    int knuckles = 0;
    for (const int joint : {begin, begin + 3, begin + 6, begin + 9}) {
      if (!motion_.Has(joint)) continue;
      const Eigen::Vector3d bone = motion_.Position(frame, joint) - motion_.Position(frame, wrist);
      if (bone.norm() < 1e-9) continue;
      clip += (joints.col(joint) - joints.col(wrist)).normalized();
      source += bone.normalized();
      ++knuckles;
    }
    if (knuckles < 2) {
      clip = joints.col(begin + 3) - joints.col(wrist);
      source = motion_.Rotation(frame, wrist) * hand_in_source_[side];
    }
    hands[side].Add(std::atan2(clip.cross(source).norm(), clip.dot(source)));
  }

  const MappedMotion& motion_;
  const Eigen::Matrix3Xd& rest_;
  double scale_;
  bool same_bones_;
  std::array<Eigen::Vector3d, 2> hand_in_source_;  // in the frame of its joint
};

// Moves and tilts the world so that the ground becomes z = 0.
void StandOn(const GroundPlane& ground, const Eigen::Vector3d& root, Clip& clip,
             std::vector<Eigen::Matrix3Xd>& points) {
  const Eigen::Vector3d base(0, 0, ground.height);
  const Eigen::Matrix3d tilt = LeastRotation(
      Eigen::Vector3d(-ground.slope.x(), -ground.slope.y(), 1), Eigen::Vector3d::UnitZ());
  for (int t = 0; t < clip.NumFrames(); ++t) {
    clip.trans.col(t) = tilt * (root + clip.trans.col(t) - base) - root;
    if (!ground.slope.isZero()) {
      clip.pose[t].col(0) = UnwrapAxisAngle(LogSO3(tilt * ExpSO3(clip.pose[t].col(0))),
                                            clip.pose[std::max(t - 1, 0)].col(0));
    }
    points[t] = tilt * (points[t].colwise() - base);
    if (!clip.object) continue;
    ObjectTrack& object = *clip.object;
    object.trans.col(t) = tilt * (object.trans.col(t) - base);
    if (!ground.slope.isZero()) {
      object.orient.col(t) = UnwrapAxisAngle(LogSO3(tilt * ExpSO3(object.orient.col(t))),
                                             object.orient.col(std::max(t - 1, 0)));
    }
  }
}

// Converts a prop to an object track, its path scaled like the body's.
ObjectTrack TrackOf(const SourceMotion::Prop& prop, const Eigen::Matrix3d& clip_from_source,
                    double scale) {
  ObjectTrack track;
  track.name = prop.name;
  track.trans = scale * clip_from_source * prop.positions;
  track.orient.resize(3, prop.positions.cols());
  for (Eigen::Index t = 0; t < track.orient.cols(); ++t) {
    const Eigen::Vector3d w =
        LogSO3(clip_from_source * prop.rotations[static_cast<std::size_t>(t)].toRotationMatrix());
    track.orient.col(t) = t > 0 ? UnwrapAxisAngle(w, track.orient.col(t - 1)) : w;
  }
  return track;
}

void ReportSoles(const std::vector<Eigen::Matrix3Xd>& points, double frame_rate,
                 RetargetReport& report) {
  Tally skate, height;
  double lowest = HUGE_VAL;
  for (std::size_t t = 0; t < points.size(); ++t) {
    Eigen::Index sole;
    const double low = points[t].leftCols<GroundProbe::kNumSoles>().row(2).minCoeff(&sole);
    lowest = std::min(lowest, low);
    if (low > 0.03) continue;
    height.Add(low);
    if (t > 0) skate.Add((points[t] - points[t - 1]).col(sole).head<2>().norm() * frame_rate);
  }
  report.foot_skate = skate.Mean();
  report.mean_sole_height_m = height.Mean();
  report.min_sole_height_m = lowest;
}

}  // namespace

std::string_view UpAxisName(UpAxis up) {
  constexpr std::array<std::string_view, 6> kNames = {"x", "-x", "y", "-y", "z", "-z"};
  return kNames[static_cast<std::size_t>(up)];
}

RetargetBody RetargetBodyOf(const BodyModel& model, const Eigen::VectorXd& betas) {
  const Eigen::Matrix3Xd shaped = model.ShapedVertices(betas);
  RetargetBody body;
  body.rest_joints = model.RestJoints(shaped);
  body.floor_y = shaped.row(1).minCoeff();
  body.left_hand = model.HandMean(Side::kLeft);
  body.right_hand = model.HandMean(Side::kRight);
  return body;
}

Clip Retarget(const SourceMotion& motion, const SkeletonMap& map, const RetargetBody& body,
              const RetargetOptions& options, RetargetReport* report) {
  if (!(motion.frame_rate > 0) || motion.NumFrames() == 0) {
    throw Error("retargeting", "the motion has no frames or no frame rate", "Give its frame rate");
  }
  const MappedMotion mapped(motion, map, options.up);
  const Retargeter retargeter(mapped, body);
  const RetargetCalibration& calibration = retargeter.Calibration();
  ErrorMeter meter(mapped, body.rest_joints, calibration);
  const GroundProbe probe(body.rest_joints, body.floor_y);
  Eigen::Matrix3d z_up;
  z_up << 1, 0, 0, 0, 0, -1, 0, 1, 0;

  const int frames = motion.NumFrames();
  Clip clip;
  clip.frame_rate = motion.frame_rate;
  clip.trans.resize(3, frames);
  clip.pose.resize(frames);
  std::vector<Eigen::Matrix3Xd> touching(frames);
  for (int t = 0; t < frames; ++t) {
    Retargeter::Pose pose = retargeter.Solve(t);
    meter.Add(t, PlaceJoints(body.rest_joints, pose.world, pose.trans));
    const Eigen::Vector3d root = body.rest_joints.col(0);
    clip.trans.col(t) = z_up * (root + pose.trans) - root;
    for (Eigen::Matrix3d& R : pose.world) R = z_up * R;
    for (int j = 0; j < kNumJoints; ++j) {
      const int parent = kJointParents[j];
      const Eigen::Matrix3d local =
          parent < 0 ? pose.world[j]
                     : Eigen::Matrix3d(pose.world[parent].transpose() * pose.world[j]);
      Eigen::Vector3d w = LogSO3(local);
      if (t > 0) w = UnwrapAxisAngle(w, clip.pose[t - 1].col(j));
      clip.pose[t].col(j) = w;
    }
    touching[t] = probe.LowestPoints(PlaceJoints(body.rest_joints, pose.world, clip.trans.col(t)),
                                     pose.world);
  }
  if (motion.prop) {
    clip.object = TrackOf(*motion.prop, z_up * UprightFrom(options.up), calibration.scale);
  }
  GroundPlane ground;
  if (options.find_ground) {
    ground = FindGround(touching, motion.frame_rate, true);
    StandOn(ground, body.rest_joints.col(0), clip, touching);
  }
  if (report) {
    report->scale = calibration.scale;
    report->ground_offset_m = -ground.height;
    report->ground_slope = ground.slope.norm();
    report->same_skeleton = calibration.same_skeleton;
    report->repaired_hand_frames = retargeter.RepairedHandFrames();
    report->mean_joint_error_mm = meter.all.Mean();
    report->max_joint_error_mm = meter.all.most;
    report->mean_wrist_error_mm = meter.wrists.Mean();
    report->max_wrist_error_mm = meter.wrists.most;
    report->mean_ankle_error_mm = meter.ankles.Mean();
    report->max_ankle_error_mm = meter.ankles.most;
    report->worst_place_mm = 0;
    for (int j = 0; j < kNumBodyJoints; ++j) {
      if (meter.places[j].Mean() <= report->worst_place_mm) continue;
      report->worst_place_mm = meter.places[j].Mean();
      report->worst_place_joint = j;
    }
    report->trunk_error_rad = 0;
    for (const Tally& line : meter.trunk) {
      report->trunk_error_rad = std::max(report->trunk_error_rad, line.Mean());
    }
    for (const int side : {0, 1}) report->hand_error_rad[side] = meter.hands[side].Mean();
    ReportSoles(touching, motion.frame_rate, *report);
  }
  return options.frame_rate > 0 ? Resample(clip, options.frame_rate) : clip;
}

}  // namespace holdfast
