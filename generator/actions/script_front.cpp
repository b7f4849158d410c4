// SPDX-License-Identifier: MIT
#include <cmath>

#include "generator/actions/script_intents.h"

// Intents whose object stays before the body. Places are in the world.

namespace holdfast {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

// Tipped by `tilt` towards where the spout points, which is at `place`.
std::vector<Isometry3d> Tipped(const ObjectMarks& object, const Vector3d& place, double tilt) {
  std::vector<Isometry3d> poses;
  const bool spout = std::abs(object.forward.z()) < 0.5;
  for (int k = -3; k <= 7; ++k) {  // from the left, forwards
    const double angle = 15.0 * kDegreeOfScript * k;
    const Vector3d to(std::cos(angle), -std::sin(angle), 0.0);
    const Matrix3d tip = AngleAxisd(tilt, Vector3d::UnitZ().cross(to)).matrix();
    if (spout) {
      const Matrix3d upright = AlignAxes(object.forward, Vector3d::UnitZ(), to, Vector3d::UnitZ());
      poses.push_back(PoseAt(tip * upright, object.tip, place));
    } else if (k % 2 == 0) {
      for (int turn = 0; turn < 18; ++turn) {
        const AngleAxisd yaw(20.0 * kDegreeOfScript * turn, Vector3d::UnitZ());
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
