// SPDX-License-Identifier: MIT
#pragma once

/// Avoids collisions with the person's own body and a table. Input: a clip in which a hand carries
/// an object. Output: the clip with adjusted arms, so that object, hands and forearms stay out of
/// trunk, legs, head and table, and a holding arm and its object out of an arm that does not hold.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/mesh.h"
#include "geometry/rotation.h"
#include "geometry/score/own_body_score.h"
#include "solver/clearance/body_meeting.h"

namespace holdfast {

struct ClearanceOptions {
  bool keep_motion = false;  ///< only measure
  double deep_m = 0.002;     ///< soft tissue allows this; clips without greater depth are unchanged
  double margin_m = 0.003;   ///< target clearance where it is deeper
  double max_shift_m = 0.12, max_turn_rad = 30.0 * kDegree;  ///< of a holding wrist
  double max_left_m = 0.01;  ///< deeper collisions that remain: the clip's motion is kept
  int max_rounds = 12;       ///< with updated planes
  int threads = 1;           ///< the result does not depend on it
};

/// Changes and remaining collisions. Depths as in MeasureOwnBody; the object counts in frames in
/// which it is held.
struct ClearanceReport {
  struct Frame {
    /// Deepest point of object, hands or forearms in body or table, in the result.
    double depth_m = 0.0;
    MeetingPart part = MeetingPart::kNone;  ///< deepest colliding part in the result
    double in_body_m = 0.0;                 ///< the same in the body alone, not in a table
    bool in_table = false;                  ///< that part is in the table, not in the body
    double wrist_shift_m = 0.0;  ///< maximum displacement of a holding wrist from the clip
  };
  std::vector<Frame> frames;
  bool moved = false;
  int held_frames = 0;
  int deep_before = 0, deep = 0;  ///< number of frames deeper than ClearanceOptions::deep_m
  double worst_before_m = 0.0, worst_m = 0.0;
  int worst_frame = 0;  ///< of the result; of the input if the result has no collision
  MeetingPart worst_part = MeetingPart::kNone;
  bool worst_in_table = false;                   ///< that part is in the table, not in the body
  double shift_mean_m = 0.0, shift_max_m = 0.0;  ///< of the holding wrist, over held frames
  double free_shift_mean_m = 0.0, free_shift_max_m = 0.0;  ///< of a wrist while it does not hold
  /// Of a holding wrist, from the clip: maximum rotation, and maximum angular velocity of that
  /// rotation.
  double turn_max_rad = 0.0, turn_speed_max_rad_s = 0.0;
  /// Number of frames with a collision that keep the clip's motion, because no adjustment within
  /// the bounds frees the body.
  int kept = 0;
  /// Mean acceleration of the wrists relative to the clip's, in the changed frames; 1 if none.
  double acceleration_ratio = 1.0;
};

/// Returns what a user should know: collisions that remain, and frames whose motion was kept.
std::vector<std::string> ClearanceWarnings(const ClearanceReport& report);

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

/// Moves both arms out of the body and of a table in the clip that stands still and has a mesh
/// (BodyCollisionDetector::AddTable), and the object with those that hold it (Clip::holding_hand);
/// each hold keeps its pose from wrist to object. Adjusts collar, shoulder, elbow and wrist by a
/// cubic B-spline in time, in the frames around those that are too deep. The hand rotates,
/// preferably about the vertical, rather than moves. Where no motion within the bounds of the
/// options frees the body, the clip's motion is kept. Everything else, and every clip
/// without collisions, is bitwise unchanged. The object stays in place where no hand holds it. If
/// collisions remain, the best result is kept and reported. A clip without an object,
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
