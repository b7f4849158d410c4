// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "generator/actions/face_marks.h"
#include "generator/actions/standing_start.h"
#include "generator/matching/body_frame.h"
#include "generator/scripted/reach_motion.h"
#include "geometry/clip/clip.h"
#include "solver/actions/action_clip.h"
#include "solver/fit/prepared_object.h"
#include "solver/markers/marked_person.h"
#include "solver/markers/marker_world.h"

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

/// Somebody who drinks or combs, solved from markers.
struct CapturedTrial {
  Clip clip;  ///< 30 frames per second
  CapturedPerson person;
  CapturedAction action;
  /// Of trunk, right_arm and left_arm (collar to wrist): those that markers moved.
  std::vector<std::string> parts;
};

/// Reads and solves a trial (SolveMarkers, seated where no marker tells) and finds what is done in
/// it. Throws Error for a trial without a static one, what ReadMarkers and SolveMarkers throw, and
/// where nobody drinks or combs.
CapturedTrial ReadCapturedTrial(const MarkerTrialFiles& files,
                                const std::shared_ptr<const BodyModel>& model);

struct CapturedClipRequest {
  const CapturedTrial& trial;
  const std::shared_ptr<const BodyModel>& model;  ///< the actor's
  const ActionActor& actor;
  const ActionProp& prop;         ///< as it is
  const PreparedObject& object;   ///< the same
  std::span<const Grasp> grasps;  ///< of the trial's hand; for brush alone
  RestPosture posture = RestPosture::kSeated;
  const StandingStart& start;  ///< whose legs are those of a standing person
  std::uint64_t seed = 1;
};

/// The largest mean distance of what is drunk from and the mouth, or of bristles and head, that a
/// clip is used with.
inline constexpr double kMaxFromKey_m = 0.025;

struct CapturedClip {
  Clip clip;  ///< with action, object track (no mesh name) and holding_hand; drink: a table too
  ActionQuality quality;
  CapturedAction action;  ///< in frames of the clip
  /// Of the rim from the mouth at the key frame, or the bristles from the head's skin while the
  /// hand is over the head.
  double key_mean_m = 0.0, key_worst_m = 0.0;
  int in_object_frames = 0, in_body_frames = 0;  ///< deeper than 2 mm: hands; object, hands, arms
  std::string fault;                             ///< as ActionClip's
  std::string detail;
};

/// A captured arm on another body, standing or seated, with the object fitted: RetargetCaptured,
/// ServeDrink or ServeBrush, then CarryObject, measured as scripted clips are (FaultOf), and by how
/// far the key point is off. Deterministic for the request.
CapturedClip MakeCapturedClip(const CapturedClipRequest& request);

}  // namespace holdfast
