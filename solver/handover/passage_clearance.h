// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/distance_grid.h"
#include "solver/hand/hand_postures.h"
#include "solver/handover/grasps_by_transfer.h"
#include "solver/handover/holds.h"
#include "solver/unknowns/wrist_offset.h"

namespace holdfast {

/// A hand in one frame of its way to a hold or from it, relative to the object.
struct PassageFrame {
  int t = 0;
  FingerPose fingers = FingerPose::Zero();
  Eigen::Matrix3Xd skin;   ///< SkinPositions, wrist's frame
  Eigen::Matrix4Xd balls;  ///< HandBalls, wrist's frame
  Eigen::Isometry3d object_from_wrist = Eigen::Isometry3d::Identity();  ///< without a retreat
  Eigen::Matrix4Xd other;  ///< the other hand's HandBalls, object's frame; may be empty
  double retreat = 0.0;    ///< meters
};

/// How deep a hand is on its way, beyond what it is in the hold itself, and by how much it has to
/// keep off along a line to be clear. Counted are skin in the object, the object's walls in the
/// hand's balls (a wall thinner than a finger goes through it with no skin inside for more than
/// half its thickness), and skin in the other hand's balls, by half and less 2 mm: hands are soft.
class PassageClearance {
 public:
  /// `held`: the hand in the hold, which begins or ends in that frame. What it is given must
  /// outlive it.
  PassageClearance(const HandAnatomy& anatomy, const DistanceGrid& object, const PassageFrame& held,
                   double frame_rate);

  /// Meters; 0: clear. The hand is moved by `shift`, object's frame, meters.
  double TooDeep(const PassageFrame& frame, const Eigen::Vector3d& shift) const;

  /// Sets the least retreats along `line` (unit, object's frame) that clear all frames, as far as
  /// that is worth it; they come and go smoothly and are 0 in the hold. `frames` go outwards from
  /// the one next to the hold; while the first `opening` open their fingers, they are not adjusted
  /// because of later ones. Returns what the way costs, meters: retreats, and 30 a meter of depth.
  double Retreat(const Eigen::Vector3d& line, int opening, std::span<PassageFrame> frames) const;

 private:
  double InObject(const PassageFrame& frame, const Eigen::Isometry3d& object_from_wrist) const;
  double OfWalls(const PassageFrame& frame, const Eigen::Isometry3d& object_from_wrist) const;
  double InOther(const PassageFrame& frame, const Eigen::Isometry3d& object_from_wrist) const;
  double LeastRetreat(const PassageFrame& frame, const Eigen::Vector3d& line) const;
  void Smooth(const std::vector<double>& needed, int opening, std::span<PassageFrame> frames) const;

  const HandAnatomy& anatomy_;
  const DistanceGrid& object_;
  int edge_;
  double frame_rate_;
  double in_object_, in_other_;  // of the hold
  Eigen::VectorXd of_walls_;     // of each ball in the hold
};

/// Where a wrist is in the frames next to those of a way; nothing beyond the ends of the clip.
struct WayEnds {
  std::optional<Eigen::Vector3d> two_before, before, after, two_after;
};

/// A way of a wrist with less acceleration: of all paths x the one that minimizes
///
///   sum_k |x_{k-1} - 2 x_k + x_{k+1}|^2 + sum_k w_k |x_k - way_k|^2,
///
/// where w_k begins at 1e-3 (the path follows the way over about six frames) and grows wherever
/// `is_clear(k, x_k)` says that the hand would be in something, until it is so nowhere.
/// `way` is 3 x K, one frame a column, clear by itself; where easing does not become clear, it
/// comes back as it is.
Eigen::Matrix3Xd EasedWay(const Eigen::Matrix3Xd& way, const WayEnds& ends,
                          const std::function<bool(int, const Eigen::Vector3d&)>& is_clear);

/// How two wrists leave the clip's to hold one object, each in its own frame.
struct HandMeeting {
  WristOffset giver, receiver;
};

/// The wrists that are as far apart as a hand-over needs and nearest to where they are:
///
///   min E(R_g', p_g'; R_g, p_g) + E(R_r', p_r'; R_r, p_r)   (ObjectData)
///
/// where (R_g', p_g')^-1 (R_r', p_r') = `giver_from_receiver`; `giver` (R_g, p_g) and `receiver`
/// are the world poses of the clip's wrists, meters. So both move by the same length.
HandMeeting SplitCorrection(const Eigen::Isometry3d& giver, const Eigen::Isometry3d& receiver,
                            const Eigen::Isometry3d& giver_from_receiver);

/// Both arms of `clip` go to where its hands meet for each hand-over (SplitCorrection), stay there
/// while both hold, and come and go smoothly (minimum jerk over up to 1 s, not before both last
/// held). Without 0.3 s to come, and for hand-overs of no switch, the clip stays as it is.
void LetHandsMeet(const HandModel& right, const HandModel& left,
                  std::span<const HandSwitch> switches, std::span<const Handover> handovers,
                  Clip& clip);

/// How far `hand`'s wrist is in `to` from where `from` has it, in frames [begin, end).
WristChange LargestChange(const HandModel& hand, const Clip& from, const Clip& to, int begin,
                          int end);

}  // namespace holdfast
