// SPDX-License-Identifier: MIT
#pragma once

#include <numbers>
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

/// Writes the script of an action (FindScriptedAction) in a style of its own: times, places, tilts,
/// strokes, gaze and lean are drawn.
ActionScript WriteScript(std::string_view action, const ActionScene& scene, RandomDraws& draws);

/// Poses of an object that put one of its points somewhere. All directions are unit or made so.

/// The rotation that takes `a` to `to_a` and `b` as near to `to_b` as that allows.
Eigen::Matrix3d AlignAxes(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                          const Eigen::Vector3d& to_a, const Eigen::Vector3d& to_b);

/// `count` poses, evenly round: the axis of the object points along `direction`, its turn about it
/// is free.
std::vector<Eigen::Isometry3d> TurnedPoses(const Eigen::Vector3d& point,
                                           const Eigen::Vector3d& axis,
                                           const Eigen::Vector3d& place,
                                           const Eigen::Vector3d& direction, int count);

/// Upright (z up), `count` turns about the vertical; then the same leant by each of `tilts_rad`
/// towards +x, -x, +y and -y of the world.
std::vector<Eigen::Isometry3d> UprightPoses(const Eigen::Vector3d& point,
                                            const Eigen::Vector3d& place, int count,
                                            const std::vector<double>& tilts_rad = {});

inline constexpr double kDegreeOfScript = std::numbers::pi / 180.0;

/// A script under construction: keys one after the other, at this person's pace.
class ScriptWriter {
 public:
  ScriptWriter(const ActionScene& scene, RandomDraws& draws);

  const ActionScene& Scene() const { return scene_; }
  RandomDraws& Draws() { return draws_; }
  double Degrees(double low, double high) { return kDegreeOfScript * draws_.Uniform(low, high); }
  double Uniform(double low, double high) { return draws_.Uniform(low, high); }
  bool Chance(double share) { return draws_.Uniform(0.0, 1.0) < share; }
  /// Seconds at this person's pace.
  double Time(double low, double high) { return pace_ * draws_.Uniform(low, high); }
  double Now() const { return now_s_; }

  /// A place before the person: meters to the left, forward of the shoulder as a share of the arm,
  /// above the shoulder.
  Eigen::Vector3d Before(double left_m, double forward_share, double above_shoulder_m) const;
  /// Between the eyes at the start, world.
  Eigen::Vector3d Eyes() const { return scene_.head * scene_.face.eyes; }

  /// Where the object is at the start: upright on a table, or in the hand above one's waist. Stays
  /// half a second.
  void Begin();
  /// Comes to a key in `move_s`, stays for `stay_s`; returns its index. Times are as given.
  int MoveTo(Anchor anchor, std::vector<Eigen::Isometry3d> poses, double move_s, double stay_s);
  /// Back to an earlier key's pose.
  int MoveBack(int key, double move_s, double stay_s);
  ScriptKey& Last() { return script_.keys.back(); }

  void LookAtObject(double begin_s, double share = 0.7);
  /// Right and up of straight on, radians.
  void Look(double begin_s, double left_rad, double up_rad, double share = 0.9,
            double duration_s = 0.45);
  void Lean(double begin_s, double duration_s, double forward_rad, double aside_rad);
  void Add(const Stroke& stroke) { script_.strokes.push_back(stroke); }
  ActionScript& Script() { return script_; }

  /// Ends the clip a moment after the last key, or with the object back where it was.
  ActionScript Finish(double chance_of_return);

 private:
  const ActionScene& scene_;
  RandomDraws& draws_;
  ActionScript script_;
  double pace_;
  double now_s_ = 0.0;
};

// One function per intent: the keys after the start, drawn. At the face (script_face.cpp):
void WriteDrink(ScriptWriter& writer);
void WriteToast(ScriptWriter& writer);
void WriteEat(ScriptWriter& writer);
void WriteCall(ScriptWriter& writer);
void WriteTakePicture(ScriptWriter& writer);
void WriteBrush(ScriptWriter& writer);
// Before the body (script_front.cpp):
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
