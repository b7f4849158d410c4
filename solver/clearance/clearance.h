// SPDX-License-Identifier: MIT
#pragma once

/// The person's own body kept whole: a clip in which a hand carries an object comes in; the clip
/// with arms that are adjusted, so that object, hands and forearms keep out of trunk, legs, head
/// and what holds from what does not, comes out.

#include <cstdint>
#include <span>
#include <vector>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/mesh.h"
#include "geometry/score/own_body_score.h"
#include "solver/clearance/body_meeting.h"

namespace holdfast {

struct ClearanceOptions {
  bool keep_motion = false;  ///< measures only
  double deep_m = 0.002;     ///< soft tissue gives so much; a clip that is nowhere deeper stays
  double margin_m = 0.003;   ///< asked for where it is deeper
  int max_rounds = 8;        ///< of planes taken anew
  int threads = 1;           ///< the result does not depend on them
};

/// What was moved and what remains. Depths are those of MeasureOwnBody; the object's count in
/// frames in which it is held.
struct ClearanceReport {
  struct Frame {
    double depth_before_m = 0.0;  ///< deepest point of object, hands or forearms in the body
    double depth_m = 0.0;         ///< the same in the result
    MeetingPart part = MeetingPart::kNone;  ///< whose, in the result
    double wrist_shift_m = 0.0;             ///< of the farther wrist from the clip's
  };
  std::vector<Frame> frames;
  bool moved = false;
  int held_frames = 0;
  int deep_before = 0, deep = 0;  ///< frames deeper than ClearanceOptions::deep_m
  double worst_before_m = 0.0, worst_m = 0.0;
  int worst_frame = 0;  ///< of the result; of the input where the result has none in the body
  MeetingPart worst_part = MeetingPart::kNone;
  double shift_mean_m = 0.0, shift_max_m = 0.0;  ///< of the wrist that holds, over held frames
  double free_shift_mean_m = 0.0, free_shift_max_m = 0.0;  ///< of a wrist while it does not hold
  /// Mean acceleration of the wrists over the clip's, in the frames moved; 1 without.
  double acceleration_ratio = 1.0;
};

/// What KeepOutOfBody looks at: all that does not depend on the motion, so that it can be made
/// while that is still worked on.
struct ClearanceScene {
  /// `body` has all vertices, must outlive this and is no hand alone. `holding`: who holds in each
  /// frame (Clip::holding_hand).
  ClearanceScene(const BodySurface& body, const TriangleMesh& object,
                 std::span<const std::uint8_t> holding, double frame_rate);

  std::vector<std::uint8_t> near;  ///< who holds about then
  BodyCollisionDetector meeting;
  OwnBodyMeter meter;
};

/// Moves both arms out of the body, and the object with those that hold it (Clip::holding_hand):
/// each hand keeps its hold, wrist to object, as it is. Collar, shoulder, elbow and wrist are
/// adjusted, by a cubic B-spline in time, in the frames around those that are too deep: the hand
/// rather turns, most easily about the vertical, than moves, and hardly farther than 5 cm. All
/// else, and every frame of a clip that is clear, keeps its bits. The object stays where nobody
/// holds it. Where that is not enough, what comes nearest is kept and said. A clip without object,
/// or of a hand alone, comes back as it is.
///
/// `body`: all vertices of the clip's person; `object`: the mesh, meters. Throws Error unless
/// holding_hand has the clip's frames.
ClearanceReport KeepOutOfBody(const BodySurface& body, const TriangleMesh& object,
                              const ClearanceOptions& options, Clip& clip);
/// With a scene of the clip's frames, body and object.
ClearanceReport KeepOutOfBody(const BodySurface& body, const TriangleMesh& object,
                              const ClearanceOptions& options, ClearanceScene scene, Clip& clip);

}  // namespace holdfast
