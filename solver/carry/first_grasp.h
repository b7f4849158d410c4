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

/// Why no hand, or with `both` no two hands, can hold the object wherever they take it: nothing of
/// it is within their span. Nothing where some of it is. Fast, before anything is prepared. Throws
/// Error for an object that is not a size for a hand (RequireHandheld).
std::optional<std::string> WhyTooLarge(const LoadedObject& object, bool both);

/// How an object came into the hand in a clip's first frame.
struct FirstGrasp {
  bool made = false;         ///< else the clip had one
  bool found = false;        ///< there is something to carry on with, if not a clean grasp
  bool clean = true;         ///< else the least bad try was found
  std::string status;        ///< for people
  std::optional<Grasp> one;  ///< of one hand
  std::optional<BothHandsGrasp> both;
  double through_body = 0.0;  ///< share of the clip's frames in which the object meets the body
  double search_ms = 0.0;
  std::vector<std::string> warnings;
  /// Of both hands: how each (right, left) takes hold, relative to the clip's wrists, which stay.
  std::optional<std::array<GraspPose, 2>> poses;
};

struct FirstGraspOptions {
  std::optional<GraspStyle> style;          ///< none: whichever suits
  std::shared_ptr<const GraspPlace> place;  ///< null: wherever it suits
  std::uint64_t seed = 1;
  int threads = 1;
  std::optional<GraspUse> use;  ///< none: as people take it
  /// What a clean grasp is worth besides its score, such as what comes after; none: nothing.
  std::function<double(const Grasp&)> also = {};
  /// With `also`: whether what comes after succeeds with a grasp. Slow, so that the few of most
  /// worth are asked, and the first that serves is taken; none: all do.
  std::function<bool(const Grasp&)> serves = {};
};

/// Closes a hand around the object in the clip's first frame, and writes fingers and object into
/// that frame. The object keeps clear of the body along the clip; told is what meets it in the
/// first `held_frames`, while this hand alone holds it. The clip is left alone when `found` is
/// false.
FirstGrasp GraspInFirstFrame(const HandModel& hand, const PreparedObject& object,
                             const BodySurface& body, int held_frames,
                             const FirstGraspOptions& options, Clip& clip,
                             const GraspProgress& progress = {});

/// The same with the object between both hands: the arms have to go to it (`poses`).
FirstGrasp HoldInFirstFrame(const HandModel& right, const HandModel& left,
                            const PreparedObject& object, const BodySurface& body,
                            const FirstGraspOptions& options, Clip& clip);

/// The middle of the palm: 8 cm from the wrist along the fingers, in the frame of `wrist`'s target.
Eigen::Vector3d PalmOf(Side side, const Eigen::Isometry3d& wrist);

/// Both palms and the head over time, from joints.
struct PalmTracks {
  std::array<Eigen::Matrix3Xd, 2> at;                  ///< right and left: 3 x T, world, meters
  std::vector<Eigen::Isometry3d> head;                 ///< T, world from the head's joint
  Eigen::Vector3d forward = Eigen::Vector3d::UnitX();  ///< of the chest in the mean, level
  double frame_rate = 30.0;

  const Eigen::Matrix3Xd& Of(Side side) const { return at[side == Side::kRight ? 0 : 1]; }
  /// Of a palm: T, meters a second, between 0.04 s to either side.
  Eigen::VectorXd Speed(Side side) const;
};
PalmTracks TrackPalms(const Clip& clip, const Eigen::Matrix3Xd& rest_joints);

}  // namespace holdfast
