// SPDX-License-Identifier: MIT
#include "geometry/retarget/retarget_onto.h"

#include <algorithm>
#include <vector>

#include "geometry/retarget/retarget_calibration.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

// Returns the joint whose calibration applies: joints that Calibrate leaves out are hinges of it.
int CalibratedJoint(int joint) {
  if (joint >= kLeftHandBegin) return joint < kRightHandBegin ? 20 : 21;
  if (joint == 4 || joint == 5) return joint - 3;
  if (joint == 18 || joint == 19) return joint - 2;
  return joint;
}

// Returns the joint at the other end of a limb or finger bone, -1 for others.
int EndOfBone(int joint) {
  if (joint == 1 || joint == 2 || joint == 4 || joint == 5) return joint + 3;
  if (joint >= 16 && joint <= 19) return joint + 2;
  if (joint >= kLeftHandBegin) return (joint - kLeftHandBegin) % 3 < 2 ? joint + 1 : -1;
  return -1;
}

class Onto {
 public:
  Onto(const Clip& clip, const RetargetBody& body, const SourceMotion& character,
       const SkeletonMap& map)
      : clip_(clip),
        body_(body),
        character_(character),
        mapped_(character, map, UpAxis::kY),
        calibration_(Calibrate(mapped_, body)),
        smplx_of_(character.joint_names.size(), -1) {
    for (int j = 0; j < kNumJoints; ++j) {
      if (map.source[j] >= 0) smplx_of_[static_cast<std::size_t>(map.source[j])] = j;
    }
    result_ = character;
    result_.frame_rate = clip.frame_rate;
    result_.rotations.clear();
    result_.positions.clear();
    result_.prop.reset();
  }

  SourceMotion Run() {
    Eigen::Matrix3Xd wrist_shift(3, clip_.NumFrames());
    for (int t = 0; t < clip_.NumFrames(); ++t) {
      ForwardJoints(body_.rest_joints, clip_.pose[t], clip_.trans.col(t), state_);
      Pose();
      wrist_shift.col(t) = WristShift(t);
    }
    if (clip_.object) PlaceObject(wrist_shift);
    return std::move(result_);
  }

 private:
  Eigen::Matrix3d World(int joint) const { return y_up_ * state_.world_rotation[joint]; }
  Eigen::Vector3d At(int joint) const { return y_up_ * state_.joints.col(joint); }

  // World rotation of a source joint, relative to its rest pose.
  Eigen::Matrix3d Turned(int joint) const {
    if (calibration_.same_skeleton) return World(joint);
    const Eigen::Matrix3d& C = calibration_.source_from_smplx[CalibratedJoint(joint)];
    const Eigen::Matrix3d R = World(joint) * C.transpose();
    const int end = EndOfBone(joint);
    if (end < 0 || !mapped_.Has(end)) return R;
    const Eigen::Vector3d bone = mapped_.Rest(end) - mapped_.Rest(joint);
    const Eigen::Vector3d direction = At(end) - At(joint);
    if (bone.norm() < 1e-6 || direction.norm() < 1e-6) return R;
    return LeastRotation(R * bone, direction) * R;
  }

  void Pose() {
    const int joints = character_.NumJoints();
    Eigen::Matrix3Xd positions(3, joints);
    std::vector<Eigen::Matrix3d> world(static_cast<std::size_t>(joints));
    std::vector<bool> above(static_cast<std::size_t>(joints));  // above the hips, or beside them
    const int pelvis = mapped_.Map().source[0];
    for (int s = 0; s < joints; ++s) {
      const int parent = character_.parents[static_cast<std::size_t>(s)];
      const int smplx = smplx_of_[static_cast<std::size_t>(s)];
      Eigen::Matrix3d& R = world[static_cast<std::size_t>(s)];
      above[static_cast<std::size_t>(s)] =
          smplx < 0 && (parent < 0 || above[static_cast<std::size_t>(parent)]);
      const bool stays = above[static_cast<std::size_t>(s)];
      R = smplx >= 0 ? Turned(smplx)
          : stays    ? character_.Rotation(0, s).toRotationMatrix()
                     : world[static_cast<std::size_t>(parent)];
      if (s == pelvis) {
        positions.col(s) = Hips(R);
      } else if (stays) {
        positions.col(s) = character_.positions[0].col(s);
      } else {
        positions.col(s) = positions.col(parent) +
                           world[static_cast<std::size_t>(parent)] * character_.rest_offsets.col(s);
      }
      result_.rotations.emplace_back(R);
      result_.rotations.back().normalize();
    }
    result_.positions.push_back(std::move(positions));
  }

  // Pelvis position that puts the middle of the hips at the clip's, scaled by leg length.
  Eigen::Vector3d Hips(const Eigen::Matrix3d& R) const {
    if (calibration_.same_skeleton) return At(0) / calibration_.scale;
    const Eigen::Vector3d middle = 0.5 * (At(1) + At(2)) / calibration_.scale;
    const Eigen::Vector3d rest = 0.5 * (mapped_.Rest(1) + mapped_.Rest(2)) - mapped_.Rest(0);
    return middle - R * rest;
  }

  // Offset of the holding hands from their positions in the clip.
  Eigen::Vector3d WristShift(int t) const {
    if (clip_.holding_hand.empty() || clip_.holding_hand[t] == 0) return Eigen::Vector3d::Zero();
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int hands = 0;
    for (const Side side : {Side::kRight, Side::kLeft}) {
      if ((clip_.holding_hand[t] & HoldingBit(side)) == 0) continue;
      const int wrist = WristJoint(side);
      sum += result_.positions[t].col(mapped_.Map().source[wrist]) - At(wrist);
      ++hands;
    }
    return sum / hands;
  }

  // Interpolates the offset linearly between holds; without any hold, the path is scaled.
  void PlaceObject(const Eigen::Matrix3Xd& wrist_shift) {
    SourceMotion::Prop& prop = result_.prop.emplace();
    prop.name = clip_.object->name;
    const int frames = clip_.NumFrames();
    prop.positions = y_up_ * clip_.object->trans;
    std::vector<int> held;
    for (int t = 0; t < frames; ++t) {
      prop.rotations.emplace_back(y_up_ * ExpSO3(clip_.object->orient.col(t)));
      if (!clip_.holding_hand.empty() && clip_.holding_hand[t] != 0) held.push_back(t);
    }
    if (held.empty()) {
      prop.positions /= calibration_.scale;
      return;
    }
    std::size_t next = 0;
    for (int t = 0; t < frames; ++t) {
      while (next < held.size() && held[next] < t) ++next;
      const int after = held[std::min(next, held.size() - 1)];
      const int before = after <= t || next == 0 ? after : held[next - 1];
      const double share =
          after > before ? static_cast<double>(t - before) / (after - before) : 0.0;
      prop.positions.col(t) +=
          (1 - share) * wrist_shift.col(before) + share * wrist_shift.col(after);
    }
  }

  const Clip& clip_;
  const RetargetBody& body_;
  const SourceMotion& character_;
  const MappedMotion mapped_;
  const RetargetCalibration calibration_;
  const Eigen::Matrix3d y_up_ = UprightFrom(UpAxis::kZ);
  std::vector<int> smplx_of_;  // of each source joint, -1 for none
  BodyState state_;
  SourceMotion result_;
};

}  // namespace

SourceMotion RetargetOnto(const Clip& clip, const RetargetBody& body, const SourceMotion& character,
                          const SkeletonMap& map) {
  return Onto(clip, body, character, map).Run();
}

}  // namespace holdfast
