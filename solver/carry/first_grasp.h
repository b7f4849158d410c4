// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/body_model.h"
#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "solver/fit/fit.h"
#include "solver/fit/prepared_object.h"
#include "solver/grasp/grasp.h"
#include "solver/grasp/grasp_both.h"

namespace holdfast {

enum class GraspHands { kAuto, kRight, kLeft, kBoth };

/// Throws FitFailure if no hand, or with `both` no two hands, can hold the object anywhere: no part
/// of it is within their span. Fast; needs no preparation. Throws Error for an object that is not
/// of a size for a hand (RequireHandheld).
void RequireGraspable(const LoadedObject& object, bool both);

/// Grasp in a clip's first frame.
struct FirstGrasp {
  bool made = false;         ///< else taken from the clip
  bool found = false;        ///< a grasp was found, though it may not be clean
  bool clean = true;         ///< else it is the least bad try
  std::string status;        ///< message for the user
  std::optional<Grasp> one;  ///< for one hand
  std::optional<BothHandsGrasp> both;
  double through_body = 0.0;  ///< fraction of the clip's frames in which the object meets the body
  double search_ms = 0.0;
  std::vector<std::string> warnings;
  /// For both hands (right, left): each grasp relative to the clip's wrists, which are not changed.
  std::optional<std::array<GraspPose, 2>> poses;
};

struct FirstGraspOptions {
  std::optional<GraspStyle> style;          ///< none: any
  std::shared_ptr<const GraspPlace> place;  ///< null: anywhere
  std::uint64_t seed = 1;
  int threads = 1;
  std::optional<GraspUse> use;  ///< none: as people grasp it
  /// Score added to that of a clean grasp, e.g. for later stages; none: nothing.
  std::function<double(const Grasp&)> also = {};
  /// With `also`: whether the later stages succeed with a grasp. Slow, so only the few best are
  /// checked, and the first feasible one is taken; none: all are feasible.
  std::function<bool(const Grasp&)> serves = {};
};

/// Closes a hand around the object in the clip's first frame, and writes fingers and object into
/// that frame. The object avoids the body along the clip; collisions are reported for the first
/// `held_frames`, while this hand alone holds it. The clip is unchanged if `found` is false.
FirstGrasp GraspInFirstFrame(const HandModel& hand, const PreparedObject& object,
                             const BodySurface& body, int held_frames,
                             const FirstGraspOptions& options, Clip& clip,
                             const GraspProgress& progress = {});

/// The same with the object between both hands: the arms have to move to it (`poses`).
FirstGrasp HoldInFirstFrame(const HandModel& right, const HandModel& left,
                            const PreparedObject& object, const BodySurface& body,
                            const FirstGraspOptions& options, Clip& clip);

/// Center of the palm: 8 cm from the wrist along the fingers, in the target frame of `wrist`.
Eigen::Vector3d PalmOf(Side side, const Eigen::Isometry3d& wrist);

/// Trajectories of both palms and the head, from joints.
struct PalmTracks {
  std::array<Eigen::Matrix3Xd, 2> at;                  ///< right, left: 3 x T, world, meters
  std::vector<Eigen::Isometry3d> head;                 ///< T, world from head joint
  Eigen::Vector3d forward = Eigen::Vector3d::UnitX();  ///< mean of the chest, horizontal
  double frame_rate = 30.0;

  const Eigen::Matrix3Xd& Of(Side side) const { return at[side == Side::kRight ? 0 : 1]; }
  /// Speed of a palm: T, meters per second, over 0.04 s to either side.
  Eigen::VectorXd Speed(Side side) const;
};
PalmTracks TrackPalms(const Clip& clip, const Eigen::Matrix3Xd& rest_joints);

}  // namespace holdfast
