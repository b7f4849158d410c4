// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "generator/scripted/reach_motion.h"
#include "generator/wandr/pose.h"
#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"

namespace holdfast {

/// The person who reaches, and the motion so far.
struct ReachPerson {
  std::shared_ptr<const BodyModel> body;
  Eigen::VectorXd betas;
  Clip like;  ///< body, betas and subject of generated clips
  BodyMeasures measures;
  wandr::BoneOffsets<double> bones;
  wandr::StateMatrix<double> states;  ///< at 30 Hz; the motion continues from the last

  int Frame() const { return static_cast<int>(states.cols()) - 1; }
  /// World, in the last of those frames.
  Eigen::Vector3d Pelvis() const;
  /// Maximum height of a wrist with both soles on the ground, meters.
  double HighestReach(Side side) const;
};

/// Stands at the origin, facing -y. Throws Error for a hand alone.
ReachPerson StandingPerson(std::shared_ptr<const BodyModel> body);

/// Continues from this frame of a clip (at the clip's rate, from 0); default: the last one. Throws
/// Error, named `source`, for a missing frame, positions that are not in meters, and a hand alone.
ReachPerson PersonInClip(Clip clip, const ClipBody& body, std::optional<int> frame = {},
                         const std::string& source = "the clip");

/// Measures of the person mirrored at x = 0 (wandr::MirroredBones): the network reaches with the
/// right wrist, so for the left one everything is mirrored.
BodyMeasures MirroredMeasures(const BodyMeasures& measures);

}  // namespace holdfast
