// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "generator/actions/action_script.h"

// Intents with an object at the face. Places and directions are in the head frame (y up, z forward,
// x left) unless noted otherwise.

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kLips_m = 0.003;  // distance of objects from the skin

// Poses with the near edge of the rim between the lips and the opening tilted towards the face.
std::vector<Isometry3d> AtLips(const ScriptWriter& writer, double tilt) {
  const ActionScene& scene = writer.Scene();
  const Vector3d axis(0.0, std::cos(tilt), -std::sin(tilt));
  const Vector3d to_face(0.0, -std::sin(tilt), -std::cos(tilt));
  const Vector3d lips = scene.face.mouth + Vector3d(0.0, -0.004, kLips_m);
  const Vector3d middle = lips - scene.object.rim_radius * to_face;
  return TurnedPoses(scene.object.rim, Vector3d::UnitZ(), middle, axis, 30);
}

void Sip(ScriptWriter& writer, double least_tilt, double most_tilt, double stay_low,
         double stay_high) {
  const double come = writer.Time(0.75, 1.15);
  const double begin = writer.Now();
  writer.MoveTo(Anchor::kHead, AtLips(writer, writer.Degrees(8.0, 20.0)), come, 0.05);
  writer.Last().push = Vector3d::UnitZ();
  const double tilt_begin = writer.Now();
  const double tilt = writer.Degrees(least_tilt, most_tilt);
  writer.MoveTo(Anchor::kHead, AtLips(writer, tilt), writer.Time(0.4, 0.65),
                writer.Time(stay_low, stay_high));
  writer.Last().push = Vector3d::UnitZ();
  const double tilt_end = writer.Now();
  writer.MoveTo(Anchor::kHead, AtLips(writer, writer.Degrees(5.0, 15.0)), writer.Time(0.3, 0.45),
                0.0);
  writer.Last().push = Vector3d::UnitZ();
  // The head moves down to the rim, then tilts back while drinking.
  writer.Look(begin + 0.2, 0.0, writer.Degrees(-14.0, -4.0), 1.0, come);
  writer.Look(tilt_begin, 0.0, writer.Degrees(6.0, 16.0) + 0.12 * tilt, 1.0, 0.55);
  writer.Look(tilt_end, 0.0, writer.Degrees(-10.0, 0.0), 1.0, 0.45);
  writer.Lean(begin, come, writer.Degrees(-1.0, 3.0), writer.Degrees(-2.0, 2.0));
  writer.Lean(tilt_begin, 0.6, writer.Degrees(-4.0, 0.0), 0.0);
}

// Lowers the object in front of the chest, where a clip may end.
void Lower(ScriptWriter& writer) {
  const Vector3d place = writer.Before(writer.Uniform(-0.2, -0.05), writer.Uniform(0.5, 0.7),
                                       -writer.Uniform(0.15, 0.3));
  writer.MoveTo(Anchor::kWorld, UprightPoses(writer.Scene().object.middle, place, 36),
                writer.Time(0.6, 0.9), 0.2);
}

}  // namespace

void WriteDrink(ScriptWriter& writer) {
  const bool narrow = writer.Scene().object.rim_radius < 0.025;  // bottles are tipped more
  Sip(writer, narrow ? 55.0 : 30.0, narrow ? 75.0 : 52.0, 0.4, 1.2);
  if (writer.Chance(0.3)) Lower(writer);
}

void WriteToast(ScriptWriter& writer) {
  const double begin = writer.Now(), raise = writer.Time(0.7, 1.0);
  const Vector3d eyes = writer.Eyes();
  Vector3d place = writer.Before(writer.Uniform(-0.1, 0.04), writer.Uniform(0.80, 0.95), 0.0);
  place.z() = eyes.z() - writer.Uniform(0.02, 0.14);
  writer.MoveTo(Anchor::kWorld, UprightPoses(writer.Scene().object.rim, place, 36), raise,
                writer.Time(0.2, 0.4));
  writer.Look(begin + 0.15, 0.0, writer.Degrees(-4.0, 6.0));
  writer.Lean(begin, raise, writer.Degrees(1.0, 6.0), writer.Degrees(3.0, 10.0));
  Sip(writer, 18.0, 38.0, 0.15, 0.4);
}

void WriteEat(ScriptWriter& writer) {
  const ActionScene& scene = writer.Scene();
  const ObjectMarks& object = scene.object;
  const bool long_one = object.size.x() > 2.0 * object.size.y();
  std::vector<Isometry3d> poses;
  if (long_one) {  // bitten at its end, from below and from the side of the hand
    for (const double aside : {0.15, 0.45, 0.8}) {
      for (const double up : {0.15, 0.5}) {
        const std::vector<Isometry3d> turned =
            TurnedPoses(object.tip, object.forward, scene.face.mouth + Vector3d(0.0, 0.0, kLips_m),
                        Vector3d(aside, up, -1.0), 16);
        poses.insert(poses.end(), turned.begin(), turned.end());
      }
    }
  } else {
    const Vector3d middle =
        scene.face.mouth + Vector3d(0.0, 0.0, 0.5 * object.size.head<2>().maxCoeff() - 0.002);
    for (const Vector3d& up : {Vector3d(0, 1, 0), Vector3d(0.5, 1, 0), Vector3d(-0.5, 1, 0),
                               Vector3d(0, 1, 0.5), Vector3d(0, 1, -0.5)}) {
      const std::vector<Isometry3d> turned =
          TurnedPoses(object.middle, Vector3d::UnitZ(), middle, up, 16);
      poses.insert(poses.end(), turned.begin(), turned.end());
    }
  }
  std::vector<Isometry3d> away = poses;
  const Vector3d lower(-0.01, -writer.Uniform(0.05, 0.11), writer.Uniform(0.06, 0.12));
  for (Isometry3d& pose : away) pose.translation() += lower;

  const int bites = writer.Chance(0.5) ? 2 : 1;
  for (int bite = 0; bite < bites; ++bite) {
    const double begin = writer.Now();
    const double come = bite == 0 ? writer.Time(0.75, 1.1) : writer.Time(0.4, 0.55);
    writer.MoveTo(Anchor::kHead, poses, come, writer.Time(0.2, 0.4));
    writer.Last().push = Vector3d::UnitZ();
    writer.Look(begin + 0.1, writer.Degrees(-4.0, 4.0), writer.Degrees(-22.0, -8.0), 1.0, 0.6);
    writer.Look(begin + come, writer.Degrees(-3.0, 3.0), writer.Degrees(-10.0, 4.0), 1.0, 0.35);
    writer.Lean(begin, come, writer.Degrees(1.0, 7.0), writer.Degrees(-3.0, 3.0));
    writer.MoveTo(Anchor::kHead, away, writer.Time(0.35, 0.5), writer.Time(0.25, 0.6));
    writer.Last().push = Vector3d::UnitZ();
  }
  writer.Look(writer.Now() - 0.3, writer.Degrees(-10.0, 10.0), writer.Degrees(-6.0, 3.0));
}

void WriteCall(ScriptWriter& writer) {
  const ActionScene& scene = writer.Scene();
  const ObjectMarks& phone = scene.object;
  std::vector<Isometry3d> poses;
  for (const double back : {0.5, 0.75, 1.0, 1.3}) {  // backward tilt of the upper end
    for (const double flare : {0.0, 0.12, 0.25}) {   // distance of the lower end from the cheek
      const Matrix3d turn = AlignAxes(phone.forward, phone.facing,
                                      Vector3d(flare - 0.05, 1.0, -back), Vector3d(1.0, 0.0, 0.1));
      poses.push_back(
          PoseAt(turn, phone.tip, scene.face.right_ear + Vector3d(-0.006, -0.004, 0.004)));
    }
  }
  const double begin = writer.Now(), come = writer.Time(0.8, 1.15);
  writer.MoveTo(Anchor::kHead, poses, come, writer.Time(1.0, 2.0));
  writer.Last().push = -Vector3d::UnitX();
  writer.Last().bulge = Vector3d(-0.02, -0.06, 0.0);
  writer.Look(begin + 0.1, 0.0, writer.Degrees(-8.0, 4.0));
  for (int k = 0; k < 2; ++k) {
    writer.Look(begin + come + writer.Uniform(0.1, 0.9) + 0.7 * k, writer.Degrees(-18.0, 18.0),
                writer.Degrees(-16.0, 6.0), 0.9, 0.7);
  }
  writer.Lean(begin, come, writer.Degrees(-3.0, 2.0), writer.Degrees(-3.0, 3.0));
}

void WriteTakePicture(ScriptWriter& writer) {
  const ActionScene& scene = writer.Scene();
  const ObjectMarks& object = scene.object;
  const bool flat = object.size.z() < 0.3 * object.size.x();  // a phone has its lens on the back
  const double up_aim = writer.Degrees(-6.0, 4.0);
  const Vector3d aim(0.0, std::sin(up_aim), std::cos(up_aim));
  const Vector3d lens = flat ? Vector3d(-object.facing) : object.forward;
  Vector3d place = scene.face.eyes + Vector3d(0.0, writer.Uniform(-0.035, -0.01), 0.0);
  place.z() += flat ? writer.Uniform(0.26, 0.38) : writer.Uniform(0.13, 0.2);
  std::vector<Vector3d> ups = {Vector3d::UnitZ()};
  if (flat) ups = {object.forward, object.forward.cross(lens), -object.forward.cross(lens)};
  std::vector<Isometry3d> poses;
  for (const Vector3d& up : ups) {
    for (const double roll : {-0.1, 0.0, 0.1}) {
      for (const double aside : {-0.03, 0.0, 0.03}) {
        poses.push_back(PoseAt(AlignAxes(lens, up, aim, Vector3d(roll, 1.0, 0.0)), object.middle,
                               place + Vector3d(aside, 0.0, 0.0)));
      }
    }
  }
  const double begin = writer.Now(), come = writer.Time(0.8, 1.2);
  writer.MoveTo(Anchor::kHead, poses, come, writer.Time(0.9, 1.8));
  writer.Last().push = Vector3d::UnitZ();
  writer.Look(begin + 0.1, writer.Degrees(-8.0, 8.0), writer.Degrees(-4.0, 4.0), 1.0, come);
  if (writer.Chance(0.6)) {  // looks for another picture
    writer.Look(begin + come + 0.35, writer.Degrees(-20.0, 20.0), writer.Degrees(-8.0, 6.0), 1.0,
                0.8);
  }
  writer.Lean(begin, come, writer.Degrees(-4.0, 3.0), writer.Degrees(-4.0, 4.0));
}

void WriteBrush(ScriptWriter& writer) {
  const ActionScene& scene = writer.Scene();
  const ObjectMarks& brush = scene.object;
  const auto poses_at = [&](double left) {
    std::vector<Isometry3d> poses;
    for (const double up : {-0.1, 0.15, 0.4}) {
      for (const double inward : {-0.1, -0.35, -0.6}) {
        for (const double roll : {-0.4, 0.0, 0.4}) {
          const Matrix3d turn = AlignAxes(brush.forward, brush.facing, Vector3d(1.0, up, inward),
                                          Vector3d(0.0, roll, -1.0));
          poses.push_back(PoseAt(turn, brush.tip, scene.face.mouth + Vector3d(left, 0.0, kLips_m)));
        }
      }
    }
    return poses;
  };
  const double begin = writer.Now(), come = writer.Time(0.8, 1.1);
  writer.MoveTo(Anchor::kHead, poses_at(writer.Uniform(-0.015, 0.005)), come,
                writer.Time(0.9, 1.6));
  writer.Last().push = Vector3d::UnitZ();
  if (writer.Chance(0.5)) {
    writer.MoveTo(Anchor::kHead, poses_at(writer.Uniform(0.005, 0.02)), 0.35,
                  writer.Time(0.7, 1.2));
    writer.Last().push = Vector3d::UnitZ();
  }
  Stroke stroke;
  stroke.begin_s = begin + come - 0.05;
  stroke.end_s = writer.Now() + 0.05;
  stroke.period_s = writer.Uniform(0.26, 0.42);
  stroke.move = writer.Uniform(0.009, 0.017) * brush.forward;
  writer.Add(stroke);
  writer.Look(begin + 0.1, writer.Degrees(-5.0, 5.0), writer.Degrees(-14.0, 2.0), 1.0, 0.6);
  writer.Lean(begin, come, writer.Degrees(0.0, 8.0), writer.Degrees(-3.0, 3.0));
}

}  // namespace holdfast
