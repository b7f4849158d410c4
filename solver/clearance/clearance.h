// SPDX-License-Identifier: MIT
#pragma once

/// Avoids collisions with the person's own body. Input: a clip in which a hand carries an object.
/// Output: the clip with adjusted arms, so that object, hands and forearms stay out of trunk, legs
/// and head, and a holding arm and its object out of an arm that does not hold.

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
  bool keep_motion = false;  ///< only measure
  double deep_m = 0.002;     ///< soft tissue allows this; clips without greater depth are unchanged
  double margin_m = 0.003;   ///< target clearance where it is deeper
  int max_rounds = 8;        ///< with updated planes
  int threads = 1;           ///< the result does not depend on it
};

/// Changes and remaining collisions. Depths as in MeasureOwnBody; the object counts in frames in
/// which it is held.
struct ClearanceReport {
  struct Frame {
    double depth_m =
        0.0;  ///< deepest point of object, hands or forearms in the body, in the result
    MeetingPart part = MeetingPart::kNone;  ///< deepest colliding part in the result
    double wrist_shift_m = 0.0;             ///< maximum displacement of a wrist from the clip
  };
  std::vector<Frame> frames;
  bool moved = false;
  int held_frames = 0;
  int deep_before = 0, deep = 0;  ///< number of frames deeper than ClearanceOptions::deep_m
  double worst_before_m = 0.0, worst_m = 0.0;
  int worst_frame = 0;  ///< of the result; of the input if the result has no collision
  MeetingPart worst_part = MeetingPart::kNone;
  double shift_mean_m = 0.0, shift_max_m = 0.0;  ///< of the holding wrist, over held frames
  double free_shift_mean_m = 0.0, free_shift_max_m = 0.0;  ///< of a wrist while it does not hold
  /// Mean acceleration of the wrists relative to the clip's, in the changed frames; 1 if none.
  double acceleration_ratio = 1.0;
};

/// Data of KeepOutOfBody that do not depend on the motion, so that they can be prepared while the
/// motion is still computed.
struct ClearanceScene {
  /// `body` has all vertices, must outlive this and is not a lone hand. `holding`: holding hands
  /// per frame (Clip::holding_hand).
  ClearanceScene(const BodySurface& body, const TriangleMesh& object,
                 std::span<const std::uint8_t> holding, double frame_rate);

  std::vector<std::uint8_t> near;  ///< hands that hold around that time
  BodyCollisionDetector meeting;
  OwnBodyMeter meter;
};

/// Moves both arms out of the body, and the object with those that hold it (Clip::holding_hand);
/// each hold keeps its pose from wrist to object. Adjusts collar, shoulder, elbow and wrist by a
/// cubic B-spline in time, in the frames around those that are too deep. The hand rotates,
/// preferably about the vertical, rather than moves, and by hardly more than 5 cm. Everything else,
/// and every clip without collisions, is bitwise unchanged. The object stays in place where no hand
/// holds it. If collisions remain, the best result is kept and reported. A clip without an object,
/// or of a lone hand, is returned unchanged.
///
/// `body`: all vertices of the clip's person; `object`: the mesh, meters. Throws Error unless
/// holding_hand has the clip's number of frames.
ClearanceReport KeepOutOfBody(const BodySurface& body, const TriangleMesh& object,
                              const ClearanceOptions& options, Clip& clip);
/// The same with a prepared scene of the clip's frames, body and object.
ClearanceReport KeepOutOfBody(const BodySurface& body, const TriangleMesh& object,
                              const ClearanceOptions& options, ClearanceScene scene, Clip& clip);

}  // namespace holdfast
