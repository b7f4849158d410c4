// SPDX-License-Identifier: MIT
#include <cmath>

#include "generator/actions/action_script.h"
#include "geometry/rotation.h"

// Intents with a periodic motion or a pointed tool. Places and directions are in the world frame.

namespace holdfast {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

// Poses with the tool's forward and working side along the given directions, and variations rotated
// about the vertical, in the plane of both directions, and about the tool.
std::vector<Isometry3d> Pointed(const ObjectMarks& tool, const Vector3d& place,
                                const Vector3d& forward, const Vector3d& facing) {
  std::vector<Isometry3d> poses;
  for (const double yaw : {-24.0, -12.0, 0.0, 12.0, 24.0}) {
    for (const double pitch : {-14.0, 0.0, 14.0}) {
      for (const double roll : {-20.0, 0.0, 20.0}) {
        const Matrix3d turn = AngleAxisd(yaw * kDegree, Vector3d::UnitZ()) *
                              AngleAxisd(pitch * kDegree, forward.cross(facing).normalized()) *
                              AngleAxisd(roll * kDegree, forward.normalized()).matrix() *
                              AlignAxes(tool.forward, tool.facing, forward, facing);
        poses.push_back(PoseAt(turn, tool.middle, place));
      }
    }
  }
  return poses;
}

}  // namespace

void WriteShake(ScriptWriter& writer) {
  const ObjectMarks& object = writer.Scene().object;
  const double begin = writer.Now(), come = writer.Time(0.6, 0.9);
  const Vector3d place = writer.Before(writer.Uniform(-0.14, 0.0), writer.Uniform(0.58, 0.75),
                                       -writer.Uniform(0.08, 0.2));
  writer.MoveTo(Anchor::kWorld, UprightPoses(object.middle, place, 36, {0.3}), come,
                writer.Time(1.2, 2.0));
  Stroke stroke;
  stroke.begin_s = begin + 0.8 * come;
  stroke.end_s = writer.Now();
  stroke.period_s = writer.Uniform(0.27, 0.42);
  stroke.move = writer.Uniform(0.025, 0.05) * Vector3d::UnitZ();
  writer.Add(stroke);
  writer.LookAtObject(begin, writer.Uniform(0.3, 0.8));
  writer.Lean(begin, come, writer.Degrees(-1.0, 5.0), writer.Degrees(-3.0, 3.0));
}

void WriteSwitchOn(ScriptWriter& writer) {
  const ObjectMarks& light = writer.Scene().object;
  const double begin = writer.Now(), come = writer.Time(0.7, 1.0);
  const Vector3d place = writer.Before(writer.Uniform(-0.16, -0.02), writer.Uniform(0.62, 0.82),
                                       -writer.Uniform(0.12, 0.26));
  const double down = writer.Uniform(-0.25, 0.05), left = writer.Uniform(-0.2, 0.2);
  writer.MoveTo(Anchor::kWorld,
                Pointed(light, place, Vector3d(left, -1.0, down), Vector3d::UnitZ()), come,
                writer.Time(0.5, 0.9));
  writer.Look(begin + 0.3, std::atan(left), 0.6 * std::atan(down));
  if (writer.Chance(0.7)) {  // points it at something else
    const double there = writer.Now(), swing = writer.Time(0.5, 0.8);
    const double more = left + (left > 0.0 ? -1.0 : 1.0) * writer.Uniform(0.3, 0.6);
    writer.MoveTo(Anchor::kWorld,
                  Pointed(light, place, Vector3d(more, -1.0, down), Vector3d::UnitZ()), swing,
                  writer.Time(0.3, 0.7));
    writer.Look(there, std::atan(more), 0.6 * std::atan(down));
  }
  writer.Lean(begin, come, writer.Degrees(0.0, 6.0), writer.Degrees(-2.0, 6.0));
}

void WriteHammer(ScriptWriter& writer) {
  const ObjectMarks& hammer = writer.Scene().object;
  const double begin = writer.Now(), come = writer.Time(0.75, 1.05);
  const Vector3d place = writer.Before(writer.Uniform(-0.12, 0.0), writer.Uniform(0.72, 0.88),
                                       -writer.Uniform(0.14, 0.24));
  const Vector3d forward(writer.Uniform(0.05, 0.4), -0.5, writer.Uniform(0.7, 1.0));
  const bool of_wrist = writer.Scene().wrist_blows;
  writer.MoveTo(Anchor::kWorld, Pointed(hammer, place, forward, Vector3d(0.0, -1.0, -0.5)), come,
                of_wrist ? writer.Time(1.6, 2.4) : writer.Time(2.2, 3.0));
  if (of_wrist) {
    Stroke blow;
    blow.begin_s = begin + 0.8 * come;
    blow.end_s = writer.Now();
    blow.period_s = writer.Uniform(0.55, 0.8);
    blow.turn = writer.Degrees(16.0, 26.0) * hammer.forward.cross(hammer.facing);
    blow.pivot = hammer.middle - 0.65 * hammer.size.x() * hammer.forward;
    writer.Add(blow);
  }
  writer.LookAtObject(begin, writer.Uniform(0.5, 0.8));
  writer.Lean(begin, come, writer.Degrees(3.0, 10.0), writer.Degrees(-2.0, 5.0));
}

void WriteChop(ScriptWriter& writer) {
  const ObjectMarks& knife = writer.Scene().object;
  const double begin = writer.Now(), come = writer.Time(0.7, 1.0);
  const double amplitude = writer.Uniform(0.018, 0.035);
  Vector3d place = writer.Before(writer.Uniform(-0.1, 0.04), writer.Uniform(0.7, 0.88),
                                 -writer.Uniform(0.32, 0.42));
  if (writer.Script().table_m) place.z() = *writer.Script().table_m + 0.05 + amplitude;
  const Vector3d forward(writer.Uniform(0.4, 1.0), -1.0, -0.1);
  writer.MoveTo(Anchor::kWorld, Pointed(knife, place, forward, -Vector3d::UnitZ()), come,
                writer.Time(1.4, 2.2));
  Stroke chop;
  chop.begin_s = begin + 0.9 * come;
  chop.end_s = writer.Now();
  chop.period_s = writer.Uniform(0.38, 0.6);
  chop.move = amplitude * knife.facing;
  writer.Add(chop);
  writer.LookAtObject(begin, writer.Uniform(0.6, 0.9));
  writer.Lean(begin, come, writer.Degrees(4.0, 11.0), writer.Degrees(-2.0, 5.0));
}

void WriteCook(ScriptWriter& writer) {
  const ObjectMarks& pan = writer.Scene().object;
  const double begin = writer.Now(), come = writer.Time(0.65, 0.95);
  const Vector3d place = writer.Before(writer.Uniform(-0.12, 0.04), writer.Uniform(0.92, 1.1),
                                       -writer.Uniform(0.28, 0.38));
  const Vector3d forward(writer.Uniform(0.1, 0.7), -1.0, 0.0);
  writer.MoveTo(Anchor::kWorld, Pointed(pan, place, forward, Vector3d::UnitZ()), come,
                writer.Time(1.8, 2.6));
  Stroke sway;
  sway.begin_s = begin + 0.8 * come;
  sway.end_s = writer.Now();
  sway.period_s = writer.Uniform(0.75, 1.15);
  sway.move = writer.Uniform(0.025, 0.05) * Vector3d::UnitX();
  if (writer.Chance(0.6)) sway.move_aside = writer.Uniform(0.02, 0.04) * Vector3d::UnitY();
  sway.turn = writer.Degrees(0.0, 7.0) * Vector3d::UnitY();
  sway.pivot = pan.middle;
  writer.Add(sway);
  writer.LookAtObject(begin, writer.Uniform(0.6, 0.9));
  writer.Lean(begin, come, writer.Degrees(2.0, 7.0), writer.Degrees(-2.0, 4.0));
}

}  // namespace holdfast

// Intents with an object in front of the body. Places are in the world frame.

namespace holdfast {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

// Poses tipped by `tilt` towards the direction of the spout, with the spout at `place`.
std::vector<Isometry3d> Tipped(const ObjectMarks& object, const Vector3d& place, double tilt) {
  std::vector<Isometry3d> poses;
  const bool spout = std::abs(object.forward.z()) < 0.5;
  for (int k = -3; k <= 7; ++k) {  // from the left to the front
    const double angle = 15.0 * kDegree * k;
    const Vector3d to(std::cos(angle), -std::sin(angle), 0.0);
    const Matrix3d tip = AngleAxisd(tilt, Vector3d::UnitZ().cross(to)).matrix();
    if (spout) {
      const Matrix3d upright = AlignAxes(object.forward, Vector3d::UnitZ(), to, Vector3d::UnitZ());
      poses.push_back(PoseAt(tip * upright, object.tip, place));
    } else if (k % 2 == 0) {
      for (int turn = 0; turn < 18; ++turn) {
        const AngleAxisd yaw(20.0 * kDegree * turn, Vector3d::UnitZ());
        poses.push_back(PoseAt(tip * yaw, object.rim, place));
      }
    }
  }
  return poses;
}

}  // namespace

void WritePass(ScriptWriter& writer) {
  const ObjectMarks& object = writer.Scene().object;
  const double begin = writer.Now(), come = writer.Time(0.8, 1.2);
  const double aside = writer.Uniform(-0.14, 0.12);
  const Vector3d place =
      writer.Before(aside, writer.Uniform(0.92, 1.12), writer.Uniform(-0.22, 0.02));
  writer.MoveTo(Anchor::kWorld, UprightPoses(object.middle, place, 36, {0.3}), come,
                writer.Time(0.6, 1.4));
  writer.Look(begin + writer.Uniform(0.1, 0.4), writer.Degrees(-8.0, 12.0),
              writer.Degrees(-6.0, 5.0));
  writer.Lean(begin, come, writer.Degrees(4.0, 14.0), writer.Degrees(4.0, 16.0));
}

void WriteInspect(ScriptWriter& writer) {
  const ObjectMarks& object = writer.Scene().object;
  const double forward = writer.Uniform(0.52, 0.68), below = writer.Uniform(0.10, 0.24);
  const double left = writer.Uniform(-0.09, 0.04);
  const int turns = writer.Draws().Index(3) + 2;
  for (int k = 0; k < turns; ++k) {
    const double begin = writer.Now();
    Vector3d place = writer.Before(left + writer.Uniform(-0.015, 0.015), forward, 0.0);
    place.z() = writer.Eyes().z() - below + writer.Uniform(-0.02, 0.02);
    const double come = k == 0 ? writer.Time(0.75, 1.1) : writer.Time(0.5, 0.8);
    writer.MoveTo(Anchor::kWorld, UprightPoses(object.middle, place, 18, {0.5}), come,
                  writer.Time(0.15, 0.45));
    if (k > 0) writer.Last().turned_rad = writer.Degrees(35.0, 80.0);
    writer.LookAtObject(begin + 0.05, writer.Uniform(0.75, 0.95));
    writer.Lean(begin, come, writer.Degrees(-1.0, 6.0), writer.Degrees(-4.0, 4.0));
  }
}

void WriteLift(ScriptWriter& writer) {
  const ObjectMarks& object = writer.Scene().object;
  const double begin = writer.Now(), come = writer.Time(0.6, 1.0);
  const Vector3d start = writer.Script().keys.front().poses.front() * object.middle;
  const Vector3d place = start + Vector3d(writer.Uniform(-0.04, 0.06), writer.Uniform(0.0, 0.07),
                                          writer.Uniform(0.14, 0.36));
  writer.MoveTo(Anchor::kWorld, UprightPoses(object.middle, place, 36), come,
                writer.Time(0.4, 1.2));
  writer.Last().bulge.setZero();
  writer.LookAtObject(begin, writer.Uniform(0.5, 0.9));
  writer.Lean(begin, come, writer.Degrees(-2.0, 4.0), writer.Degrees(-3.0, 3.0));
}

void WritePour(ScriptWriter& writer) {
  const ObjectMarks& object = writer.Scene().object;
  const bool spout = std::abs(object.forward.z()) < 0.5;
  const double begin = writer.Now(), come = writer.Time(0.75, 1.1);
  const Vector3d place = writer.Before(writer.Uniform(-0.04, 0.14), writer.Uniform(0.72, 0.92),
                                       -writer.Uniform(0.14, 0.24));
  const double most = spout ? writer.Degrees(28.0, 45.0)
                            : writer.Degrees(object.rim_radius > 0.025 ? 55.0 : 70.0, 92.0);
  writer.MoveTo(Anchor::kWorld, Tipped(object, place, writer.Degrees(3.0, 10.0)), come, 0.05);
  writer.MoveTo(Anchor::kWorld, Tipped(object, place, most), writer.Time(0.55, 0.85),
                writer.Time(0.5, 1.2));
  writer.MoveTo(Anchor::kWorld, Tipped(object, place, writer.Degrees(2.0, 8.0)),
                writer.Time(0.4, 0.65), 0.1);
  writer.LookAtObject(begin, writer.Uniform(0.6, 0.9));
  writer.Lean(begin, come, writer.Degrees(2.0, 8.0), writer.Degrees(-2.0, 5.0));
}

void WriteOffhand(ScriptWriter& writer) {
  const ObjectMarks& object = writer.Scene().object;
  const double begin = writer.Now(), come = writer.Time(0.75, 1.1);
  const Vector3d middle = writer.Before(writer.Uniform(-0.04, 0.03), writer.Uniform(0.54, 0.66),
                                        -writer.Uniform(0.14, 0.26));
  std::vector<Isometry3d> meet = UprightPoses(object.middle, middle, 24, {0.4});
  HandoverKey handover;
  const double both = writer.Time(0.15, 0.35);
  handover.key = writer.MoveTo(Anchor::kWorld, std::move(meet), come, both);
  handover.meet_begin_s = begin + writer.Uniform(0.0, 0.25);
  handover.both_begin_s = writer.Last().arrive_s;
  handover.both_end_s = writer.Now();
  handover.free_s = writer.Now() + writer.Time(0.7, 1.0);
  const double leave = writer.Now(), away = writer.Time(0.7, 1.05);
  const Vector3d end = writer.Before(writer.Uniform(0.08, 0.24), writer.Uniform(0.55, 0.75),
                                     -writer.Uniform(0.2, 0.36));
  writer.MoveTo(Anchor::kWorld, UprightPoses(object.middle, end, 24, {0.4}), away,
                writer.Time(0.3, 0.7));
  writer.Script().handover = handover;
  writer.LookAtObject(begin, writer.Uniform(0.6, 0.9));
  writer.Lean(begin, come, writer.Degrees(1.0, 5.0), writer.Degrees(-2.0, 4.0));
  writer.Lean(leave, away, writer.Degrees(0.0, 4.0), writer.Degrees(-3.0, 3.0));
}

}  // namespace holdfast
