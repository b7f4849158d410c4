// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/actions/action_path.h"
#include "generator/actions/face_marks.h"
#include "generator/actions/object_marks.h"
#include "generator/matching/random_draws.h"

namespace holdfast {

/// Where an object is wanted: any one of `poses` serves, whichever suits the arm.
struct ScriptKey {
  double arrive_s = 0.0, leave_s = 0.0;
  Anchor anchor = Anchor::kWorld;
  std::vector<Eigen::Isometry3d> poses;  ///< of the object, relative to the anchor
  Eigen::Vector3d bulge = Eigen::Vector3d::Zero();
  /// How far the object is turned since the key before, radians, where that is the point of it;
  /// else as little as suits.
  std::optional<double> turned_rad;
  /// The very pose of an earlier key; `poses` is empty then.
  std::optional<int> same_as;
  /// Before the face: object and hand are moved out of the head along this direction of the head's
  /// frame. Zero: they are nowhere near.
  Eigen::Vector3d push = Eigen::Vector3d::Zero();
};

/// Where the face turns, from a time on.
struct GazeKey {
  double begin_s = 0.0, duration_s = 0.4;
  bool at_object = false;  ///< else along `direction`
  /// World, any length; y backwards, z up: (0, -1, 0) is straight on.
  Eigen::Vector3d direction = -Eigen::Vector3d::UnitY();
  double share = 0.7;  ///< of the way from straight on that the head turns; eyes do the rest
};

/// How the chest leans and turns, from a time on, radians.
struct LeanKey {
  double begin_s = 0.0, duration_s = 0.8;
  double forward = 0.0;  ///< of its axis
  double aside = 0.0;    ///< to the left positive
};

/// How far another hand takes over.
struct HandoverKey {
  double meet_begin_s = 0.0;  ///< the receiving hand sets out
  double both_begin_s = 0.0, both_end_s = 0.0;
  double free_s = 0.0;  ///< the giving hand is back at the side
  int key = 0;          ///< of `keys`: where the hands meet
};

/// What happens in a clip, for a right hand; everything else is chosen to suit it.
struct ActionScript {
  double duration_s = 3.0;
  std::vector<ScriptKey> keys;
  std::vector<Stroke> strokes;  ///< move, turn and pivot in the object's frame
  std::vector<GazeKey> gaze;
  std::vector<LeanKey> lean;
  std::optional<HandoverKey> handover;
  std::optional<double> table_m;  ///< height of the table that the object stands on at the start
  double swivel_rad = 0.0;        ///< style: elbow farther out (positive) or in than comfort has it
};

/// What a script is written for. World: the person at the origin facing -y.
struct ActionScene {
  FaceMarks face;
  ObjectMarks object;
  Eigen::Isometry3d head = Eigen::Isometry3d::Identity();  ///< head joint at the start
  Eigen::Vector3d shoulder = Eigen::Vector3d::Zero();      ///< right, at the start
  double arm_m = 0.5;                                      ///< shoulder to wrist
  bool in_hand = false;  ///< the object is in the hand at the start, not on a table
  /// Hammering has blows of the wrist alone, which a network of key frames can follow; else none,
  /// and AddStrokes lays the whole arm's over the motion.
  bool wrist_blows = false;
};

/// Writes the script of an action (FindMadeAction) in a style of its own: times, places, tilts,
/// strokes, gaze and lean are drawn.
ActionScript WriteScript(std::string_view action, const ActionScene& scene, RandomDraws& draws);

}  // namespace holdfast
