// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/distance_grid.h"
#include "solver/hand/hand_landmarks.h"
#include "solver/handover/grasps_by_transfer.h"
#include "solver/handover/holds.h"
#include "solver/unknowns/wrist_offset.h"

namespace holdfast {

/// A hand in one frame of its path to or from a hold, relative to the object.
struct PassageFrame {
  int t = 0;
  FingerPose fingers = FingerPose::Zero();
  Eigen::Matrix3Xd skin;   ///< SkinPositions, wrist frame
  Eigen::Matrix4Xd balls;  ///< HandBalls, wrist frame
  Eigen::Isometry3d object_from_wrist = Eigen::Isometry3d::Identity();  ///< without retreat
  Eigen::Matrix4Xd other;  ///< the other hand's HandBalls, object frame; may be empty
  double retreat = 0.0;    ///< meters
};

/// Penetration of a hand on its path in excess of the hold itself, and the retreat along a line
/// that clears it. Counts skin in the object, the object's walls in the hand's balls (a wall
/// thinner than a finger passes through it with no skin deeper than half the wall's thickness), and
/// skin in the other hand's balls, by half and minus 2 mm, since hands are soft.
class PassageClearance {
 public:
  /// `held`: the hand in the first or last frame of the hold. The arguments must outlive it.
  PassageClearance(const HandAnatomy& anatomy, const DistanceGrid& object, const PassageFrame& held,
                   double frame_rate);

  /// Excess penetration, meters; 0: clear. The hand is moved by `shift`, object frame, meters.
  double TooDeep(const PassageFrame& frame, const Eigen::Vector3d& shift) const;

  /// Sets the minimum retreats along `line` (unit, object frame) that clear all frames, as far as
  /// this is worth it; they start and end smoothly and are 0 in the hold. `frames` go outwards from
  /// the hold; the first `opening` of them, in which the fingers open, are not adjusted for later
  /// ones. Returns the cost of the path, meters: retreats, plus 30 per meter of depth.
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

/// Wrist positions in the two frames before a path and the two after it, in temporal order; none
/// beyond the ends of the clip.
using WayEnds = std::array<std::optional<Eigen::Vector3d>, 4>;

/// Returns a wrist path with less acceleration: the path x that minimizes
///
///   sum_k |x_{k-1} - 2 x_k + x_{k+1}|^2 + sum_k w_k |x_k - way_k|^2,
///
/// where w_k starts at 1e-3 (the path follows `way` over about six frames) and grows wherever
/// `is_clear(k, x_k)` reports a collision, until there is none. `way` is 3 x K, one frame per
/// column, and collision-free; it is returned unchanged if no eased path is clear.
Eigen::Matrix3Xd EasedWay(const Eigen::Matrix3Xd& way, const WayEnds& ends,
                          const std::function<bool(int, const Eigen::Vector3d&)>& is_clear);

/// Finds the wrist poses with the relative pose of a handover that are nearest to the current ones:
///
///   min E(R_g', p_g'; R_g, p_g) + E(R_r', p_r'; R_r, p_r)   (ObjectData)
///
/// subject to (R_g', p_g')^-1 (R_r', p_r') = `giver_from_receiver`; `giver` (R_g, p_g) and
/// `receiver` are the world poses of the clip's wrists, meters. Hence both move by the same
/// distance. Returns the deviations of giver and receiver from these poses, each in its own frame.
std::pair<WristOffset, WristOffset> SplitCorrection(const Eigen::Isometry3d& giver,
                                                    const Eigen::Isometry3d& receiver,
                                                    const Eigen::Isometry3d& giver_from_receiver);

/// Moves both arms of `clip` to the meeting pose of each handover (SplitCorrection), keeps them
/// there while both hold, and blends smoothly (minimum jerk over up to 1 s, not before the end of
/// the previous time both held). With less than 0.3 s before it, or without a switch for the
/// handover, the clip is unchanged.
void LetHandsMeet(const HandModel& right, const HandModel& left,
                  std::span<const HandSwitch> switches, std::span<const Handover> handovers,
                  Clip& clip);

/// Maximum deviation of `hand`'s wrist in `to` from that in `from`, in frames [begin, end).
WristChange LargestChange(const HandModel& hand, const Clip& from, const Clip& to, int begin,
                          int end);

}  // namespace holdfast
