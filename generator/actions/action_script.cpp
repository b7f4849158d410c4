// SPDX-License-Identifier: MIT
#include "generator/actions/action_script.h"

#include <array>
#include <cmath>
#include <numbers>

#include "generator/actions/action_catalog.h"

namespace holdfast {
namespace {

struct Intent {
  std::string_view action;
  void (*write)(ScriptWriter&);
  double chance_of_return;  // to the start pose of the object, at the end
};

constexpr std::array<Intent, 16> kIntents = {{{"drink", WriteDrink, 0.5},
                                              {"eat", WriteEat, 0.2},
                                              {"pass", WritePass, 0.25},
                                              {"inspect", WriteInspect, 0.35},
                                              {"lift", WriteLift, 0.7},
                                              {"call", WriteCall, 0.25},
                                              {"takepicture", WriteTakePicture, 0.35},
                                              {"brush", WriteBrush, 0.25},
                                              {"toast", WriteToast, 0.15},
                                              {"pour", WritePour, 0.5},
                                              {"offhand", WriteOffhand, 0.0},
                                              {"shake", WriteShake, 0.4},
                                              {"switchON", WriteSwitchOn, 0.3},
                                              {"use", WriteHammer, 0.3},
                                              {"chop", WriteChop, 0.3},
                                              {"cook", WriteCook, 0.3}}};

}  // namespace

ActionScript WriteScript(std::string_view action, const ActionScene& scene, RandomDraws& draws) {
  FindScriptedAction(action);
  ScriptWriter writer(scene, draws);
  writer.Begin();
  double chance_of_return = 0.0;
  for (const Intent& intent : kIntents) {
    if (intent.action != action) continue;
    intent.write(writer);
    chance_of_return = intent.chance_of_return;
  }
  return writer.Finish(chance_of_return);
}

namespace {

using Eigen::Vector3d;

constexpr int kTurns = 36;

}  // namespace

ScriptWriter::ScriptWriter(const ActionScene& scene, RandomDraws& draws)
    : scene_(scene), draws_(draws), pace_(draws.Uniform(0.8, 1.25)) {
  script_.swivel_rad = Degrees(-8.0, 18.0);
}

Vector3d ScriptWriter::Before(double left_m, double forward_share, double above_shoulder_m) const {
  return {left_m, scene_.shoulder.y() - forward_share * scene_.arm_m,
          scene_.shoulder.z() + above_shoulder_m};
}

void ScriptWriter::Begin() {
  const ObjectMarks& object = scene_.object;
  const Vector3d bottom = object.middle - 0.5 * object.size.z() * Vector3d::UnitZ();
  ScriptKey key;
  const double left = Uniform(-0.24, -0.06);
  Vector3d place;
  if (scene_.in_hand) {
    place = Before(left, Uniform(0.50, 0.70), -Uniform(0.24, 0.36));
    key.poses = UprightPoses(object.middle, place, kTurns, {0.35});
  } else {
    place = Before(left, Uniform(0.66, 0.84), -Uniform(0.34, 0.50));
    script_.table_m = place.z();
    key.poses = UprightPoses(bottom, place, kTurns);
  }
  if (object.two_sided) {
    const Vector3d top =
        TurnedOver() * (scene_.in_hand ? object.middle : object.middle * 2.0 - bottom);
    for (Eigen::Isometry3d pose : UprightPoses(top, place, kTurns)) {
      key.poses.push_back(pose * TurnedOver());
    }
  }
  key.leave_s = now_s_ = Uniform(0.5, 0.75);
  script_.keys.push_back(std::move(key));
  LookAtObject(0.0, Uniform(0.3, 0.7));
  script_.gaze.back().duration_s = 0.0;
  Lean(0.0, 0.0, scene_.in_hand ? Degrees(-1.0, 3.0) : Degrees(1.0, 8.0), Degrees(-3.0, 3.0));
}

int ScriptWriter::MoveTo(Anchor anchor, std::vector<Eigen::Isometry3d> poses, double move_s,
                         double stay_s) {
  ScriptKey key;
  key.anchor = anchor;
  key.poses = std::move(poses);
  key.arrive_s = now_s_ + move_s;
  key.leave_s = now_s_ = key.arrive_s + stay_s;
  // The hand rises from the table first.
  if (script_.keys.size() == 1) key.bulge = Vector3d(0.0, -0.01, Uniform(0.01, 0.05));
  script_.keys.push_back(std::move(key));
  return static_cast<int>(script_.keys.size()) - 1;
}

int ScriptWriter::MoveBack(int key, double move_s, double stay_s) {
  const ScriptKey earlier = script_.keys[static_cast<std::size_t>(key)];
  const int index = MoveTo(earlier.anchor, {}, move_s, stay_s);
  Last().same_as = key;
  Last().bulge = Vector3d(0.0, 0.0, Uniform(0.0, 0.04));
  return index;
}

void ScriptWriter::LookAtObject(double begin_s, double share) {
  GazeKey key;
  key.begin_s = begin_s;
  key.at_object = true;
  key.share = share;
  script_.gaze.push_back(key);
}

void ScriptWriter::Look(double begin_s, double left_rad, double up_rad, double share,
                        double duration_s) {
  GazeKey key;
  key.begin_s = begin_s;
  key.duration_s = duration_s;
  key.direction = Vector3d(std::sin(left_rad) * std::cos(up_rad),
                           -std::cos(left_rad) * std::cos(up_rad), std::sin(up_rad));
  key.share = share;
  script_.gaze.push_back(key);
}

void ScriptWriter::Lean(double begin_s, double duration_s, double forward_rad, double aside_rad) {
  script_.lean.push_back({begin_s, duration_s, forward_rad, aside_rad});
}

ActionScript ScriptWriter::Finish(double chance_of_return) {
  if (Chance(chance_of_return)) {
    const double begin = now_s_;
    MoveBack(0, Time(0.7, 1.0), Uniform(0.15, 0.4));
    LookAtObject(begin + 0.05, Uniform(0.4, 0.7));
    const LeanKey& first = script_.lean.front();
    Lean(begin, Last().arrive_s - begin, first.forward, first.aside);
  }
  script_.duration_s = now_s_ + Uniform(0.05, 0.25);
  return std::move(script_);
}

namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d Frame(const Vector3d& a, const Vector3d& b) {
  Matrix3d frame;
  frame.col(0) = a.normalized();
  Vector3d across = b - b.dot(frame.col(0)) * frame.col(0);
  if (across.norm() < 1e-6) across = frame.col(0).unitOrthogonal();
  frame.col(1) = across.normalized();
  frame.col(2) = frame.col(0).cross(frame.col(1));
  return frame;
}

}  // namespace

Matrix3d AlignAxes(const Vector3d& a, const Vector3d& b, const Vector3d& to_a,
                   const Vector3d& to_b) {
  return Frame(to_a, to_b) * Frame(a, b).transpose();
}

std::vector<Isometry3d> TurnedPoses(const Vector3d& point, const Vector3d& axis,
                                    const Vector3d& place, const Vector3d& direction, int count) {
  const Matrix3d first =
      AlignAxes(axis, axis.unitOrthogonal(), direction, direction.unitOrthogonal());
  std::vector<Isometry3d> poses;
  for (int k = 0; k < count; ++k) {
    const AngleAxisd turn(2.0 * std::numbers::pi * k / count, direction.normalized());
    poses.push_back(PoseAt(turn * first, point, place));
  }
  return poses;
}

std::vector<Isometry3d> UprightPoses(const Vector3d& point, const Vector3d& place, int count,
                                     const std::vector<double>& tilts_rad) {
  std::vector<Matrix3d> leans = {Matrix3d::Identity()};
  for (const double tilt : tilts_rad) {
    for (const double sign : {1.0, -1.0}) {
      leans.push_back(AngleAxisd(sign * tilt, Vector3d::UnitX()).matrix());
      leans.push_back(AngleAxisd(sign * tilt, Vector3d::UnitY()).matrix());
    }
  }
  std::vector<Isometry3d> poses;
  for (const Matrix3d& lean : leans) {
    for (int k = 0; k < count; ++k) {
      const AngleAxisd turn(2.0 * std::numbers::pi * k / count, Vector3d::UnitZ());
      poses.push_back(PoseAt(lean * turn, point, place));
    }
  }
  return poses;
}

}  // namespace holdfast
