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

/// Constraints of one frame on an unmeasured head.
struct HeadWish {
  std::optional<Eigen::Vector3d> lips;             ///< target of the lips: world, meters
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();  ///< added to the rest of neck and head together
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd(3, 0);  ///< of objects to keep out of the head, world
};

struct HeadReport {
  int deep_before = 0, deep = 0;  ///< frames with a hand or forearm deeper than 2 mm in the head
  double worst_before_m = 0.0, worst_m = 0.0;
  int moved = 0;            ///< frames
  double turned_rad = 0.0;  ///< maximum of neck and head together
};

/// Contact point of the lips with a drinking vessel, in the head's frame: slightly below the middle
/// of the mouth, off the skin.
Eigen::Vector3d LipsOf(const FaceMarks& face);

/// Rotates an unmarked neck and head away from hands, forearms and the points of `wishes`
/// (HeadPlace), and moves the lips to their targets: all frames at once, near the clip's pose,
/// within the neck's range and with plausible accelerations. Frames more than half a second from
/// any such constraint are unchanged, bit for bit. `wishes`: T, or empty. Throws Error for a body
/// without a head (FindFaceMarks).
HeadReport PoseUnmarkedHead(const std::shared_ptr<const BodyModel>& model,
                            const Eigen::VectorXd& betas, std::span<const HeadWish> wishes,
                            Clip& clip);

}  // namespace holdfast
