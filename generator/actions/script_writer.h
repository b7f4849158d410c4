// SPDX-License-Identifier: MIT
#pragma once

#include <numbers>
#include <optional>
#include <vector>

#include "generator/actions/action_script.h"
#include "generator/actions/script_poses.h"

namespace holdfast {

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

  /// A place before the person: metres to the left, forward of the shoulder as a share of the arm,
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

}  // namespace holdfast
