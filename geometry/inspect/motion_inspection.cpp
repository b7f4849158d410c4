// SPDX-License-Identifier: MIT
#include "geometry/inspect/motion_inspection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/conventions/series.h"
#include "geometry/error.h"
#include "geometry/io/container/gzip.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/io/motion/asf_amc.h"
#include "geometry/io/motion/bvh.h"
#include "geometry/io/motion/motion_limits.h"
#include "geometry/retarget/skeleton_map.h"

namespace holdfast {
namespace {

constexpr double kBvhUnit_m = 0.01;  // what ReadBvh multiplies by
constexpr double kLeg_m = 0.84;      // hip to knee to ankle of an adult
constexpr std::size_t kShownJoints = 6;

// Hip to knee to ankle, mean of both legs, in the reader's metres.
double LegLength(const SourceMotion& motion, const SkeletonMap& map) {
  double sum = 0.0;
  for (const auto& [hip, knee, ankle] : {std::array{1, 4, 7}, {2, 5, 8}}) {
    const auto at = [&](int joint) { return motion.positions[0].col(map.source[joint]); };
    sum += (at(hip) - at(knee)).norm() + (at(knee) - at(ankle)).norm();
  }
  return 0.5 * sum;
}

void JudgeUnit(const SourceMotion& motion, const SkeletonMap& map, Inspection& inspection) {
  const double leg = LegLength(motion, map);
  const bool bvh = motion.format == "BVH";
  struct Unit {
    const char* name;
    double metres;
  };
  static constexpr Unit kUnits[] = {{"centimetres", 0.01},
                                    {"metres", 1.0},
                                    {"millimetres", 0.001},
                                    {"inches", 0.0254},
                                    {"CMU's units (inches / 0.45)", 0.0254 / 0.45}};
  const double raw = bvh ? leg / kBvhUnit_m : leg;
  const Unit* best = &kUnits[0];
  for (const Unit& unit : kUnits) {
    if (std::fabs(std::log(raw * unit.metres / kLeg_m)) <
        std::fabs(std::log(raw * best->metres / kLeg_m))) {
      best = &unit;
    }
  }
  const double length_m = raw * (bvh ? best->metres : 1.0);
  inspection.AddFact("leg_length_m", length_m, "");
  if (!bvh) {
    if (length_m > 0.55 && length_m < 1.15) {
      inspection.Ok(fmt::format("a person's size: legs of {:.2f} m", length_m));
    } else {
      inspection.Warn(fmt::format("legs of {:.2f} m in the unit that the skeleton names", length_m),
                      "give --metres-per-unit to import");
    }
    return;
  }
  inspection.AddFact("unit", best->name, "");
  inspection.AddFact("metres_per_unit", best->metres, "");
  if (length_m < 0.55 || length_m > 1.15) {
    inspection.Warn(fmt::format("legs are {:.3g} units long: in no common unit an adult's", raw),
                    "import scales the motion to the body; give --metres-per-unit if it matters");
  } else {
    inspection.Ok(fmt::format("legs of {:.4g} units: {} would make them {:.2f} m", raw, best->name,
                              length_m));
  }
}

// An axis and a direction along it.
struct Up {
  int axis = 1;
  int sign = 1;
  double share = 0;      // of the frames in which the head is over the feet along it
  bool certain = false;  // else the body lies or crawls, or does so too often
};

Eigen::Vector3d HeadOverFeet(const Eigen::Matrix3Xd& positions, const SkeletonMap& map, int head) {
  return positions.col(head) - 0.5 * (positions.col(map.source[7]) + positions.col(map.source[8]));
}

// Height of the lowest joint along an axis, median over frames: near zero along what is up in most
// files.
double FloorAlong(const SourceMotion& motion, int axis, int sign) {
  std::vector<double> lowest;
  for (const Eigen::Matrix3Xd& p : motion.positions) {
    lowest.push_back((sign * p.row(axis)).minCoeff());
  }
  return Median(lowest);
}

Up FindUp(const SourceMotion& motion, const SkeletonMap& map) {
  Up up;
  const int head = map.source[15] >= 0 ? map.source[15] : map.source[12];
  if (head < 0) return up;
  const double leg = LegLength(motion, map);
  std::array<std::vector<double>, 3> component;
  std::array<int, 3> nearest = {0, 0, 0};
  for (const Eigen::Matrix3Xd& p : motion.positions) {
    const Eigen::Vector3d along = HeadOverFeet(p, map, head);
    int axis = 0;
    along.cwiseAbs().maxCoeff(&axis);
    ++nearest[axis];
    for (int k = 0; k < 3; ++k) component[k].push_back(along[k]);
  }
  const int axis = static_cast<int>(std::ranges::max_element(nearest) - nearest.begin());
  const double along = Median(component[axis]);
  const double share = double(nearest[axis]) / motion.NumFrames();
  if (share < 0.6) return up;

  // Someone who lies looks like someone who stands along another axis: believed where the rest pose
  // stands along it too, or where the floor is at zero along it and not along the rest pose's.
  Eigen::Matrix3Xd rest = motion.rest_offsets;
  for (int j = 0; j < motion.NumJoints(); ++j) {
    if (motion.parents[j] >= 0) rest.col(j) += rest.col(motion.parents[j]);
  }
  const Eigen::Vector3d resting = HeadOverFeet(rest, map, head);
  int rest_axis = 1;
  if (resting.norm() > leg) resting.cwiseAbs().maxCoeff(&rest_axis);
  const int sign = along < 0 ? -1 : 1;
  const bool floor_here = std::fabs(FloorAlong(motion, axis, sign)) < 0.25 * leg;
  const bool floor_at_rest_axis = std::fabs(FloorAlong(motion, rest_axis, 1)) < 0.25 * leg;
  constexpr double kStandingLegs = 1.4;  // head over ankles: 1.7 legs upright, 1.2 on all fours
  const bool stands = std::fabs(along) > kStandingLegs * leg;
  if (axis == rest_axis ? std::fabs(along) > 0.8 * leg
                        : stands && floor_here && !floor_at_rest_axis) {
    return {axis, sign, share, true};
  }
  return up;
}

void JudgeUp(const SourceMotion& motion, const SkeletonMap& map, Inspection& inspection,
             std::string& options) {
  const Up up = FindUp(motion, map);
  const std::string axis = fmt::format("{}{}", up.sign < 0 ? "-" : "", "xyz"[up.axis]);
  inspection.AddFact("up_axis", up.certain ? axis : "undecided", "");
  if (!up.certain) {
    inspection.Warn("up cannot be told: the body lies, crawls or bends for long",
                    "import takes y as up, as is the custom; give --up z if it is z");
  } else if (axis == "y") {
    inspection.Ok(fmt::format("y is up, as is the custom (in {:.0f} % of frames)", 100 * up.share));
  } else if (axis == "z") {
    inspection.Ok(
        fmt::format("z is up (in {:.0f} % of frames): import with --up z", 100 * up.share));
    options += " --up z";
  } else {
    inspection.Fault(fmt::format("{} is up", axis), "turn the motion to y or z up");
  }
}

void JudgeLeaps(const SourceMotion& motion, const SkeletonMap& map, Inspection& inspection) {
  const double large = 0.3 * LegLength(motion, map);
  std::vector<int> frames;
  for (const int joint : {0, 7, 8, 15, 20, 21}) {
    const int source = map.source[joint];
    if (source < 0) continue;
    std::vector<double> steps;
    for (int t = 1; t < motion.NumFrames(); ++t) {
      steps.push_back(
          (motion.positions[t].col(source) - motion.positions[t - 1].col(source)).norm());
    }
    for (std::size_t k = 0; k < steps.size(); ++k) {
      if (IsLeap(steps, k, large)) frames.push_back(static_cast<int>(k) + 1);
    }
  }
  std::ranges::sort(frames);
  frames.erase(std::unique(frames.begin(), frames.end()), frames.end());
  inspection.AddFact("leaps", static_cast<double>(frames.size()), "");
  if (frames.empty()) return;
  const std::size_t count = frames.size();
  frames.resize(std::min(count, kShownJoints));
  // A first frame in the T-pose is a custom, not a fault.
  const bool only_start = count == 1 && frames[0] == 1;
  if (only_start) {
    inspection.Warn(
        "frame 0 is a pose of its own (a T-pose is customary); the motion begins in "
        "frame 1",
        "leave the first frame out of what you use");
  } else {
    inspection.Warn(fmt::format("leaps in {} frame{} ({}{})", count, count == 1 ? "" : "s",
                                fmt::join(frames, ", "), count > kShownJoints ? ", ..." : ""),
                    "cut the motion there");
  }
}

void Describe(const SourceMotion& motion, Inspection& inspection) {
  inspection.AddFact(
      "frames", motion.NumFrames(),
      fmt::format("{} frames at {:.4g} Hz: {:.2f} s; {} joints", motion.NumFrames(),
                  motion.frame_rate, motion.NumFrames() / motion.frame_rate, motion.NumJoints()));
  inspection.AddFact("frame_rate_hz", motion.frame_rate, "");
  inspection.AddFact("joints", motion.NumJoints(), "");
  for (const std::string& note : motion.notes) {
    inspection.Warn(note, "nothing to do: it is read this way");
  }
  std::string options;
  try {
    const SkeletonMap map = RecognizeSkeleton(motion, inspection.path.string());
    int body = 0, fingers = 0;
    for (int j = 0; j < kNumJoints; ++j) {
      if (map.source[j] >= 0) ++(j < kNumBodyJoints ? body : fingers);
    }
    inspection.AddFact("skeleton", map.name, "");
    const std::vector<std::string> unused = map.UnusedSourceJoints(motion);
    inspection.AddFact("unused_joints", static_cast<double>(unused.size()), "");
    inspection.Ok(fmt::format("skeleton '{}' is known: {} of 22 body joints, {} of hands and face",
                              map.name, body, fingers));
    JudgeUnit(motion, map, inspection);
    JudgeUp(motion, map, inspection, options);
    JudgeLeaps(motion, map, inspection);
  } catch (const Error& error) {
    inspection.AddFact("skeleton", "unknown", "");
    inspection.Fault(error.Problem(), error.Remedy());
    options += " --map map.json";
  }
  inspection.next.push_back(fmt::format("holdfast import {} -o {}{}", ShellWord(inspection.path),
                                        ShellWord(Stem(inspection.path) + ".npz"), options));
}

// One frame of an .amc in which every bone that the skeleton lets turn does not.
std::string RestFrame(const std::string& asf) {
  std::string frame = ":FULLY-SPECIFIED\n:DEGREES\n1\n";
  TextScanner words("", asf, '#');
  std::string bone;
  while (!words.AtEnd()) {
    const std::string_view word = words.Next();
    if (EqualIgnoringCase(word, ":root")) bone = "root";
    if (EqualIgnoringCase(word, "name")) bone = words.PeekOnLine();
    const bool root_order = bone == "root" && EqualIgnoringCase(word, "order");
    if (!root_order && !EqualIgnoringCase(word, "dof")) continue;
    frame += bone;
    while (!words.PeekOnLine().empty()) {
      words.Next();
      frame += " 0";
    }
    frame += '\n';
  }
  return frame;
}

}  // namespace

void InspectMotion(Inspection& inspection) {
  SourceMotion motion;
  try {
    motion = inspection.identity.kind == FileKind::kBvh ? ReadBvh(inspection.path, kBvhUnit_m)
                                                        : ReadAmc(inspection.path);
    RequireInRange(motion, inspection.path.string());
  } catch (const Error& error) {
    inspection.Fault(fmt::format("{}: {}", error.Where(), error.Problem()), error.Remedy());
    return;
  }
  if (inspection.identity.kind == FileKind::kAmc) {
    inspection.Warn(
        fmt::format("AMC files have no frame rate: {:g} Hz taken, CMU's", motion.frame_rate),
        "give another to import with --source-fps");
  }
  Describe(motion, inspection);
}

void InspectAsf(Inspection& inspection) {
  try {
    // A frame at rest is all that it takes to have the skeleton read and checked.
    const std::string text = ReadGzipText(inspection.path);
    const SourceMotion motion =
        ParseAmc(text, inspection.path.string(), RestFrame(text), "its rest pose");
    inspection.AddFact("joints", motion.NumJoints(), fmt::format("{} joints", motion.NumJoints()));
    const SkeletonMap map = RecognizeSkeleton(motion, inspection.path.string());
    inspection.AddFact("skeleton", map.name, "");
    inspection.Ok(
        fmt::format("skeleton '{}' is known: {} joints of SMPL-X", map.name, map.NumMapped()));
    JudgeUnit(motion, map, inspection);
  } catch (const Error& error) {
    inspection.Fault(fmt::format("{}: {}", error.Where(), error.Problem()), error.Remedy());
    return;
  }
  inspection.next.push_back(
      fmt::format("holdfast import MOTION.amc --asf {} -o MOTION.npz", ShellWord(inspection.path)));
}

}  // namespace holdfast
