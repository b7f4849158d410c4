// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <span>

#include <Eigen/Core>

#include "generator/actions/face_marks.h"
#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"

namespace holdfast {

/// What a frame asks of a head that nobody measured.
struct HeadWish {
  std::optional<Eigen::Vector3d> lips;             ///< where they are to be: world, meters
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();  ///< added to the rest of neck and head together
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd(3, 0);  ///< of things that keep out of it, world
};

struct HeadReport {
  int deep_before = 0, deep = 0;  ///< frames with a hand or forearm deeper than 2 mm in the head
  double worst_before_m = 0.0, worst_m = 0.0;
  int moved = 0;            ///< frames
  double turned_rad = 0.0;  ///< most of neck and head together
};

/// Where lips meet what is drunk from, in the head's frame: a little below the middle of the mouth,
/// off the skin.
Eigen::Vector3d LipsOf(const FaceMarks& face);

/// Turns neck and head, which no marker is on, away from hands, forearms and the wishes' points
/// (HeadPlace), and brings the lips where they are wished for: all frames at once, near the clip's
/// own pose and within the neck's range, by accelerations that necks make. Frames that are farther
/// than half a second from any such thing keep their bits. `wishes`: T, or empty. Throws Error for
/// a body without a head (FindFaceMarks).
HeadReport PoseUnmarkedHead(const std::shared_ptr<const BodyModel>& model,
                            const Eigen::VectorXd& betas, std::span<const HeadWish> wishes,
                            Clip& clip);

}  // namespace holdfast
