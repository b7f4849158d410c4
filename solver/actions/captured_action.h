// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include <Eigen/Core>

#include "generator/actions/face_marks.h"
#include "generator/matching/body_frame.h"
#include "generator/scripted/reach_motion.h"
#include "geometry/clip/clip.h"
#include "solver/markers/marked_person.h"

namespace holdfast {

/// What a captured arm does, in frames of its clip: reach [begin, act), act [act, back), return
/// [back, end).
struct CapturedAction {
  std::string action;  ///< "drink", or "brush" for a hand that goes over the head
  Side side = Side::kRight;
  int begin = 0, act = 0;
  int key = 0;  ///< the palm is nearest to the mouth, or half way over the head
  int back = 0, end = 0;
};

/// A person as captured: joints (3 x 55) and face of the rest pose.
struct CapturedPerson {
  Eigen::Matrix3Xd rest_joints;
  FaceMarks face;
};

/// Finds an arm that drinks (FindDrink), or one whose palm goes over the head: within 10 cm of its
/// skin, higher than the mouth, and there 8 cm behind the eyes at some time. The reach begins, and
/// the return ends, where the palm is slower than a tenth of its highest speed, with 0.3 s more of
/// rest. Nothing where nobody does either.
std::optional<CapturedAction> FindCapturedAction(const Clip& clip, const CapturedPerson& person);

/// Frames [begin, end) of a capture on another body, which faces -y, feet on the ground: trunk,
/// arms, hands, head and timing as captured, by joint angles; near the face the wrist of `side` is
/// where it was from the mouth (drink) or the eyes. Legs are the capture's own where `posture` is
/// seated, else those of `standing`, a frame of somebody who stands facing -y. The clip has frame
/// rate, body and motion; betas are the caller's.
Clip RetargetCaptured(const Clip& clip, const CapturedAction& action, const CapturedPerson& from,
                      const BodyMeasures& body, const FaceMarks& face, RestPosture posture,
                      const BodyFrame& standing);

}  // namespace holdfast
