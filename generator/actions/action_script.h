// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/actions/action_path.h"
#include "generator/actions/face_marks.h"
#include "generator/nn/random_stream.h"
#include "geometry/rotation.h"

namespace holdfast {

/// Target poses of an object: any of `poses` will do, and the one best suited to the arm is chosen.
struct ScriptKey {
  double arrive_s = 0.0, leave_s = 0.0;
  Anchor anchor = Anchor::kWorld;
  std::vector<Eigen::Isometry3d> poses;  ///< of the object, relative to the anchor
  Eigen::Vector3d bulge = Eigen::Vector3d::Zero();
  /// Rotation of the object since the previous key, radians, if that is the purpose of the key;
  /// otherwise the rotation is as small as suits.
  std::optional<double> turned_rad;
  /// Index of an earlier key with exactly this pose; `poses` is then empty.
  std::optional<int> same_as;
  /// For keys at the face: object and hand are moved out of the head along this direction of the
  /// head frame. Zero for keys away from the head.
  Eigen::Vector3d push = Eigen::Vector3d::Zero();
};

/// Gaze target from a given time on.
struct GazeKey {
  double begin_s = 0.0, duration_s = 0.4;
  bool at_object = false;  ///< otherwise along `direction`
  /// World, any length; y backward, z up: (0, -1, 0) is straight ahead.
  Eigen::Vector3d direction = -Eigen::Vector3d::UnitY();
  double share = 0.7;  ///< fraction of the gaze angle done by the head; the eyes do the rest
};

/// Lean of the chest from a given time on, radians.
struct LeanKey {
  double begin_s = 0.0, duration_s = 0.8;
  double forward = 0.0;  ///< of the chest axis
  double aside = 0.0;    ///< positive to the left
};

/// Timing of a handover to another hand.
struct HandoverKey {
  double meet_begin_s = 0.0;  ///< the receiving hand starts to move
  double both_begin_s = 0.0, both_end_s = 0.0;
  double free_s = 0.0;  ///< the giving hand is back at the side
  int key = 0;          ///< index in `keys` of the pose where the hands meet
};

/// Script of a clip, for a right hand. Everything else is chosen to suit it.
struct ActionScript {
  double duration_s = 3.0;
  std::vector<ScriptKey> keys;
  std::vector<Stroke> strokes;  ///< move, turn and pivot in the frame of the object
  std::vector<GazeKey> gaze;
  std::vector<LeanKey> lean;
  std::optional<HandoverKey> handover;
  std::optional<double> table_m;  ///< height of the table on which the object starts
  double swivel_rad = 0.0;        ///< style: elbow farther out (positive) or in than comfortable
};

/// Scene that a script is written for. World: the person is at the origin, facing -y.
struct ActionScene {
  FaceMarks face;
  ObjectMarks object;
  Eigen::Isometry3d head = Eigen::Isometry3d::Identity();  ///< head joint at the start
  Eigen::Vector3d shoulder = Eigen::Vector3d::Zero();      ///< right, at the start
  double arm_m = 0.5;                                      ///< distance from shoulder to wrist
  bool in_hand = false;  ///< the object starts in the hand instead of on a table
  /// If set, hammering has blows of the wrist alone, which a network of key frames can follow.
  /// Otherwise the script has no blows, and AddStrokes adds those of the whole arm to the motion.
  bool wrist_blows = false;
};

/// Writes the script of an action (see FindScriptedAction) in a random style: times, places, tilts,
/// strokes, gaze and lean are drawn.
ActionScript WriteScript(std::string_view action, const ActionScene& scene, RandomDraws& draws);

/// Object poses that put a given point of the object at a given place. Directions are normalized.

/// Returns the rotation that maps `a` to `to_a`, and `b` as close to `to_b` as that allows.
Eigen::Matrix3d AlignAxes(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                          const Eigen::Vector3d& to_a, const Eigen::Vector3d& to_b);

/// Returns `count` poses with the object's axis along `direction`, evenly rotated about that axis,
/// which is unconstrained.
std::vector<Eigen::Isometry3d> TurnedPoses(const Eigen::Vector3d& point,
                                           const Eigen::Vector3d& axis,
                                           const Eigen::Vector3d& place,
                                           const Eigen::Vector3d& direction, int count);

/// Returns `count` upright poses (z up), evenly rotated about the vertical, then the same poses
/// leaned by each of `tilts_rad` towards +x, -x, +y and -y of the world.
std::vector<Eigen::Isometry3d> UprightPoses(const Eigen::Vector3d& point,
                                            const Eigen::Vector3d& place, int count,
                                            const std::vector<double>& tilts_rad = {});

/// Builds a script key by key, at a random pace of the person.
class ScriptWriter {
 public:
  ScriptWriter(const ActionScene& scene, RandomDraws& draws);

  const ActionScene& Scene() const { return scene_; }
  RandomDraws& Draws() { return draws_; }
  double Degrees(double low, double high) { return kDegree * draws_.Uniform(low, high); }
  double Uniform(double low, double high) { return draws_.Uniform(low, high); }
  bool Chance(double share) { return draws_.Uniform(0.0, 1.0) < share; }
  /// Draws a duration at the pace of this person, seconds.
  double Time(double low, double high) { return pace_ * draws_.Uniform(low, high); }
  double Now() const { return now_s_; }

  /// Returns a place in front of the person: meters to the left, distance in front of the shoulder
  /// as a fraction of the arm length, meters above the shoulder.
  Eigen::Vector3d Before(double left_m, double forward_share, double above_shoulder_m) const;
  /// Point between the eyes at the start, world.
  Eigen::Vector3d Eyes() const { return scene_.head * scene_.face.eyes; }

  /// Adds the start key: the object is upright on a table, or in the hand above the waist. It stays
  /// for at least half a second.
  void Begin();
  /// Adds a key that is reached in `move_s` and held for `stay_s`; returns its index.
  int MoveTo(Anchor anchor, std::vector<Eigen::Isometry3d> poses, double move_s, double stay_s);
  /// Adds a key with the pose of an earlier key.
  int MoveBack(int key, double move_s, double stay_s);
  ScriptKey& Last() { return script_.keys.back(); }

  void LookAtObject(double begin_s, double share = 0.7);
  /// Directions relative to straight ahead, radians.
  void Look(double begin_s, double left_rad, double up_rad, double share = 0.9,
            double duration_s = 0.45);
  void Lean(double begin_s, double duration_s, double forward_rad, double aside_rad);
  void Add(const Stroke& stroke) { script_.strokes.push_back(stroke); }
  ActionScript& Script() { return script_; }

  /// Ends the clip shortly after the last key, or (by chance) with the object back at its start.
  ActionScript Finish(double chance_of_return);

 private:
  const ActionScene& scene_;
  RandomDraws& draws_;
  ActionScript script_;
  double pace_;
  double now_s_ = 0.0;
};

// One function per intent, which draws the keys after the start. At the face (script_face.cpp):
void WriteDrink(ScriptWriter& writer);
void WriteToast(ScriptWriter& writer);
void WriteEat(ScriptWriter& writer);
void WriteCall(ScriptWriter& writer);
void WriteTakePicture(ScriptWriter& writer);
void WriteBrush(ScriptWriter& writer);
// In front of the body (script_tools.cpp):
void WritePass(ScriptWriter& writer);
void WriteInspect(ScriptWriter& writer);
void WriteLift(ScriptWriter& writer);
void WritePour(ScriptWriter& writer);
void WriteOffhand(ScriptWriter& writer);
// With tools (script_tools.cpp):
void WriteShake(ScriptWriter& writer);
void WriteSwitchOn(ScriptWriter& writer);
void WriteHammer(ScriptWriter& writer);
void WriteChop(ScriptWriter& writer);
void WriteCook(ScriptWriter& writer);

}  // namespace holdfast
