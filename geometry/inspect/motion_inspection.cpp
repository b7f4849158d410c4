// SPDX-License-Identifier: MIT
#include "geometry/inspect/motion_inspection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/conventions/posture.h"
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

void JudgeUp(const SourceMotion& motion, const SkeletonMap& map, Inspection& inspection,
             std::string& options) {
  const MotionUp up = FindMotionUp(motion, map);
  const std::string_view axis = UpAxisName(up.axis);
  inspection.AddFact("up_axis", up.certain ? std::string(axis) : "undecided", "");
  if (!up.certain) {
    inspection.Warn("up cannot be told: the body lies, crawls or bends for long",
                    "import takes y as up, as is the custom; give --up z if it is z");
  } else if (up.axis == UpAxis::kY) {
    inspection.Ok(fmt::format("y is up, as is the custom (in {:.0f} % of frames)", 100 * up.share));
  } else {
    inspection.Ok(fmt::format("{} is up (in {:.0f} % of frames): every command takes it so", axis,
                              100 * up.share));
    options += fmt::format(" --up={}", axis);
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
