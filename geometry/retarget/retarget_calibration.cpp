// SPDX-License-Identifier: MIT
#include "geometry/retarget/retarget_calibration.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>

#include <Eigen/Geometry>
#include <Eigen/SVD>

#include "geometry/error.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr double kFootTrust = 15 * kDegree;       // between a resting and a standing foot
constexpr double kLengthTolerance = 0.15;         // relative, of the bones of SMPL-X-like shapes
constexpr double kShapeTolerance = 5 * kDegree;   // and direction of a joint's children
constexpr double kRestTrust = 60 * kDegree;       // between rest axes and the mean over a clip
constexpr double kOppositeTrust = 100 * kDegree;  // likewise, for a head with an upright rest pose
constexpr double kWristTrust = 45 * kDegree;      // between a hand and its forearm, likewise
constexpr double kMinTip = 0.1;  // of the bone before: a shorter end site has no reliable direction

constexpr int kPelvisChildren[] = {kLeftHip, kRightHip, kSpine1};
constexpr int kChestChildren[] = {kNeck, kLeftCollar, kRightCollar};

double Angle(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

// Right-handed frame with first column along `lateral`, second as close to `up` as possible.
Eigen::Matrix3d Frame(const Eigen::Vector3d& lateral, const Eigen::Vector3d& up) {
  Eigen::Matrix3d frame;
  frame.col(0) = lateral.normalized();
  frame.col(2) = lateral.cross(up).normalized();
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return frame;
}

// Frame with the second column exactly `up`, and the heading `forward`.
Eigen::Matrix3d FrameFromUp(const Eigen::Vector3d& up, const Eigen::Vector3d& forward) {
  Eigen::Matrix3d frame;
  frame.col(1) = up.normalized();
  frame.col(0) = up.cross(forward).normalized();
  frame.col(2) = frame.col(0).cross(frame.col(1));
  return frame;
}

// Returns the nearest of the 24 rotations of the cube.
Eigen::Matrix3d SnapToAxes(const Eigen::Matrix3d& R) {
  Eigen::Matrix3d snapped = Eigen::Matrix3d::Zero();
  Eigen::Index row0, row1;
  R.col(0).cwiseAbs().maxCoeff(&row0);
  Eigen::Vector3d second = R.col(1);
  second[row0] = 0;
  second.cwiseAbs().maxCoeff(&row1);
  snapped(row0, 0) = R(row0, 0) > 0 ? 1 : -1;
  snapped(row1, 1) = R(row1, 1) > 0 ? 1 : -1;
  snapped.col(2) = snapped.col(0).cross(snapped.col(1));
  return snapped;
}

class Calibrator {
 public:
  Calibrator(const MappedMotion& motion, const RetargetBody& body)
      : motion_(motion), joints_(body.rest_joints) {
    result_.source_from_smplx.fill(Eigen::Matrix3d::Identity());
  }

  RetargetCalibration Run() {
    Scale();
    result_.same_skeleton = SameSkeleton();
    if (result_.same_skeleton) return result_;
    result_.shaped_like_smplx = ShapedLikeSmplx();
    Torso();
    if (result_.shaped_like_smplx) ShapedTorso();
    for (const int hip : {kLeftHip, kRightHip}) {
      const int knee = hip + 3, ankle = hip + 6, foot = hip + 9;
      Limb(hip, knee, ankle);
      Foot(ankle, foot);
    }
    for (const int shoulder : {16, 17}) {
      Limb(shoulder, shoulder + 2, shoulder + 4);
      Hand(shoulder + 4);
    }
    return result_;
  }

 private:
  Eigen::Vector3d RestBone(int from, int to) const { return joints_.col(to) - joints_.col(from); }
  Eigen::Vector3d SourceRestBone(int from, int to) const {
    return motion_.Rest(to) - motion_.Rest(from);
  }

  double Meters(const Eigen::Vector3d& length) const { return unit_ * length.norm(); }

  void Scale() {
    double source = 0, target = 0;
    for (const int hip : {kLeftHip, kRightHip}) {
      for (const int joint : {hip, hip + 3}) {
        source += (motion_.Position(0, joint) - motion_.Position(0, joint + 3)).norm();
        target += RestBone(joint, joint + 3).norm();
      }
    }
    if (!(source > 1e-9)) {
      throw Error("retargeting", "the source's legs have no length", "Check the map of its joints");
    }
    result_.scale = target / source;
    if (result_.scale < 0.5 || result_.scale > 2) unit_ = result_.scale;
  }

  bool SameSkeleton() const {
    for (int j = 1; j < kNumBodyJoints; ++j) {
      const int parent = kJointParents[j];
      if (!motion_.Has(j) || !motion_.Has(parent) || !motion_.HangsDirectly(j)) return false;
      if (Angle(SourceRestBone(parent, j), RestBone(parent, j)) > 3 * kDegree) return false;
    }
    return true;
  }

  // Rotation that aligns the children of an SMPL-X joint with the source's.
  Eigen::Matrix3d RigidFit(int joint, std::span<const int> children) const {
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    for (const int child : children) {
      covariance += motion_.LocalBone(joint, child).normalized() *
                    RestBone(joint, child).normalized().transpose();
    }
    return NearestRotation(covariance);
  }

  bool ShapedLikeSmplx() const {
    for (int j = 1; j < kNumBodyJoints; ++j) {
      const int parent = kJointParents[j];
      const bool toes = j == 10 || j == 11;
      if (toes && !motion_.Has(j)) continue;
      if (!motion_.Has(j) || !motion_.HangsDirectly(j)) return false;
      const double length = result_.scale * motion_.LocalBone(parent, j).norm();
      if (std::abs(length / RestBone(parent, j).norm() - 1) > kLengthTolerance) return false;
    }
    const auto fits = [&](int joint, std::span<const int> children) {
      const Eigen::Matrix3d R = RigidFit(joint, children);
      return std::ranges::all_of(children, [&](int child) {
        return Angle(R * RestBone(joint, child), motion_.LocalBone(joint, child)) < kShapeTolerance;
      });
    };
    return fits(kPelvis, kPelvisChildren) && fits(kSpine3, kChestChildren);
  }

  // Rotation of a single-bone joint, assuming no twist against its parent on average.
  Eigen::Matrix3d Untwisted(int joint, int child) const {
    const int parent = kJointParents[joint];
    const Eigen::Vector3d rest = RestBone(joint, child);
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (int t = 0; t < motion_.NumFrames(); ++t) {
      const Eigen::Matrix3d above = motion_.Rotation(t, parent) * result_.source_from_smplx[parent];
      const Eigen::Vector3d bone = motion_.Position(t, child) - motion_.Position(t, joint);
      sum += motion_.Rotation(t, joint).transpose() * LeastRotation(above * rest, bone) * above;
    }
    const Eigen::Matrix3d mean = NearestRotation(sum);
    return LeastRotation(mean * rest, motion_.LocalBone(joint, child)) * mean;
  }

  static bool LiesAlongAxis(const Eigen::Vector3d& bone) {
    return bone.normalized().cwiseAbs().maxCoeff() > std::cos(1 * kDegree);
  }

  // If a bone lies along an axis, programs differ in the roll of the other axes about it by quarter
  // turns. Returns the axes if they can be rolled to within 45 degrees of `mean`, else `mean`.
  static Eigen::Matrix3d Rolled(const Eigen::Matrix3d& at_rest, const Eigen::Vector3d& bone,
                                const Eigen::Matrix3d& mean) {
    if (!LiesAlongAxis(bone)) return mean;
    for (const double roll : {90, 180, 270}) {
      const Eigen::Matrix3d rolled = ExpSO3(roll * kDegree * bone.normalized()) * at_rest;
      if (AngleBetween(mean, rolled) < 45 * kDegree) return rolled;
    }
    return mean;
  }

  // A head bent at rest is corrected by its end site, which continues the neck or points up.
  void FollowTip(Eigen::Matrix3d& head) const {
    const Eigen::Vector3d tip = motion_.Tip(kHead), neck = RestBone(kNeck, kHead);
    const bool face = motion_.Has(22) || motion_.Has(23) || motion_.Has(24);
    if (face || tip.norm() < kMinTip * motion_.LocalBone(kNeck, kHead).norm()) return;
    const Eigen::Vector3d straight = Eigen::Vector3d::UnitY();
    const Eigen::Vector3d rest =
        head * (Angle(head * neck, tip) <= Angle(head * straight, tip) ? neck : straight);
    if (Angle(rest, tip) < 45 * kDegree) head = LeastRotation(rest, tip) * head;
  }

  // From the bones alone, without the rest pose; except for the head, which has no bone.
  void ShapedTorso() {
    auto& C = result_.source_from_smplx;
    C[kPelvis] = RigidFit(kPelvis, kPelvisChildren);
    C[kSpine3] = RigidFit(kSpine3, kChestChildren);
    C[kSpine1] = Untwisted(kSpine1, kSpine2);
    C[kSpine2] = Untwisted(kSpine2, kSpine3);
    C[kNeck] = Untwisted(kNeck, kHead);
    for (const int collar : {13, 14}) C[collar] = Untwisted(collar, collar + 3);
    // At rest, the head continues the neck.
    C[kHead] = LeastRotation(C[kSpine3] * RestBone(kNeck, kHead), motion_.LocalBone(kNeck, kHead)) *
               C[kSpine3];
    FollowTip(C[kHead]);
    Head(kRestTrust);
  }

  void Torso() {
    const Eigen::Vector3d hips = SourceRestBone(kRightHip, kLeftHip);
    const Eigen::Vector3d hip_middle = 0.5 * (motion_.Rest(kLeftHip) + motion_.Rest(kRightHip));
    const Eigen::Vector3d shoulders = motion_.Rest(16) - motion_.Rest(17);
    const int top = motion_.Has(kNeck) ? kNeck : motion_.Has(kHead) ? kHead : -1;

    // If the whole trunk is straight and upright at rest, its rotations are neutral there.
    if (top >= 0) {
      const Eigen::Vector3d up = motion_.Rest(top) - hip_middle;
      if (Angle(hips, shoulders) < 30 * kDegree &&
          std::abs(Angle(hips, up) - 90 * kDegree) < 30 * kDegree) {
        const Eigen::Matrix3d frame = Frame(hips, up);
        const Eigen::Matrix3d snapped = SnapToAxes(frame);
        if (AngleBetween(frame, snapped) < 25 * kDegree && LumbarIsUpright(snapped) &&
            CollarsRestAside(snapped)) {
          result_.torso_rests_upright = true;
          axes_ = snapped;
        }
      }
    }
    if (result_.torso_rests_upright) {
      result_.source_from_smplx.fill(axes_);
      for (const int side : {0, 1}) {
        if (motion_.Has(9)) {
          result_.shoulder_at_rest[side] = axes_.transpose() * SourceRestBone(9, 16 + side);
        }
      }
      if (motion_.Has(kHead)) Head(kOppositeTrust);
      return;
    }

    // Otherwise pelvis and chest are oriented by their own joints.
    const int lumbar = motion_.Has(kSpine1)   ? kSpine1
                       : motion_.Has(kSpine2) ? kSpine2
                       : motion_.Has(kSpine3) ? kSpine3
                                              : top;
    const Eigen::Vector3d lumbar_direction =
        lumbar < 0 ? Eigen::Vector3d(Eigen::Vector3d::UnitY()) : motion_.Rest(lumbar) - hip_middle;
    const Eigen::Matrix3d pelvis = Frame(hips, lumbar_direction);
    const Eigen::Matrix3d snapped = SnapToAxes(pelvis);
    const bool upright = LumbarIsUpright(snapped);
    if (upright) {
      axes_ = snapped;
      result_.source_from_smplx.fill(axes_);
    }
    // Axes along the bone are not upright but lean with it.
    if (!upright || (lumbar >= 0 && LiesAlongAxis(motion_.LocalBone(kPelvis, lumbar)))) {
      result_.source_from_smplx[kPelvis] = Pelvis(hips, lumbar, top);
    }
    if (motion_.Has(kSpine3) && top >= 0) {
      const bool collars =
          motion_.Has(13) && motion_.Has(14) && Meters(motion_.Rest(13) - motion_.Rest(14)) > 0.005;
      const Eigen::Vector3d lateral =
          collars ? Eigen::Vector3d(motion_.Rest(13) - motion_.Rest(14)) : shoulders;
      const Eigen::Vector3d up = motion_.Rest(top) - motion_.Rest(kSpine3);
      if (Meters(up) > 0.005 && Angle(lateral, up) > 30 * kDegree) {
        const Eigen::Matrix3d chest =
            Frame(lateral, up) *
            Frame(Eigen::Vector3d::UnitX(), RestBone(kSpine3, top)).transpose();
        for (const int j : {kSpine1, kSpine2, kSpine3, kNeck, kHead}) {
          result_.source_from_smplx[j] = chest;
        }
      }
    }
    if (motion_.Has(kHead)) Head(45 * kDegree);
  }

  // A rest pose with bones along their own axes may also be upright, with all bones stacked.
  bool CollarsRestAside(const Eigen::Matrix3d& axes) const {
    for (const int collar : {13, 14}) {
      if (!motion_.Has(collar)) continue;
      const Eigen::Vector3d bone = axes.transpose() * SourceRestBone(collar, collar + 3);
      if (Meters(bone) > 0.005 && Angle(bone, RestBone(collar, collar + 3)) > 60 * kDegree) {
        return false;
      }
    }
    return true;
  }

  // Pelvis without a usable rest pose: the lowest spine joint is placed as in SMPL-X, unless this
  // is far from the body axis in frames where trunk and thighs are aligned, standing or lying.
  Eigen::Matrix3d Pelvis(const Eigen::Vector3d& hips, int lumbar, int top) const {
    Eigen::Vector3d up = Eigen::Vector3d::Zero();
    double weight = 0;
    for (int t = 0; top >= 0 && t < motion_.NumFrames(); ++t) {
      const Eigen::Vector3d middle =
          0.5 * (motion_.Position(t, kLeftHip) + motion_.Position(t, kRightHip));
      const Eigen::Vector3d trunk = (motion_.Position(t, top) - middle).normalized();
      const Eigen::Vector3d left =
          (motion_.Position(t, kLeftHip) - motion_.Position(t, 4)).normalized();
      const Eigen::Vector3d right =
          (motion_.Position(t, kRightHip) - motion_.Position(t, 5)).normalized();
      const double in_line =
          std::max(std::min(trunk.dot(left), trunk.dot(right)) - std::cos(35 * kDegree), 0.0);
      up +=
          in_line * in_line * motion_.Rotation(t, kPelvis).transpose() * (2 * trunk + left + right);
      weight += in_line * in_line;
    }
    const int spine = lumbar < 0 ? kSpine1 : lumbar;
    Eigen::Vector3d smplx =
        joints_.col(spine) - 0.5 * (joints_.col(kLeftHip) + joints_.col(kRightHip));
    if (const auto lean = motion_.Map().lumbar_lean) {
      smplx = Eigen::Vector3d(0, std::cos(*lean), -std::sin(*lean));
    }
    const Eigen::Vector3d source = motion_.Rest(lumbar < 0 ? kPelvis : lumbar) -
                                   0.5 * (motion_.Rest(kLeftHip) + motion_.Rest(kRightHip));
    const Eigen::Matrix3d by_spine =
        Frame(hips, source) * Frame(Eigen::Vector3d::UnitX(), smplx).transpose();
    // Each aligned limb adds at most 0.03: takes half a second of standing, longer if less aligned.
    if (weight < 0.005 * motion_.FrameRate() || Angle(up, hips) < 30 * kDegree) return by_spine;
    const Eigen::Matrix3d by_stance = Frame(hips, up);
    return AngleBetween(by_spine, by_stance) < 20 * kDegree ? by_spine : by_stance;
  }

  // Head whose rest pose is unrelated to the chest's: on average people look straight ahead and
  // level. A rest pose is trusted if it agrees with this within a long look aside.
  void Head(double trust) {
    const Eigen::Vector3d world_up = Eigen::Vector3d::UnitY();
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (int t = 0; t < motion_.NumFrames(); ++t) {
      const int trunk = motion_.Has(kSpine3) ? kSpine3 : kPelvis;
      const Eigen::Matrix3d chest = motion_.Rotation(t, trunk) * result_.source_from_smplx[trunk];
      const bool upright = Angle(chest.col(1), world_up) < 40 * kDegree;
      sum += motion_.Rotation(t, kHead).transpose() *
             (upright ? FrameFromUp(world_up, chest.col(2)) : chest);
    }
    const Eigen::Matrix3d average = NearestRotation(sum);
    auto& head = result_.source_from_smplx[kHead];
    if (AngleBetween(average, head) < trust) return;
    const Eigen::Vector3d neck =
        motion_.Has(kNeck) ? motion_.LocalBone(kNeck, kHead) : average.col(1);
    head = Rolled(head, neck, average);
    result_.neck_rests_with_head = false;
  }

  // Whether the lowest spine joint is plausibly placed over the hips if `axes` are the pelvis's.
  // Lumbar joints lie behind the hips' middle line: 0 to 60 degrees back from straight up.
  bool LumbarIsUpright(const Eigen::Matrix3d& axes) const {
    const int lumbar = motion_.Has(kSpine1) ? kSpine1 : motion_.Has(kSpine2) ? kSpine2 : kSpine3;
    if (!motion_.Has(lumbar)) return true;
    const Eigen::Vector3d hips = axes.transpose() * SourceRestBone(kRightHip, kLeftHip);
    const Eigen::Vector3d up =
        axes.transpose() *
        (motion_.Rest(lumbar) - 0.5 * (motion_.Rest(kLeftHip) + motion_.Rest(kRightHip)));
    if (Angle(hips, Eigen::Vector3d::UnitX()) > 8 * kDegree) return false;
    const double back = std::atan2(-up.z(), up.y());
    return back > -5 * kDegree && back < 60 * kDegree;
  }

  // Thigh and upper arm: direction from the bone, roll from the bending plane of the next bone.
  void Limb(int joint, int hinge, int end) {
    const Eigen::Vector3d rest = RestBone(joint, hinge).normalized();
    const int frames = motion_.NumFrames();
    Eigen::Vector3d local = Eigen::Vector3d::Zero();
    for (int t = 0; t < frames; ++t) {
      local += motion_.Rotation(t, joint).transpose() *
               (motion_.Position(t, hinge) - motion_.Position(t, joint));
    }
    const Eigen::Vector3d at_rest = SourceRestBone(joint, hinge);
    const bool rest_tells = Angle(axes_.transpose() * at_rest, rest) < 45 * kDegree;
    const Eigen::Matrix3d upright = LeastRotation(axes_ * rest, local) * axes_;

    const Eigen::Vector3d axis = HingeAxis(hinge);
    const Eigen::Vector3d zero = (axis - axis.dot(rest) * rest).normalized();
    const Eigen::Vector3d quarter = rest.cross(zero);
    double along_zero = rest_tells ? 0.02 * frames : 0, along_quarter = 0, weight = 0;
    for (int t = 0; t < frames; ++t) {
      const Eigen::Vector3d knee = motion_.Position(t, hinge);
      const Eigen::Vector3d bone = (knee - motion_.Position(t, joint)).normalized();
      const Eigen::Vector3d next = (motion_.Position(t, end) - knee).normalized();
      const Eigen::Vector3d bend = bone.cross(next);  // hinge axis times sine of the bend
      const Eigen::Vector3d seen =
          upright.transpose() * motion_.Rotation(t, joint).transpose() * bend;
      along_zero += bend.norm() * seen.dot(zero);
      along_quarter += bend.norm() * seen.dot(quarter);
      weight += bend.squaredNorm();
    }
    if (!rest_tells && weight < 1e-3 * frames) {
      // Never bent, and no usable rest pose: the smallest roll relative to the trunk.
      const int trunk = joint < 3 ? kPelvis : kSpine3;
      for (int t = 0; t < frames; ++t) {
        const Eigen::Matrix3d above = motion_.Rotation(t, trunk) * result_.source_from_smplx[trunk];
        const Eigen::Matrix3d least =
            LeastRotation(above * rest, motion_.Rotation(t, joint) * upright * rest) * above;
        const Eigen::Vector3d seen =
            upright.transpose() * motion_.Rotation(t, joint).transpose() * least * zero;
        along_zero += seen.dot(zero);
        along_quarter += seen.dot(quarter);
      }
    }
    const double roll = std::atan2(along_quarter, along_zero);
    result_.source_from_smplx[joint] = upright * ExpSO3(roll * rest);
  }

  // Hands: from their knuckles; else their end sites; else their forearms.
  void Hand(int wrist) {
    const int begin = wrist == 20 ? kLeftHandBegin : kRightHandBegin;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    int knuckles = 0;
    for (const int finger : {0, 3, 6, 9}) {
      const int joint = begin + finger;
      if (!motion_.Has(joint)) continue;
      const Eigen::Vector3d source = SourceRestBone(wrist, joint);
      if (Meters(source) < 0.01) continue;
      covariance += source.normalized() * RestBone(wrist, joint).normalized().transpose();
      ++knuckles;
    }
    auto& correction = result_.source_from_smplx[wrist];
    if (knuckles >= 2) {
      correction = NearestRotation(covariance);
      return;
    }
    const int elbow = wrist - 2, shoulder = wrist - 4, middle = begin + 3;
    const Eigen::Vector3d tip = motion_.Tip(wrist);
    const Eigen::Vector3d forearm = motion_.LocalBone(elbow, wrist);
    // Bones along their own axes may point aside by coincidence.
    const bool rests_in_t = (result_.torso_rests_upright || !LiesAlongAxis(forearm)) &&
                            Angle(axes_.transpose() * SourceRestBone(elbow, wrist),
                                  RestBone(elbow, wrist)) < 45 * kDegree &&
                            Angle(axes_.transpose() * SourceRestBone(shoulder, elbow),
                                  RestBone(shoulder, elbow)) < 45 * kDegree;
    if (rests_in_t) {
      const Eigen::Vector3d rest = RestBone(wrist, middle).normalized();
      correction = Meters(tip) > 0.005 ? LeastRotation(axes_ * rest, tip) * axes_ : axes_;
      return;
    }
    // Without an end site, the hand continues the forearm where its joint does not rotate.
    const auto [mean_axes, mean_forearm] = MeanHandOf(wrist);
    const bool has_tip = tip.norm() > kMinTip * forearm.norm();
    const Eigen::Vector3d rest = has_tip ? RestBone(wrist, middle) : RestBone(elbow, wrist);
    Eigen::Vector3d along = has_tip ? tip : forearm;
    if (!has_tip && Angle(along, mean_forearm) > kWristTrust) along = mean_forearm;

    Eigen::Matrix3d axes = mean_axes;
    if (result_.shaped_like_smplx || result_.torso_rests_upright || LiesAlongAxis(forearm)) {
      const Eigen::Matrix3d at_rest = ForearmAtRest(wrist);
      axes = AngleBetween(at_rest, mean_axes) < kRestTrust ? at_rest
                                                           : Rolled(at_rest, forearm, mean_axes);
    }
    correction = LeastRotation(axes * rest, along) * axes;
  }

  // Axes of a forearm whose elbow only bends in the rest pose.
  Eigen::Matrix3d ForearmAtRest(int wrist) const {
    const int elbow = wrist - 2, shoulder = wrist - 4;
    const Eigen::Matrix3d& chest =
        result_.source_from_smplx[motion_.Has(kSpine3) ? kSpine3 : kPelvis];
    const Eigen::Matrix3d upper =
        LeastRotation(chest * RestBone(shoulder, elbow), motion_.LocalBone(shoulder, elbow)) *
        chest;
    return BendHinge(elbow, upper, RestBone(elbow, wrist), motion_.LocalBone(elbow, wrist));
  }

  // Axes of a hand whose forearm has no roll on average, and the forearm's direction in the hand's
  // frame.
  std::pair<Eigen::Matrix3d, Eigen::Vector3d> MeanHandOf(int wrist) const {
    const int elbow = wrist - 2, shoulder = wrist - 4;
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    Eigen::Vector3d forearm = Eigen::Vector3d::Zero();
    for (int t = 0; t < motion_.NumFrames(); ++t) {
      const Eigen::Vector3d direction =
          (motion_.Position(t, wrist) - motion_.Position(t, elbow)).normalized();
      const Eigen::Matrix3d above =
          motion_.Rotation(t, shoulder) * result_.source_from_smplx[shoulder];
      const Eigen::Matrix3d to_hand = motion_.Rotation(t, wrist).transpose();
      sum += to_hand * BendHinge(elbow, above, RestBone(elbow, wrist), direction);
      forearm += to_hand * direction;
    }
    return {NearestRotation(sum), forearm};
  }

  // Feet: flat while they are on the ground in the motion. A standing rest pose is almost as
  // reliable, and handles motions that are only on tiptoe.
  void Foot(int ankle, int foot) {
    const int hip = ankle - 6, knee = ankle - 3;
    const bool has_foot = motion_.Has(foot);
    const Eigen::Vector3d sole(RestBone(ankle, foot).x(), 0, RestBone(ankle, foot).z());
    auto& ankle_correction = result_.source_from_smplx[ankle];
    auto& foot_correction = result_.source_from_smplx[foot];
    const Eigen::Vector3d at_rest = has_foot ? SourceRestBone(ankle, foot) : motion_.Tip(ankle);
    const Eigen::Vector3d shin = axes_.transpose() * SourceRestBone(knee, ankle);
    const bool rest_tells =
        result_.torso_rests_upright &&
        Angle(axes_.transpose() * SourceRestBone(hip, knee), RestBone(hip, knee)) < 45 * kDegree &&
        Angle(shin, RestBone(knee, ankle)) < 45 * kDegree &&
        Angle(axes_.transpose() * at_rest, RestBone(ankle, foot)) < 45 * kDegree;
    // Feet of skeletons that rest with legs apart lean with the shin.
    const Eigen::Matrix3d rest = axes_ * LeastRotation(RestBone(knee, ankle), shin);
    if (rest_tells) ankle_correction = foot_correction = rest;

    const std::vector<double> weight = StandingWeights(ankle, has_foot ? foot : ankle);
    Eigen::Vector3d ankle_up = Eigen::Vector3d::Zero(), forward = ankle_up, foot_up = ankle_up;
    for (int t = 0; t < motion_.NumFrames(); ++t) {
      const Eigen::Matrix3d to_local = motion_.Rotation(t, ankle).transpose();
      const Eigen::Vector3d leg =
          (motion_.Position(t, knee) - motion_.Position(t, ankle)).normalized();
      // A small contribution of the shin's direction decides for motions that never stand.
      ankle_up += weight[t] * to_local.col(1) + 1e-3 * to_local * leg;
      if (has_foot) {
        forward += to_local * (motion_.Position(t, foot) - motion_.Position(t, ankle));
        const Eigen::Matrix3d to_toes = motion_.Rotation(t, foot).transpose();
        foot_up += weight[t] * to_toes.col(1) + 1e-3 * to_toes * leg;
      }
    }
    if (!has_foot) forward = motion_.Tip(ankle);
    const Eigen::Matrix3d flat = FrameFromUp(Eigen::Vector3d::UnitY(), sole);
    const auto take = [&](const Eigen::Vector3d& up, const Eigen::Vector3d& ahead,
                          Eigen::Matrix3d& correction) {
      if (Meters(ahead) < 0.005 || Angle(up, ahead) < 20 * kDegree) return;
      const Eigen::Matrix3d standing = FrameFromUp(up, ahead) * flat.transpose();
      if (rest_tells && AngleBetween(standing, rest) > kFootTrust) return;
      correction = standing;
    };
    take(ankle_up, forward, ankle_correction);
    if (!has_foot || !rest_tells) foot_correction = ankle_correction;
    if (has_foot) take(foot_up, motion_.Tip(foot), foot_correction);
    if (has_foot && result_.shaped_like_smplx) {
      ankle_correction =
          LeastRotation(ankle_correction * RestBone(ankle, foot), motion_.LocalBone(ankle, foot)) *
          ankle_correction;
    }
  }

  // 1 where the foot is still and low, else 0.
  std::vector<double> StandingWeights(int ankle, int foot) const {
    const int frames = motion_.NumFrames();
    std::vector<double> height(frames), sorted, weight(frames, 0.0);
    for (int t = 0; t < frames; ++t) {
      height[t] = unit_ * (motion_.Position(t, ankle).y() + motion_.Position(t, foot).y());
    }
    sorted = height;
    std::nth_element(sorted.begin(), sorted.begin() + frames / 10, sorted.end());
    const double low = sorted[frames / 10];
    for (int t = 0; t < frames; ++t) {
      const int before = std::max(t - 1, 0), after = std::min(t + 1, frames - 1);
      const double span = std::max(after - before, 1) / motion_.FrameRate();
      const double speed =
          Meters(motion_.Position(after, ankle) - motion_.Position(before, ankle)) / span;
      if (height[t] < low + 0.04 && speed < 0.25) weight[t] = 1;
    }
    return weight;
  }

  const MappedMotion& motion_;
  const Eigen::Matrix3Xd& joints_;
  Eigen::Matrix3d axes_ = Eigen::Matrix3d::Identity();  // source axes at rest from SMPL-X's
  double unit_ = 1;  // body meters per meter of the source, if its unit is wrong
  RetargetCalibration result_;
};

}  // namespace

Eigen::Matrix3d UprightFrom(UpAxis up) {
  if (up == UpAxis::kMinusY) return Eigen::Vector3d(1, -1, -1).asDiagonal();
  const int axis = static_cast<int>(up) / 2;
  const double sign = static_cast<int>(up) % 2 == 0 ? 1 : -1;
  return RotationBetween(sign * Eigen::Vector3d::Unit(axis), Eigen::Vector3d::UnitY())
      .toRotationMatrix()
      .unaryExpr([](double x) { return std::round(x); });  // entries are exactly -1, 0 and 1
}

MappedMotion::MappedMotion(const SourceMotion& motion, const SkeletonMap& map, UpAxis up)
    : motion_(motion), map_(map), upright_(UprightFrom(up)) {
  const int num_joints = motion.NumJoints();
  rest_ = motion.rest_offsets;
  for (int j = 1; j < num_joints; ++j) rest_.col(j) += rest_.col(motion.parents[j]);

  for (int j = 0; j < kNumJoints; ++j) {
    turner_[j] = map.source[j];
    tip_[j].setZero();
    if (map.source[j] < 0) continue;
    // Roll bones lie between a joint and the next mapped one: the last has the full rotation.
    for (int c = j + 1; c < kNumJoints; ++c) {
      const bool limb = j == 1 || j == 2 || j == 4 || j == 5 || (j >= 16 && j <= 19);
      if (!limb || kJointParents[c] != j || map.source[c] < 0) continue;
      turner_[j] = motion.parents[map.source[c]];
    }
    double longest = 0;
    const auto consider = [&](const Eigen::Vector3d& offset) {
      if (offset.norm() > longest) {
        longest = offset.norm();
        tip_[j] = offset;
      }
    };
    for (int s = 0; s < num_joints; ++s) {
      if (motion.parents[s] == turner_[j]) consider(motion.rest_offsets.col(s));
    }
    for (const auto& site : motion.end_sites) {
      if (site.parent == turner_[j]) consider(site.offset);
    }
  }
}

Eigen::Vector3d MappedMotion::LocalBone(int from, int to) const {
  constexpr int kMaxFrames = 1000;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const int step = NumFrames() / kMaxFrames + 1;
  int count = 0;
  for (int t = 0; t < NumFrames(); t += step, ++count) {
    sum += Rotation(t, from).transpose() * (Position(t, to) - Position(t, from));
  }
  return sum / count;
}

bool MappedMotion::HangsDirectly(int joint) const {
  return motion_.parents[map_.source[joint]] == map_.source[kJointParents[joint]];
}

RetargetCalibration Calibrate(const MappedMotion& motion, const RetargetBody& body) {
  return Calibrator(motion, body).Run();
}

Eigen::Matrix3d LeastRotation(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return RotationBetween(from, to).toRotationMatrix();
}

Eigen::Vector3d HingeAxis(int joint) {
  if (joint < 16) return Eigen::Vector3d::UnitX();
  return joint == 18 ? Eigen::Vector3d(-Eigen::Vector3d::UnitY())
                     : Eigen::Vector3d(Eigen::Vector3d::UnitY());
}

Eigen::Matrix3d BendHinge(int joint, const Eigen::Matrix3d& above, const Eigen::Vector3d& rest_bone,
                          const Eigen::Vector3d& direction) {
  const Eigen::Vector3d local = above.transpose() * direction;
  const Eigen::Vector3d axis = HingeAxis(joint);
  const double bend = std::atan2(axis.dot(rest_bone.cross(local)),
                                 rest_bone.dot(local) - axis.dot(rest_bone) * axis.dot(local));
  const Eigen::Matrix3d bent = above * ExpSO3(bend * axis);
  return LeastRotation(bent * rest_bone, direction) * bent;
}

double TwistAngle(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& axis) {
  const Eigen::Quaterniond q(rotation);
  const double angle = 2 * std::atan2(q.vec().dot(axis), q.w());
  return std::remainder(angle, 2 * std::numbers::pi);
}

}  // namespace holdfast
