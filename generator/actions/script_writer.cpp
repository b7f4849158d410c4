// SPDX-License-Identifier: MIT
#include "generator/actions/script_writer.h"

#include <cmath>

namespace holdfast {
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
  // Hands rise from a table before they go anywhere.
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

}  // namespace holdfast
