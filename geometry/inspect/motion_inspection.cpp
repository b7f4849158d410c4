// SPDX-License-Identifier: MIT
#include "geometry/inspect/motion_inspection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/clip/clip.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/conventions/hand_evidence.h"
#include "geometry/conventions/posture.h"
#include "geometry/error.h"
#include "geometry/import/load_clip.h"
#include "geometry/inspect/clip_findings.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/io/motion/asf_amc.h"
#include "geometry/io/motion/bvh.h"
#include "geometry/io/motion/motion_file.h"
#include "geometry/retarget/skeleton_map.h"

namespace holdfast {
namespace {

constexpr double kBvhUnit_m = 0.01;  // scale given to ReadBvh
constexpr double kLeg_m = 0.84;      // adult leg: hip to knee to ankle
constexpr std::size_t kShownJoints = 6;

void JudgeUnit(const SourceMotion& motion, const SkeletonMap& map, Inspection& inspection) {
  const double leg = LegLength(motion, map);
  const bool bvh = motion.format == "BVH";
  static constexpr std::pair<const char*, double> kUnits[] = {
      {"centimeters", 0.01},
      {"meters", 1.0},
      {"millimeters", 0.001},
      {"inches", 0.0254},
      {"CMU's units (inches / 0.45)", 0.0254 / 0.45}};
  const double raw = bvh ? leg / kBvhUnit_m : leg;
  const auto& [unit, meters] = *std::ranges::min_element(
      kUnits, {}, [&](const auto& one) { return std::fabs(std::log(raw * one.second / kLeg_m)); });
  const double length_m = raw * (bvh ? meters : 1.0);
  inspection.AddFact("leg_length_m", length_m, "");
  if (!bvh) {
    if (length_m > 0.55 && length_m < 1.15) {
      inspection.Ok(fmt::format("a person's size: legs of {:.2f} m", length_m));
    } else {
      inspection.Warn(
          fmt::format("legs of {:.2f} m in the unit that the skeleton states", length_m),
          "give --meters-per-unit to import");
    }
    return;
  }
  inspection.AddFact("unit", unit, "");
  inspection.AddFact("meters_per_unit", meters, "");
  if (length_m < 0.55 || length_m > 1.15) {
    inspection.Warn(
        fmt::format("legs are {:.3g} units long, which is not an adult's size in any common unit",
                    raw),
        "import scales the motion to the body; give --meters-per-unit if it matters");
  } else {
    inspection.Ok(
        fmt::format("legs of {:.4g} units: {} would make them {:.2f} m", raw, unit, length_m));
  }
}

void JudgeUp(const SourceMotion& motion, const SkeletonMap& map, Inspection& inspection,
             std::string& options) {
  const MotionUp up = FindMotionUp(motion, map);
  const std::string_view axis = UpAxisName(up.axis);
  inspection.AddFact("up_axis", up.certain ? std::string(axis) : "undecided", "");
  if (!up.certain) {
    inspection.Warn("the up axis is ambiguous: the body lies, crawls or bends for long",
                    "import uses y as up by convention; give --up z if z is up");
  } else if (up.axis == UpAxis::kY) {
    inspection.Ok(fmt::format("y is up, as usual (in {:.0f} % of frames)", 100 * up.share));
  } else {
    inspection.Ok(fmt::format("{} is up (in {:.0f} % of frames): all commands use this axis", axis,
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
  // A T-pose as first frame is customary, not a fault.
  const bool only_start = count == 1 && frames[0] == 1;
  if (only_start) {
    inspection.Warn("frame 0 is a separate pose (often a T-pose); the motion begins in frame 1",
                    "skip the first frame");
  } else {
    inspection.Warn(
        fmt::format("discontinuities in {} frame{} ({}{})", count, count == 1 ? "" : "s",
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

// Returns one .amc frame in which every degree of freedom of the skeleton is zero.
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
  const SourceMotion motion = inspection.identity.kind == FileKind::kBvh
                                  ? ReadBvh(inspection.path, kBvhUnit_m)
                                  : ReadAmc(inspection.path);
  RequireInRange(motion, inspection.path.string());
  if (inspection.identity.kind == FileKind::kAmc) {
    inspection.Warn(
        fmt::format("AMC files have no frame rate: assuming CMU's {:g} Hz", motion.frame_rate),
        "give another to import with --source-fps");
  }
  Describe(motion, inspection);
}

void InspectAsf(Inspection& inspection) {
  // One frame at rest is enough to read and check the skeleton.
  const std::string text = ReadGzipText(inspection.path);
  const SourceMotion motion =
      ParseAmc(text, inspection.path.string(), RestFrame(text), "its rest pose");
  inspection.AddFact("joints", motion.NumJoints(), fmt::format("{} joints", motion.NumJoints()));
  const SkeletonMap map = RecognizeSkeleton(motion, inspection.path.string());
  inspection.AddFact("skeleton", map.name, "");
  inspection.Ok(
      fmt::format("skeleton '{}' is known: {} joints of SMPL-X", map.name, map.NumMapped()));
  JudgeUnit(motion, map, inspection);
  inspection.next.push_back(
      fmt::format("holdfast import MOTION.amc --asf {} -o MOTION.npz", ShellWord(inspection.path)));
}

namespace {

void DescribeArrays(const LooseMotion& motion, Inspection& inspection) {
  std::map<std::string, std::vector<std::string>> groups;
  std::vector<std::string> all;
  for (const LooseArray& array : motion.arrays) {
    const bool turns = array.role != "root position" && array.role != "object position";
    const std::string how =
        turns ? fmt::format("{} {}", array.type, Describe(array.form)) : array.type;
    groups[how].push_back(fmt::format("{} {}", array.key, array.shape));
    all.push_back(fmt::format("{} {} {}", array.key, array.shape, how));
  }
  inspection.AddFact("arrays", fmt::format("{}", fmt::join(all, "; ")), "");
  for (const auto& [how, arrays] : groups) {
    inspection.AddFact("", "", fmt::format("{}: {}", how, fmt::join(arrays, ", ")));
  }
  for (const LooseArray& array : motion.arrays) {
    if (array.out_of_range > 0) {
      inspection.Fault(
          fmt::format("{} holds {} NaN, infinite or huge numbers, the first in frame {}", array.key,
                      array.out_of_range, array.first_out_of_range),
          "cut these frames out or fill them in");
    }
    if (array.form == RotationForm::kMatrix && array.orthonormality_off > 1e-3) {
      inspection.Warn(fmt::format("{} holds matrices that are not rotations (R'R is off by {:.2g})",
                                  array.key, array.orthonormality_off),
                      "use the nearest rotations (singular value decomposition)");
    }
    if (array.form == RotationForm::kCoefficients) {
      const bool hand = array.role.find("hand") != std::string::npos;
      inspection.Fault(
          fmt::format("{} has shape {}, which is not a rotation format{}", array.key, array.shape,
                      hand ? ": coefficients of the model's hand components" : ""),
          hand ? "multiply them with the model's hands_components, and add hands_mean"
               : "check how the program that wrote it stores rotations");
    }
    const bool clip_array = array.role != "object rotation";
    if (clip_array &&
        (array.form == RotationForm::kMatrix || array.form == RotationForm::kQuaternion ||
         array.form == RotationForm::kSixD)) {
      inspection.Fault(
          fmt::format("{} holds {} where axis-angle is needed", array.key, Describe(array.form)),
          "write it as axis-angle (scipy's Rotation.as_rotvec)");
    }
  }
  for (const std::string& problem : motion.problems) {
    inspection.Fault(problem, "save it again as plain numbers");
  }
}

void DescribeModel(const LooseMotion& motion, Inspection& inspection) {
  const auto text = [&](const char* key) {
    const auto found = motion.texts.find(key);
    return found == motion.texts.end() ? std::string() : found->second;
  };
  const std::string type = text("surface_model_type"), gender = text("gender"),
                    body = text("body_model");
  if (motion.IsHandAlone()) {
    const std::string hand = "a hand alone (MANO), as a body's";
    inspection.AddFact("body", hand, "body: " + hand + (body.empty() ? "" : " '" + body + "'"));
    return;
  }
  std::string line = motion.num_joints == 52   ? "SMPL-H (52 joints)"
                     : motion.num_joints == 24 ? "SMPL (24 joints)"
                                               : "SMPL-X (55 joints)";
  inspection.AddFact("body_model_family", line, "");
  if (!body.empty()) line += fmt::format(", of the model '{}'", body);
  if (!gender.empty()) line += ", " + gender;
  line += motion.num_betas < 0 ? ", no betas" : fmt::format(", {} betas", motion.num_betas);
  inspection.AddFact("body", line, "body: " + line);
  const bool model_unlike = !type.empty() && motion.num_joints == kNumJoints && type != "smplx" &&
                            type != "smplx_locked_head";
  if (model_unlike) {
    inspection.Warn(fmt::format("surface_model_type is '{}', but the arrays are SMPL-X's", type),
                    "trust the arrays, or ask who wrote the file");
  }
}

}  // namespace

void InspectClip(Inspection& inspection) {
  const std::string word = ShellWord(inspection.path);
  LooseMotion motion;
  try {
    motion = ReadLooseMotion(NpzReader(inspection.path));
  } catch (const Error& error) {
    inspection.Fault(error.Problem(), error.Remedy());
    return;
  }
  if (motion.has_object) inspection.title += ", with an object";
  if (motion.frame_rate > 0) {
    inspection.AddFact("frames", motion.frames,
                       fmt::format("{} frames at {:g} Hz: {:.2f} s", motion.frames,
                                   motion.frame_rate, motion.frames / motion.frame_rate));
    inspection.AddFact("frame_rate_hz", motion.frame_rate, "");
    if (motion.frame_rate < 5 || motion.frame_rate > 1000) {
      inspection.Warn(fmt::format("a frame rate of {:g} Hz is unusual", motion.frame_rate),
                      "check mocap_frame_rate");
    }
  } else {
    inspection.AddFact(
        "frames", motion.frames,
        fmt::format("{} frame{}, no frame rate", motion.frames, motion.frames == 1 ? "" : "s"));
  }
  DescribeModel(motion, inspection);
  DescribeArrays(motion, inspection);
  Clip turned;
  turned.pose = std::move(motion.pose);
  if (const std::string note = WrapJointAngles(turned); !note.empty()) {
    inspection.Warn(note.substr(std::string_view("warning: ").size()), "");
  }
  motion.pose = std::move(turned.pose);
  if (motion.lengths_differ) {
    inspection.Fault("the arrays have different numbers of frames", "cut them to the same length");
  }
  const bool too_long = motion.frames >= static_cast<int>(kMaxLooseFrames);
  if (too_long) {
    inspection.Fault(fmt::format("more than {} frames", kMaxLooseFrames), "cut it into parts");
  }

  // Report what fit, render and other commands would report.
  if (inspection.Worst() != Verdict::kFault) {
    try {
      const NpzReader archive(inspection.path);
      ReadClip(archive);
      if (const auto note = OldPelvisNote(archive)) inspection.Ok(*note);
    } catch (const Error& error) {
      const std::string where = error.Where();
      const auto bracket = where.rfind('[');
      inspection.Fault(fmt::format("{} {}",
                                   bracket == std::string::npos
                                       ? "the file"
                                       : where.substr(bracket + 1, where.size() - bracket - 2),
                                   error.Problem()),
                       error.Remedy());
    }
  }
  if (motion.frames > 0 && !too_long) {
    const auto body = BodyModel::Default();
    const double meters_per_unit = DescribeBodyMotion(motion, *body, inspection);
    DescribeHands(motion, *body, inspection);
    DescribeObject(motion, *body, meters_per_unit, inspection);
    if (inspection.Worst() != Verdict::kFault) {
      LoadedClip clip;
      clip.file = inspection.path;
      clip.clip = ReadClip(inspection.path);
      ClipObject object;
      try {
        object = FindClipObject(clip);
      } catch (const Error& error) {
        inspection.Fault(fmt::format("{} {}", error.Where(), error.Problem()), error.Remedy());
      }
      if (!object.missing.empty()) {
        inspection.AddFact("object_missing", object.missing,
                           "no mesh of the object: " + object.missing);
      }
      if (object.by_name) object.mesh.reset();
      DescribeOnBody(clip.clip, object.mesh, body, inspection);
    }
  }

  if (inspection.Worst() != Verdict::kFault) {
    const std::string stem = Stem(inspection.path);
    if (motion.IsHandAlone()) {
      ProposeForHandAlone(ReadClip(inspection.path), word, ShellWord(stem), inspection);
    } else if (motion.has_object) {
      inspection.next.push_back(fmt::format("holdfast score {}", word));
      inspection.next.push_back(
          fmt::format("holdfast report {} -o {}.html", word, ShellWord(stem)));
      inspection.next.push_back(
          fmt::format("holdfast render {} -o {}.mp4 --camera hand", word, ShellWord(stem)));
    } else {
      inspection.next.push_back(
          fmt::format("holdfast fit {} mug -o {}", word, ShellWord(stem + "_held")));
      inspection.next.push_back(fmt::format("holdfast render {} -o {}.png", word, ShellWord(stem)));
    }
  }
}

}  // namespace holdfast
