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
#include "geometry/score/contact_metrics.h"
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

/// A grasp that the user gives in place of a search, such as an estimate of GOAL or GrabNet (IMoS
/// starts from GOAL's, sec. 4.3).
struct GivenGrasp {
  std::string source;  ///< the file
  Side side = Side::kRight;
  FingerPose fingers = FingerPose::Zero();
  Eigen::Isometry3d wrist_from_object = Eigen::Isometry3d::Identity();
  std::vector<std::string> warnings;
};

/// Reads the hand, relative to the object, in the first frame of a file in which it holds: a clip
/// (as of 'holdfast grasp'), or parameters of a body (GOAL) or of a hand alone (GrabNet) that
/// LoadClip reads; `body` is their model. World frames stay as they are. Without an object pose the
/// hand is in the object's frame, with a warning. `side`: none: as the file says, else right.
/// Throws Error as LoadClip does, and for a hand alone of the other side.
GivenGrasp ReadGivenGrasp(const std::string& file, std::shared_ptr<const BodyModel> body,
                          std::optional<Side> side);

/// Grasp in a clip's first frame.
struct FirstGrasp {
  bool made = false;              ///< else taken from the clip
  bool found = false;             ///< a grasp was found, though it may not be clean
  bool clean = true;              ///< else it is the least bad try
  std::string status;             ///< message for the user
  std::optional<Grasp> one;       ///< for one hand
  GraspUse use = GraspUse::kAny;  ///< assumed use of the object, for one hand
  std::optional<BothHandsGrasp> both;
  std::optional<ContactMetrics> given;  ///< contact of a given grasp
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

/// Puts a given grasp into the clip's first frame, as GraspInFirstFrame does with its own. It is
/// not `clean` if no skin is within 5 mm of the object, or if skin is deeper than 10 mm in it.
FirstGrasp TakeGivenGrasp(const HandModel& hand, const PreparedObject& object,
                          const GivenGrasp& given, int threads, Clip& clip);

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
