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

/// Phases of a captured arm motion, in frames of its clip: reach [begin, act), act [act, back),
/// return [back, end).
struct CapturedAction {
  std::string action;  ///< "drink", or "brush" for a hand that passes over the head
  Side side = Side::kRight;
  int begin = 0, act = 0;
  int key = 0;  ///< the palm is nearest to the mouth, or halfway over the head
  int back = 0, end = 0;
};

/// A captured person: joints (3 x 55) and face of the rest pose.
struct CapturedPerson {
  Eigen::Matrix3Xd rest_joints;
  FaceMarks face;
};

/// Finds an arm that drinks (FindDrink), or one whose palm passes over the head: within 10 cm of
/// its skin, above the mouth, and at some time 8 cm behind the eyes. The reach begins, and the
/// return ends, where the palm is slower than a tenth of its maximum speed, extended by 0.3 s of
/// rest. Returns nothing if neither occurs.
std::optional<CapturedAction> FindCapturedAction(const Clip& clip, const CapturedPerson& person);

/// Retargets frames [begin, end) of a capture to another body that faces -y with feet on the
/// ground: trunk, arms, hands, head and timing are captured, as joint angles; near the face the
/// wrist of `side` keeps its offset from the mouth (drink) or the eyes. Legs are the captured ones
/// if `posture` is seated, otherwise those of `standing`, a frame of a person standing facing -y.
/// The clip has frame rate, body and motion; the caller sets betas.
Clip RetargetCaptured(const Clip& clip, const CapturedAction& action, const CapturedPerson& from,
                      const BodyMeasures& body, const FaceMarks& face, RestPosture posture,
                      const BodyFrame& standing);

/// A person who drinks or combs, solved from markers.
struct CapturedTrial {
  Clip clip;  ///< 30 frames per second
  CapturedPerson person;
  CapturedAction action;
  /// Subset of trunk, right_arm and left_arm (collar to wrist) that is driven by markers.
  std::vector<std::string> parts;
};

/// Reads and solves a trial (SolveMarkers, seated where no marker determines the posture) and finds
/// its action. Throws Error for a trial without a static one, if ReadMarkers or SolveMarkers throw,
/// and if nobody drinks or combs.
CapturedTrial ReadCapturedTrial(const MarkerTrialFiles& files,
                                const std::shared_ptr<const BodyModel>& model);

struct CapturedClipRequest {
  const CapturedTrial& trial;
  const std::shared_ptr<const BodyModel>& model;  ///< the actor's
  const ActionActor& actor;
  const ActionProp& prop;         ///< not mirrored
  const PreparedObject& object;   ///< the same object
  std::span<const Grasp> grasps;  ///< of the trial's hand; only for brush
  RestPosture posture = RestPosture::kSeated;
  const StandingStart& start;  ///< provides the legs of a standing person
  std::uint64_t seed = 1;
};

/// Its clip also has a table if the person drinks.
struct CapturedClip : ActionClip {
  CapturedAction action;  ///< in frames of the clip
  /// Distance of the rim from the mouth at the key frame, or of the bristles from the head's skin
  /// while the hand is over the head.
  double key_mean_m = 0.0, key_worst_m = 0.0;
  int in_object_frames = 0, in_body_frames = 0;  ///< deeper than 2 mm: hands; object, hands, arms
};

/// Synthesizes a clip of a captured arm on another body, standing or seated, with the object
/// fitted: RetargetCaptured, ServeDrink or ServeBrush, then CarryObject. Quality is measured as for
/// scripted clips (FaultOf), plus the error of the key point. Deterministic for the request.
CapturedClip MakeCapturedClip(const CapturedClipRequest& request);

}  // namespace holdfast
